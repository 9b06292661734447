"""A find that the operator rejects is done with, however little of it was seen."""

import pytest

from ippon.mapping.config import MapConfig
from ippon.mission.config import MissionConfig
from ippon.mission.snapshot import MissionState


@pytest.mark.slow
def test_the_rest_of_a_rejected_find_is_no_find_either(searcher, room):
    bed = ("bed", "bed", (3.6, 1.2, 0.0), (7.3, 3.0, 0.55))
    head = ("bed", "bed", (7.3, 1.2, 0.55), (7.4, 3.0, 1.1))
    short_sighted = MissionConfig(map=MapConfig(ooi_max_range_m=3.5))
    robot = searcher([*room(8.5, 4.5), bed, head], 1.0, 2.0, config=short_sighted)
    robot.ask("bed")
    robot.search(60.0)
    assert robot.last.state is MissionState.FOUND
    assert robot.last.find.size_m[0] < 3.6, "its far end was not seen yet"
    assert robot.mission.goals.reject_find()
    again = robot.search(30.0)
    assert MissionState.FOUND not in [r.snapshot.state for r in again]
    # The last corner of its 3.7 m may show as a speck before it is part of anything.
    assert all(c.voxels <= 1 for r in again for c in r.snapshot.candidates)
    assert robot.last.candidates == ()
