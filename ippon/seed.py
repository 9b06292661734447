"""What a seed may be."""

from typing import Final

LARGEST_SEED: Final = 2**63 - 1
"""Of 63 bits, which simulated errors are keyed by."""


def check_seed(seed: int) -> None:
    """Refuse a seed that is negative or too large.

    Raises:
        ValueError: With the seed, and what would do.
    """
    if not 0 <= seed <= LARGEST_SEED:
        raise ValueError(f"a seed is a whole number from 0 to 2^63 - 1; got {seed}")
