import numpy as np
import pytest

from app.messages.driving import PaintedStroke
from app.view.model.painted_area import mapped_m2
from app.view.model.voxel_store import VoxelStore, VoxelUpdate


@pytest.fixture
def floor():
    """A floor of 4 m by 4 m with a wall of ten voxels in height over one column."""
    flat = [(x, y, 0) for x in range(40) for y in range(40)]
    indices = np.array([*flat, *((5, 5, z) for z in range(1, 11))], np.int64)
    store = VoxelStore()
    store.apply(
        VoxelUpdate(
            indices=indices,
            attributes=np.full((len(indices), 8), 200, np.uint8),
            surface=np.ones(len(indices), bool),
        )
    )
    return store


@pytest.mark.parametrize(
    ("strokes", "area"),
    [
        ([(2.0, 2.0)], np.pi * 0.25),
        # Dabs that overlap are counted once.
        ([(2.0, 2.0), (2.0, 2.0)], np.pi * 0.25),
        # Half of it is beyond the map.
        ([(0.0, 2.0)], np.pi * 0.125),
        ([(9.0, 9.0)], 0.0),
        ([], 0.0),
    ],
)
def test_the_area_is_that_of_the_map_below_the_stroke(floor, strokes, area):
    stroke = PaintedStroke(kind="not_here", strokes=strokes, radius_m=0.5)
    assert mapped_m2(stroke, floor, 0.1) == pytest.approx(area, rel=0.05)
