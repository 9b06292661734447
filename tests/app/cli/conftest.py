"""Rows of an evaluation, and a home of one room as a folder."""

import pytest

from ippon.simulation.scene_writer import save_scene
from tests.boxes import boxes_scene
from tests.evaluation_rows import make_row

_BOXES = (
    ("floor", "floor", (-0.1, -0.1, -0.1), (6.1, 5.1, 0.0)),
    ("wall", "wall", (-0.1, -0.1, 0.0), (0.0, 5.1, 2.5)),
    ("wall", "wall", (6.0, -0.1, 0.0), (6.1, 5.1, 2.5)),
    ("wall", "wall", (0.0, -0.1, 0.0), (6.0, 0.0, 2.5)),
    ("wall", "wall", (0.0, 5.0, 0.0), (6.0, 5.1, 2.5)),
    ("table", "dining table", (4.6, 1.0, 0.0), (5.6, 2.0, 0.7)),
    ("clothes", "hat", (5.0, 1.4, 0.7), (5.3, 1.7, 0.85)),
    ("chair", "armchair", (0.8, 4.1, 0.0), (1.5, 4.8, 0.9)),
)
_STARTS = ((0.8, 0.8), (1.6, 2.4), (2.6, 0.7), (3.2, 4.2))


@pytest.fixture
def room(tmp_path):
    """A folder with a home: an armchair in one corner, a hat on a table in another."""
    folder = tmp_path / "room"
    save_scene(boxes_scene(_BOXES, _STARTS, name="room"), folder)
    return folder


@pytest.fixture(name="make_row")
def make_row_fixture():
    """Rows with figures that a test chooses; everything else is plain."""
    return make_row
