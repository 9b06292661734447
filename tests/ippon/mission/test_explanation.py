"""The line that says why the robot goes where it goes."""

import numpy as np
import pytest

from ippon.guidance.levels import BY_OPERATOR, LabelLevel, Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.inspection import inspect_voxel
from ippon.vocabulary import MATTERPORT_40

KITCHEN = [
    ("counter", "counter", (1.0, 3.4, 0.0), (3.0, 4.0, 0.9)),
    ("sink", "sink", (3.1, 3.4, 0.0), (3.7, 4.0, 0.9)),
    ("cabinet", "cabinet", (0.5, 0.0, 0.0), (4.5, 0.4, 2.0)),
    ("wall", "wall", (5.0, 0.0, 0.0), (5.1, 1.5, 2.5)),
    ("wall", "wall", (5.0, 2.4, 0.0), (5.1, 4.0, 2.5)),
]


@pytest.mark.slow
def test_the_object_that_a_level_comes_from_is_named_and_so_is_its_room(searcher, room):
    robot = searcher([*room(9.0, 4.0), *KITCHEN], 1.5, 2.0)
    robot.ask("mug")
    mission = robot.mission
    wanted = "by the counter (near)"
    results = robot.search(60.0, lambda r: wanted in r.snapshot.why)
    assert wanted in results[-1].snapshot.why

    front = np.array([2.2, 3.45, 0.6])
    report = inspect_voxel(mission.voxel_map, front, mission.floor_z_m)
    assert report.labels[0][0] == "counter"
    assert (report.level, report.room()) == (Level.NEAR, "kitchen")

    mug = EmbeddedPrior().levels("mug", "", MATTERPORT_40)
    far = LabelLevel(label="counter", level=Level.FAR, reason=BY_OPERATOR)
    preview = mission.preview(mug.changed([far]))
    assert wanted in preview.now
    assert "counter (near)" not in preview.then
