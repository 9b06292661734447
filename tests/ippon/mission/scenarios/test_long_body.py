"""A body that is longer than wide goes where it fits, and turns where there is room."""

import pytest

from ippon.mission.snapshot import MissionState
from ippon.robot import ZED
from tests.long_robot import LONG


def toilet(x, y):
    return ("toilet", "toilet", (x, y, 0.0), (x + 0.5, y + 0.5, 0.8))


def parted(room, gap_m, *, thick_m=0.2, at_x=3.2, length_m=6.4):
    """Two rooms with a gap in the middle of the wall between them, the toilet in the second."""
    low, high = at_x - 0.5 * thick_m, at_x + 0.5 * thick_m
    return [
        *room(length_m, 4.0),
        ("wall", "wall", (low, 0.0, 0.0), (high, 2.0 - 0.5 * gap_m, 2.5)),
        ("wall", "wall", (low, 2.0 + 0.5 * gap_m, 0.0), (high, 4.0, 2.5)),
        toilet(length_m - 0.7, 0.3),
    ]


@pytest.mark.slow
@pytest.mark.parametrize("gap_m", [0.65, 0.75, 0.9])
def test_a_door_too_narrow_to_turn_in_is_passed(searcher, room, gap_m):
    assert gap_m < 2.0 * LONG.radius_m
    robot = searcher(parted(room, gap_m), 1.5, 3.0, 1.0, robot=LONG)
    robot.ask("toilet")
    robot.search(90.0)
    assert robot.last.state is MissionState.FOUND
    assert robot.at[0] > 4.2
    assert robot.world.collisions == 0


@pytest.mark.slow
def test_a_door_narrower_than_the_body_is_not(searcher, room):
    robot = searcher(parted(room, 0.4), 1.5, 3.0, 1.0, robot=LONG)
    robot.ask("toilet")
    robot.search(120.0)
    assert robot.at[0] < 3.2
    assert robot.last.state in (MissionState.FOUND, MissionState.EXHAUSTED)
    if robot.last.state is MissionState.FOUND:
        assert robot.last.find.out_of_reach_m is not None


@pytest.mark.slow
def test_a_way_that_closes_in_a_passage_is_backed_out_of(searcher, room):
    home = parted(room, 0.75, thick_m=0.8, at_x=4.2, length_m=8.6)
    robot = searcher(home, 1.5, 3.0, 1.0, robot=LONG)
    robot.ask("toilet")
    robot.search(60.0, lambda _: robot.at[0] > 3.7)
    assert 3.7 < robot.at[0] < 4.0, "it is in the passage"
    robot.rebuild([*home, ("box", "box", (4.65, 1.5, 0.0), (4.85, 2.5, 1.5))])
    results = robot.search(90.0)
    assert robot.at[0] < 3.5, "out again"
    assert min(r.command.linear_m_s for r in results) < -0.2
    assert robot.world.collisions == 0


@pytest.mark.slow
def test_a_way_that_closes_on_a_gangway_is_backed_off_without_a_turn(searcher, room):
    home = [
        ("floor", "floor", (-0.1, -0.1, -0.1), (3.2, 4.1, 0.0)),
        ("floor", "floor", (3.2, 1.55, -0.1), (5.4, 2.45, 0.0)),
        ("floor", "floor", (5.4, -0.1, -0.1), (8.7, 4.1, 0.0)),
        ("floor", "floor", (-0.1, -0.1, -1.1), (8.7, 4.1, -1.0)),
        *room(8.6, 4.0)[1:],
        toilet(7.9, 0.3),
    ]
    robot = searcher(home, 1.5, 2.0, 0.0, robot=LONG)
    robot.ask("toilet")
    robot.search(60.0, lambda _: robot.at[0] > 4.3)
    assert 4.3 < robot.at[0] < 4.6, "it is on the gangway"
    robot.rebuild([*home, ("box", "box", (5.25, 1.2, 0.0), (5.4, 2.8, 1.5))])
    headings = []
    robot.search(90.0, lambda _: robot.at[0] < 3.4 or headings.append(robot.world.base.yaw_rad))
    assert robot.at[0] < 3.4, "off it again"
    assert max(map(abs, headings)) < 0.5
    assert robot.world.collisions == 0


@pytest.mark.slow
def test_a_round_robot_takes_the_same_way_as_ever(searcher, room):
    robot = searcher(parted(room, 0.75), 1.5, 3.0, 1.0, robot=ZED)
    robot.ask("toilet")
    robot.search(90.0)
    assert robot.last.state is MissionState.FOUND
    assert robot.world.collisions == 0
