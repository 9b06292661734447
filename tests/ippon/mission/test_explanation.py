"""The line that says why the robot goes where it goes, with levels by room."""

import numpy as np

from ippon.guidance.levels import BY_OPERATOR, LabelLevel, Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.guidance.rooms import RoomConfig
from ippon.mission.config import MissionConfig
from ippon.mission.inspection import inspect_voxel
from ippon.vocabulary import MATTERPORT_40

KITCHEN = [
    ("counter", "counter", (1.0, 3.4, 0.0), (3.0, 4.0, 0.9)),
    ("sink", "sink", (3.1, 3.4, 0.0), (3.7, 4.0, 0.9)),
    ("cabinet", "cabinet", (0.5, 0.0, 0.0), (4.5, 0.4, 2.0)),
    ("wall", "wall", (5.0, 0.0, 0.0), (5.1, 1.5, 2.5)),
    ("wall", "wall", (5.0, 2.4, 0.0), (5.1, 4.0, 2.5)),
]


def test_a_level_that_comes_from_a_room_names_it_everywhere(searcher, room):
    by_room = MissionConfig(rooms=RoomConfig(enabled=True))
    robot = searcher([*room(9.0, 4.0), *KITCHEN], 1.5, 2.0, config=by_room)
    robot.ask("mug")
    mission = robot.mission
    assert mission.rooms.note.startswith("things count by their room, too: near in the kitchen;")
    wanted = "by the cabinet in the kitchen (near)"
    results = robot.search(60.0, lambda r: wanted in r.snapshot.why)
    assert wanted in results[-1].snapshot.why

    front = np.array([4.2, 0.35, 1.0])
    report = inspect_voxel(mission.voxel_map, front, mission.rooms)
    assert report.labels[0][0] == "cabinet"
    assert (report.level, report.room) == (Level.NEAR, "kitchen")

    mug = EmbeddedPrior().levels("mug", "", MATTERPORT_40)
    far = LabelLevel(label="cabinet", level=Level.FAR, reason=BY_OPERATOR)
    preview = mission.preview(mug.changed([far]))
    assert wanted in preview.now
    assert "cabinet in the kitchen" not in preview.then
