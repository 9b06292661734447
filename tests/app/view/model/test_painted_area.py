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
    assert mapped_m2([stroke], floor, 0.1) == [pytest.approx(area, rel=0.05)]


def test_the_map_is_read_once_for_all_strokes(floor, monkeypatch):
    read, all_voxels = [], floor.all_voxels
    monkeypatch.setattr(floor, "all_voxels", lambda: read.append(1) or all_voxels())
    strokes = [
        PaintedStroke(kind="not_here", strokes=[(x, 2.0)], radius_m=0.5) for x in (0.0, 2.0, 9.0)
    ]
    areas = mapped_m2(strokes, floor, 0.1)
    assert areas == [pytest.approx(area, rel=0.05) for area in (np.pi * 0.125, np.pi * 0.25, 0.0)]
    assert read == [1]
    assert mapped_m2([], floor, 0.1) == []
    assert read == [1]


def test_a_stroke_covers_nothing_of_an_empty_map():
    stroke = PaintedStroke(kind="not_here", strokes=[(1.0, 2.0)], radius_m=0.5)
    assert mapped_m2([stroke], VoxelStore(), 0.0) == [0.0]
