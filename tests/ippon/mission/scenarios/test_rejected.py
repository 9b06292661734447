"""A find that the operator rejects is done with, however little of it was seen."""

import numpy as np
import pytest

from ippon.mapping.config import MapConfig
from ippon.mission.config import MissionConfig
from ippon.mission.finds.find_geometry import ExclusionConfig, ExclusionSphere, exclusion_sphere
from ippon.mission.snapshot import Find, MissionState


def _find(x, size):
    return Find(position_world=(x, 0.0, 0.3), size_m=size, probability=1.0, voxels=40, box_px=None)


def test_what_is_ruled_out_reaches_round_the_find():
    ball = exclusion_sphere(ExclusionConfig(), _find(1.0, (0.6, 0.8, 0.0)))
    assert ball.radius_m == pytest.approx(0.5 + ExclusionConfig().margin_m)
    assert ball.centre_world == pytest.approx((1.0, 0.0, 0.3))


@pytest.mark.parametrize(("x", "continues"), [(1.0, True), (1.6, True), (1.75, False)])
def test_what_begins_where_it_ends_is_more_of_it(x, continues):
    ball = ExclusionSphere(centre_world=np.array([0.0, 0.0, 0.3]), radius_m=1.0, margin_m=0.25)
    assert ball.touches(_find(x, (0.9, 0.2, 0.2))) is continues


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
