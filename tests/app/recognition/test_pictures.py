"""Pictures of the page of a recognition."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.recognition.pictures import plan


@pytest.mark.parametrize(("floor_z_m", "is_shown"), [(0.0, False), (3.0, True)])
def test_a_plan_shows_what_is_low_above_the_floor_of_the_map(floor_z_m, is_shown):
    surface = SimpleNamespace(
        # Row 0 of a map's surface stands for no voxel.
        voxel=np.array([-1, 0]),
        color_count=np.array([0, 1]),
        color=np.full((2, 3), 90, np.uint8),
    )
    voxel_map: Any = SimpleNamespace(
        surface=surface,
        config=SimpleNamespace(voxel_size_m=0.1),
        block_coords=np.array([[0, 0, 4]]),
        floor_z_m=floor_z_m,
    )
    assert (plan(voxel_map, []) is not None) == is_shown
