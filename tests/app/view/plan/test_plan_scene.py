import msgspec
import numpy as np
import pytest

from app.view.model.scene_model import SceneModel
from app.view.plan.plan_cells import Cell
from app.view.plan.plan_scene import THINGS, cells_of, furniture_of, plan_scene
from tests.app.nodes.console.drawn_home import things_of


def test_the_flat_has_walls_floor_and_furniture(flat):
    plan = cells_of(flat)

    def at(x, y):
        return Cell(
            plan.cells[tuple(np.floor((np.array([x, y]) - plan.origin_m) / 0.1).astype(int))]
        )

    assert at(2.0, 2.0) is Cell.FLOOR
    assert at(6.6, 4.9) is Cell.FURNITURE
    assert at(4.05, 1.0) is Cell.WALL
    assert at(4.05, 2.8) is Cell.FLOOR, "the door"


def test_everything_that_is_drawn_over_it_is_told(flat):
    scene = plan_scene(flat)
    assert scene.robot == pytest.approx((4.6, 2.6, 1.0))
    assert scene.find == (2.4, 5.2, "hat")
    assert [room.kind for room in scene.rooms] == ["living room", ""]
    assert scene.things[0].text == "bed"
    assert scene.trail == [(4.0, 2.6), (4.6, 2.6)]


def test_only_large_things_that_are_there_are_named():
    sofa, table, *_ = things_of()
    small = msgspec.structs.replace(sofa, size_m=(0.1, 0.1, 0.1))
    gone = msgspec.structs.replace(table, gone_ns=5)
    wall = msgspec.structs.replace(sofa, label="wall")
    assert [one.text for one in furniture_of((small, gone, wall, sofa))] == ["sofa"]
    assert len(furniture_of((sofa,) * 500)) == THINGS


def test_without_a_map_there_is_no_plan():
    assert cells_of(SceneModel()) is None
    assert plan_scene(SceneModel()).robot is None
