"""A sequence of a simulated corner is mapped, and its surface is in viser's scene."""

import json
import math
import runpy
import sys

import numpy as np
import pytest
from PIL import Image

from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.robot import ZED
from ippon.simulation.world import SimulatedWorld, WorldConfig
from tests.boxes import boxes_scene
from tests.locations import ROOT

pytestmark = pytest.mark.process
BOXES = (
    ("floor", "floor", (-0.1, -0.1, -0.1), (6.1, 5.1, 0.0)),
    ("wall", "wall", (2.0, 0.0, 0.0), (2.1, 5.0, 2.5)),
)


@pytest.fixture
def sequence(tmp_path):
    """A folder with six images of a wall 1.2 m ahead, as `sequence.json` names them."""
    camera = PinholeCamera.from_horizontal_fov(160, 100, ZED.horizontal_fov_rad)
    scene = boxes_scene(BOXES, ((0.8, 2.5),), name="corner")
    world = SimulatedWorld(scene, ZED, camera, scene.start_poses[0], config=WorldConfig.perfect())
    frames = []
    for n in range(6):
        frame = world.observe()
        Image.fromarray(frame.color).save(tmp_path / f"{n}.jpg")
        Image.fromarray(np.rint(frame.depth * 1e3).astype(np.uint16)).save(tmp_path / f"{n}.png")
        pose = frame.T_world_camera.tolist()
        frames.append({"color": f"{n}.jpg", "depth": f"{n}.png", "camera_to_world": pose})
        world.step(Command(yaw_rate_rad_s=math.radians(20.0), tilt_rad=-0.3), dt_s=0.5)
    content = {
        "name": "corner", "width": 160, "height": 100, "depth_unit_m": 1e-3, "rate_hz": 2.0,
        "intrinsics": {"fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy},
        "gravity_world": [0, 0, -1], "frames": frames,
    }  # fmt: skip
    (tmp_path / "sequence.json").write_text(json.dumps(content))
    return tmp_path


def test_the_wall_stands_where_it_is_and_is_drawn(sequence, monkeypatch, capsys):
    drawn = []

    def look(_):
        names = ("/surface", "/path", "/camera")
        server = sys._getframe(1).f_globals["server"]
        drawn.extend(name for name in names if name in server.scene._handle_from_node_name)

    monkeypatch.setattr("builtins.input", look)
    monkeypatch.setattr(sys, "argv", ["draw_a_dataset.py", str(sequence), "0.1"])
    after = runpy.run_path(str(ROOT / "examples" / "draw_a_dataset.py"), run_name="__main__")
    assert capsys.readouterr().out.startswith("6 images, ")
    assert drawn == ["/surface", "/path", "/camera"]
    # The map begins below the first camera.
    wall = after["mesh"].vertices[after["mesh"].vertices[:, 2] > 0.5]
    assert len(wall) > 50
    assert np.median(np.abs(wall[:, 0] - 1.2)) < 0.05
