"""A flat floor with boxes on it, as the control modules see it."""

from collections.abc import Callable

import pytest

from ippon.mapping.arrays import MapArrays
from tests.floor_map import floor_with as make_floor


@pytest.fixture
def floor_with() -> Callable[..., MapArrays]:
    return make_floor
