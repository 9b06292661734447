"""What the map takes a proximity level for, apart from the kernels, which load for 0.3 s."""

from typing import Final

LEVEL_PROBABILITIES: Final = (0.02, 0.1, 0.25, 0.6)
"""Default l(O | C) of the proximity levels far, average, near and certain."""
