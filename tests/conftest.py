"""What all tests share; threads and numba's cache are set before any test module is imported."""

import pytest

from app.process.environment import prevent_spinning
from app.process.kernel_cache import use_kernel_cache

prevent_spinning()
use_kernel_cache()


_LONG = ("process", "browser", "slow")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run long files first, and repeat a failed test of processes or of a browser once.

    Two workers take one file after the other: what is left for the end should be short.

    Tests of processes share two cores with one another. A dead-man's switch or a lease that ends
    because a page had no processor time for seconds is right, and not what the test is about. The
    report lists each repetition.
    """
    long = {item.path for item in items if any(map(item.get_closest_marker, _LONG))}
    items.sort(key=lambda item: item.path not in long)
    for item in items:
        if any(map(item.get_closest_marker, ("process", "browser"))):
            item.add_marker(pytest.mark.flaky(reruns=1))
