"""A detector that lags while the robot turns, over real sockets."""

import time

import numpy as np
import pytest

from ippon.mapping.objects.ooi_voxels import OoiVoxels
from ippon.observation import Detections, Instance
from ippon.robot import ZED
from ippon.simulation.world import SimulatedWorld, WorldConfig
from tests.app.nodes.navigator.scenarios.standing_robot import CAMERA, wait_until
from tests.boxes import boxes_scene

LAG = 10
"""Frames of a tenth of a second."""
HAT = ((5.2, 2.7, 0.6), (5.8, 3.3, 1.2))
SCENE = boxes_scene(
    (
        ("floor", "floor", (-0.1, -0.1, -0.1), (6.1, 6.1, 0.0)),
        ("wall", "wall", (-0.1, -0.1, 0.0), (0.0, 6.1, 2.5)),
        ("wall", "wall", (6.0, -0.1, 0.0), (6.1, 6.1, 2.5)),
        ("wall", "wall", (0.0, -0.1, 0.0), (6.0, 0.0, 2.5)),
        ("wall", "wall", (0.0, 6.0, 0.0), (6.0, 6.1, 2.5)),
        ("clothes", "hat", *HAT),
    ),
    ((3.0, 3.0),),
)


@pytest.fixture
def world():
    return SimulatedWorld(
        SCENE, ZED, CAMERA, SCENE.start_poses[0], config=WorldConfig.perfect()
    )  # fmt: skip


def seen_in(frame):
    """Return what a detector that never errs says of a frame."""
    rows, columns = (frame.heatmap.probabilities[..., -1] > 127).nonzero()
    instances = ()
    if len(rows):
        box = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
        instances = (Instance(label="hat", score=0.9, box_px=tuple(map(float, box))),)
    h, w = CAMERA.height, CAMERA.width
    return Detections(
        source="x", labels=("hat",), ooi="hat", image_size=(h, w), instances=instances
    )


@pytest.mark.slow
def test_what_comes_a_second_late_is_put_where_the_camera_looked_then(robot):
    waiting = []
    for n in range(80):
        stamp_ns, frame = robot.turn(0.5 if n < 40 else -0.5)
        waiting.append((seen_in(frame), stamp_ns))
        if len(waiting) > LAG:
            robot.send_boxes(*waiting.pop(0))
        time.sleep(0.1)
    # Silent for so long, it has no image that waits.
    wait_until(lambda: robot.statuses[-1].state == "lost")
    voxel_map = robot.navigator._mission.voxel_map
    assert voxel_map.best_ooi() > 0.9
    centres, _ = OoiVoxels(0.5).update(voxel_map.arrays())
    low, high = np.array(HAT)
    outside = np.linalg.norm(np.maximum(low - centres, centres - high).clip(0.0), axis=1)
    # A second of turning is 1.1 m at the hat.
    assert outside.max() < 0.3
