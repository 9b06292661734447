import base64
import json

import numpy as np
import pytest

from app.messages.motion import robot_transforms
from app.view.model.scene_model import SceneModel
from app.view.plan.plan_cells import Cell
from app.view.plan.plan_files import plan_cells_json, plan_json, plan_pgm, plan_yaml
from app.view.plan.plan_scene import cells_of
from ippon.geometry import base_pose
from ippon.robot import ZED
from tests.app.view.plan.conftest import flat_on


def test_the_page_gets_the_cells_with_their_place(flat):
    file = json.loads(plan_cells_json(flat))
    plan = cells_of(flat)
    assert file["size"] == list(plan.cells.shape)
    assert file["cell_m"] == 0.1
    packed = np.frombuffer(base64.b64decode(file["packed"]), np.uint8)
    cells = (packed[:, None] >> np.array([0, 2, 4, 6])) & 3
    np.testing.assert_array_equal(cells.reshape(-1)[: plan.cells.size], plan.cells.reshape(-1))
    assert file["revision"] == json.loads(plan_json(flat))["revision"]


def test_the_map_of_ros_has_its_rows_from_the_north(flat):
    pgm = plan_pgm(flat)
    head, size, deepest, pixels = pgm.split(b"\n", 3)
    width, height = map(int, size.split())
    assert (head, deepest) == (b"P5", b"255")
    image = np.frombuffer(pixels, np.uint8).reshape(height, width)
    plan = cells_of(flat)
    assert (width, height) == plan.cells.shape
    settings = dict(line.split(": ", 1) for line in plan_yaml(flat).decode().splitlines())
    x0, y0, yaw = json.loads(settings["origin"])
    assert (settings["image"], float(settings["resolution"]), yaw) == ("ippon-plan.pgm", 0.1, 0.0)

    def at(x, y):
        """Pixel of a point, as map_server reads it: the origin is the lower left corner."""
        return image[height - 1 - int((y - y0) / 0.1), int((x - x0) / 0.1)]

    assert at(2.0, 2.0) == 254
    assert at(6.6, 4.9) == 0
    assert at(4.05, 1.0) == 0


@pytest.mark.parametrize("layers", [30, -13])
def test_the_map_of_ros_is_that_of_the_robot_s_floor(flat, layers):
    other = flat_on(layers)
    assert plan_pgm(other) == plan_pgm(flat)
    assert plan_yaml(other) == plan_yaml(flat)


def test_the_page_asks_for_the_cells_of_another_floor():
    model = flat_on(0)
    before = json.loads(plan_json(model))["revision"]
    for n in range(3):
        T_world_base = base_pose(4.6, 2.6, 3.0, 1.0)
        moved = robot_transforms(n * 10**9, T_world_base, ZED.T_base_camera(0.0))
        model.on_transforms(moved)
    assert json.loads(plan_json(model))["revision"] != before
    assert not (cells_of(model).cells == Cell.FLOOR).any()


def test_without_a_map_there_is_no_file():
    model = SceneModel()
    assert plan_pgm(model) is plan_yaml(model) is plan_cells_json(model) is None
    assert plan_json(model) is None
