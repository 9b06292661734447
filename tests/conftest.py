"""Set before any test module imports numba."""

from app.cli.kernel_cache import use_kernel_cache

use_kernel_cache()
