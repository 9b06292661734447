"""What all tests share; numba's cache is chosen before any test module imports it."""

import pytest

from app.process.kernel_cache import use_kernel_cache

use_kernel_cache()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let what drives whole processes or a browser try twice; the report tells when it did.

    They share two cores with one another: a dead-man's switch or a lease that ends because a page
    was given no time for seconds is right, and not what the test is about.
    """
    for item in items:
        if any(item.iter_markers("process")) or any(item.iter_markers("browser")):
            item.add_marker(pytest.mark.flaky(reruns=1))
