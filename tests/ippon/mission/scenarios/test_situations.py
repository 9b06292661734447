"""What a search comes to where a home or its robot is awkward: every such outcome is defined."""

import dataclasses
import math

import numpy as np
import pytest

from ippon.command import Command
from ippon.control.obstacles import hazards_around
from ippon.control.safety_filter import filter_among_hazards
from ippon.mission.behaviors.config import TravelPitchConfig
from ippon.mission.config import MissionConfig
from ippon.mission.snapshot import MissionState
from ippon.robot import ZED, RobotProfile, upright_body

pytestmark = pytest.mark.slow


def toilet(x, y, z=0.0):
    return ("toilet", "toilet", (x, y, z), (x + 0.5, y + 0.5, z + 0.8))


def sofa(x, y):
    return ("sofa", "sofa", (x, y, 0.0), (x + 1.6, y + 0.8, 0.8))


def events(results, kind):
    return [e for r in results for e in r.snapshot.events if e.kind == kind]


def test_an_object_in_view_is_driven_to_straight_and_rejected_it_is_not_found_again(searcher, room):
    robot = searcher([*room(), toilet(5.4, 1.8)], 1.0, 2.0)
    robot.ask("toilet")
    robot.search(30.0)
    assert robot.last.state is MissionState.FOUND
    assert robot.world.path_length_m() < 4.2, "it stands 4.4 m away and is seen from a metre"
    assert robot.mission.goals.reject_find()
    again = robot.search(90.0)
    assert MissionState.FOUND not in [r.snapshot.state for r in again]
    assert robot.last.state is MissionState.EXHAUSTED
    assert robot.last.candidates == (), "what was rejected is no candidate either"


def test_an_object_beside_the_robot_needs_hardly_a_move(searcher, room):
    robot = searcher([*room(), toilet(1.9, 1.8)], 1.0, 2.0)
    robot.ask("toilet")
    robot.search(20.0)
    assert robot.last.state is MissionState.FOUND
    assert robot.world.path_length_m() < 0.8


def test_without_the_object_everything_reachable_is_seen_and_the_robot_stands(searcher, room):
    robot = searcher([*room(), sofa(4.0, 3.1)], 1.0, 2.0)
    robot.ask("toilet")
    results = robot.search(90.0)
    assert robot.last.state is MissionState.EXHAUSTED
    assert robot.last.why == "toilet not found: everything reachable was seen"
    assert robot.last.candidates == ()
    assert [e.text for e in events(results, "exhausted")] == [robot.last.why]
    assert results[-1].command.linear_m_s == results[-1].command.yaw_rate_rad_s == 0.0
    # What the planner does not want of a hand's command stops at once.
    backwards = Command(linear_m_s=-0.5, yaw_rate_rad_s=1.0)
    for by_hand in (False, True):
        if by_hand:
            robot.mission.motion.resume_from(backwards, manual=True)
        command = robot.mission.step(robot.world.observe()).command
        assert (command.linear_m_s, command.yaw_rate_rad_s) == (0.0, 0.0)
        robot.world.step(command, 0.2)


@pytest.mark.parametrize("gap", [0.01, -0.02], ids=["all but touching", "in contact"])
def test_a_robot_in_an_obstacles_margin_gets_out_and_searches(searcher, room, gap):
    robot = searcher([*room(), toilet(5.4, 1.8)], ZED.radius_m + gap, 2.0, math.pi)
    robot.ask("toilet")
    robot.search(60.0)
    assert robot.last.state is MissionState.FOUND
    assert robot.world.collisions == 0


def test_an_obstacle_that_moves_onto_the_path_is_driven_round(searcher, room):
    home = [*room(8.0, 4.0), toilet(7.4, 1.8)]
    robot = searcher(home, 1.0, 2.0)
    robot.ask("toilet")
    base = robot.world.base
    robot.search(40.0, lambda r: base.linear_m_s > 0.3 and leads_on(r, robot.at, 1.8))
    assert base.linear_m_s > 0.2, "it is under way"
    x, y = on_path(robot.last.plan.path_world, 1.6)
    box = ("box", "box", (x - 0.1, y - 0.3, 0.0), (x + 0.1, y + 0.3, 1.2))
    before = robot.last.plan
    robot.rebuild([*home, box])
    robot.search(60.0)
    assert robot.last.state is MissionState.FOUND
    assert robot.world.collisions == 0
    assert passes(before.path_world, box), "the old path led through it"


def test_what_appears_in_front_of_a_moving_robot_stops_it_before_the_map_knows(searcher, room):
    home = [*room(8.0, 4.0), toilet(7.4, 1.8)]
    robot = searcher(home, 1.0, 2.0)
    robot.ask("toilet")
    robot.search(40.0, lambda r: r.command.linear_m_s > 0.65 and robot.at[0] > 2.0)
    yaw = robot.world.base.yaw_rad
    assert robot.world.base.linear_m_s > 0.55, "it is under way"
    x, y = robot.at + 1.1 * np.array([math.cos(yaw), math.sin(yaw)])
    robot.rebuild([*home, ("box", "box", (x - 0.15, y - 0.15, 0.0), (x + 0.15, y + 0.15, 1.2))])
    robot.search(60.0)
    assert robot.world.collisions == 0
    assert robot.last.state is MissionState.FOUND


def on_path(path_world, metres):
    """Return the point of a path so far from its beginning."""
    steps = np.hypot(*np.diff(path_world[:, :2], axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    return (np.interp(metres, along, path_world[:, k]) for k in range(2))


def leads_on(result, at, metres):
    """Tell whether the path leads that far away from the robot."""
    path = result.snapshot.plan.path_world
    return len(path) and math.dist(path[-1][:2], at) > metres


def passes(path_world, box, radius=0.25):
    """Tell whether a path comes closer than the body's radius to a box."""
    (x0, y0, _), (x1, y1, _) = box[2:]
    knots = np.arange(len(path_world))
    dense = np.linspace(0.0, knots[-1], 400)
    x, y = (np.interp(dense, knots, path_world[:, k]) for k in range(2))
    apart = np.hypot(
        np.maximum(np.maximum(x0 - x, x - x1), 0.0), np.maximum(np.maximum(y0 - y, y - y1), 0.0)
    )
    return bool(apart.min() < radius)


def test_a_drop_is_never_driven_onto_even_with_the_object_below(searcher, room):
    ground = [
        ("floor", "floor", (-0.1, -0.1, -0.1), (3.0, 4.1, 0.0)),
        ("floor", "floor", (3.0, -0.1, -1.1), (6.1, 4.1, -1.0)),
        ("wall", "wall", (2.95, -0.1, -1.0), (3.0, 4.1, -0.1)),
    ]
    robot = searcher([*ground, *room()[1:], toilet(4.5, 1.8, -1.0)], 1.0, 2.0)
    robot.ask("toilet")
    robot.search(90.0)
    assert robot.last.outcome == "out_of_reach", "it was seen from above"
    assert robot.world.collisions == 0
    assert robot.world.trajectory[:, 0].max() < 3.0 - ZED.radius_m


@pytest.mark.parametrize("yaw", [0.0, 0.6, -0.9])
def test_a_drop_is_not_driven_onto_by_hand(searcher, room, yaw):
    stairs = [
        ("stairs", "stairs", (3.0 + 0.3 * k, -0.1, -2.0), (3.3 + 0.3 * k, 4.1, -0.17 * (k + 1)))
        for k in range(6)
    ]
    ground = ("floor", "floor", (-0.1, -0.1, -0.1), (3.0, 4.1, 0.0))
    robot = searcher([ground, *room(8.0, 4.0)[1:], *stairs], 1.0, 2.0)
    robot.ask("toilet")
    robot.search(20.0)
    arrays, base = robot.mission.voxel_map.arrays(), robot.world.base
    margin_m, reasons = 0.5 * arrays.voxel_size + 0.03, []
    base.yaw_rad = yaw
    for _ in range(400):
        wanted, here = Command(linear_m_s=0.4), base.T_world_base
        hazards = hazards_around(arrays, ZED, here, 2.5, hidden=True).by_hand
        safe, why = filter_among_hazards(wanted, here, ZED, hazards, 0.3, margin_m, 1e-6)
        reasons.append(why)
        robot.world.step(safe, 0.05)
    assert base.linear_m_s == 0.0
    assert reasons[-1].startswith("stopped: drop ")
    assert robot.world.collisions == 0, "its wheels never reached the edge"
    assert 2.2 < base.x_m < 3.0


@pytest.mark.parametrize("x", [1.6, 2.3])
def test_an_edge_that_was_hardly_seen_is_not_driven_over_by_hand(searcher, room, x):
    stairs = [
        ("stairs", "stairs", (3.0 + 0.3 * k, -0.1, -2.0), (3.3 + 0.3 * k, 8.1, -0.17 * (k + 1)))
        for k in range(6)
    ]
    ground = ("floor", "floor", (-0.1, -0.1, -0.1), (3.0, 8.1, 0.0))
    robot = searcher([ground, *room(8.0, 8.0)[1:], *stairs], x, 0.8)
    robot.world.base.yaw_rad = math.pi / 2
    robot.ask("toilet")
    robot.search(0.5)
    base = robot.world.base
    base.x_m, base.y_m, base.yaw_rad = x, 0.8, math.radians(50)
    base.linear_m_s = base.yaw_rate_rad_s = 0.0
    for n in range(200):
        arrays, here = robot.mission.voxel_map.arrays(), base.T_world_base
        hazards = hazards_around(arrays, ZED, here, 2.5, hidden=True).by_hand
        margin_m = 0.5 * arrays.voxel_size + 0.03
        wanted = Command(linear_m_s=0.4)
        safe, why = filter_among_hazards(wanted, here, ZED, hazards, 0.3, margin_m, 1e-6)
        robot.world.step(safe, 0.05)
        if n % 4 == 0:
            robot.mission.step(robot.world.observe())
    assert why.startswith("stopped: drop ")
    assert robot.world.collisions == 0, "its wheels never reached the edge"
    assert base.x_m < 2.85


def test_stairs_up_are_no_floor(searcher, room):
    stairs = [
        ("stairs", "stairs", (3.0 + 0.3 * k, -0.1, 0.0), (3.3 + 0.3 * k, 4.1, 0.17 * (k + 1)))
        for k in range(6)
    ]
    landing = ("floor", "floor", (4.8, -0.1, 0.0), (8.1, 4.1, 1.02))
    robot = searcher([*room(8.0, 4.0), *stairs, landing, toilet(7.0, 1.8, 1.02)], 1.0, 2.0)
    robot.ask("toilet")
    robot.search(90.0)
    assert robot.last.outcome == "out_of_reach"
    assert robot.world.collisions == 0
    assert robot.world.trajectory[:, 0].max() < 3.0 - ZED.radius_m


def test_stairs_down_are_no_floor(searcher, room):
    stairs = [
        ("stairs", "stairs", (3.0 + 0.3 * k, -0.1, -2.0), (3.3 + 0.3 * k, 4.1, -0.17 * (k + 1)))
        for k in range(6)
    ]
    ground = [
        ("floor", "floor", (-0.1, -0.1, -0.1), (3.0, 4.1, 0.0)),
        ("floor", "floor", (4.8, -0.1, -1.3), (8.1, 4.1, -1.02)),
    ]
    # Within the 4 m, from the uppermost step, in which images tell of it.
    robot = searcher([*ground, *room(8.0, 4.0)[1:], *stairs, toilet(6.6, 1.8, -1.02)], 1.0, 2.0)
    robot.ask("toilet")
    robot.search(90.0)
    assert robot.last.outcome == "out_of_reach"
    assert robot.world.trajectory[:, 0].max() < 3.0 - ZED.radius_m + 0.02, "as exactly as it stops"


def test_an_object_that_no_way_leads_to_is_found_out_of_reach(searcher, room):
    barrier = ("wall", "wall", (4.0, -0.1, 0.0), (4.1, 4.1, 0.9))
    robot = searcher([*room(), barrier, toilet(5.4, 1.8)], 1.0, 2.0)
    robot.ask("toilet")
    results = robot.search(150.0)
    assert robot.last.outcome == "out_of_reach"
    find = robot.last.find
    assert find.out_of_reach_m == pytest.approx(5.4 - robot.at[0], abs=0.2)
    assert robot.at[0] > 3.4, "as near as the barrier allows"
    assert find.box_px is not None, "it looks at it"
    text = f"found toilet, out of reach: {find.out_of_reach_m:.1f} m from the nearest place"
    assert robot.last.why.startswith(text)
    assert [e.text for e in events(results, "found")] == [robot.last.why]
    # The operator wants another one: there is none.
    assert robot.mission.goals.reject_find()
    robot.search(150.0)
    assert robot.last.outcome == "exhausted"


def test_a_detour_over_unseen_floor_is_tried_before_an_object_is_out_of_reach(searcher, room):
    barrier = ("wall", "wall", (4.0, -0.1, 0.0), (4.1, 3.0, 0.9))
    screen = ("wall", "wall", (2.4, 2.4, 0.0), (2.5, 4.1, 2.5))
    robot = searcher([*room(), barrier, screen, toilet(5.4, 0.2)], 1.0, 0.6)
    robot.ask("toilet")
    robot.search(150.0)
    assert robot.last.outcome == "found"
    assert robot.last.find.out_of_reach_m is None
    assert robot.at[0] > 4.1


def test_after_a_rejected_find_another_one_may_be_found(searcher, room):
    robot = searcher([*room(), toilet(5.4, 1.8), toilet(0.1, 0.1)], 1.0, 2.0)
    robot.ask("toilet")
    robot.search(30.0)
    first = robot.last.find
    assert robot.mission.goals.reject_find()
    robot.search(90.0)
    assert robot.last.state is MissionState.FOUND
    apart = np.subtract(robot.last.find.position_world, first.position_world)
    assert np.linalg.norm(apart) > 3.0


def test_a_second_object_that_the_map_shows_is_driven_to_at_once(searcher, room):
    robot = searcher([*room(8.0, 4.0), toilet(7.4, 1.8), sofa(3.0, 3.1)], 1.0, 2.0)
    robot.ask("toilet")
    nodes = len(robot.search(40.0)[-1].snapshot.plan.tree.parents)
    known, driven = robot.last.explored_m2, robot.world.path_length_m()
    robot.ask("sofa", goal_id=2)
    second = robot.search(40.0)
    first = second[0].snapshot
    assert first.explored_m2 >= known, "the map stays"
    assert len(first.plan.tree.parents) >= 0.9 * nodes, "the tree stays"
    assert first.state is MissionState.APPROACHING, "nothing is looked for first"
    assert robot.last.state is MissionState.FOUND
    assert robot.world.path_length_m() - driven < 5.0, "straight there"


@pytest.mark.parametrize("sweep", [True, False])
def test_the_camera_sweeps_while_the_robot_explores(searcher, room, sweep):
    config = MissionConfig(travel_pitch=TravelPitchConfig(sweep=sweep))
    wall = ("wall", "wall", (9.0, 0.0, 0.0), (9.1, 2.9, 2.5))
    robot = searcher([*room(12.0, 4.0), wall], 1.0, 2.0, config=config)
    robot.ask("toilet")
    results = robot.search(30.0)
    tilts = [
        r.command.tilt_rad
        for r in results
        if r.snapshot.state is MissionState.SEARCHING and r.command.linear_m_s > 0.4
    ]
    assert len(tilts) > 10, "two seconds"
    assert bool(np.ptp(tilts) > 0.15) is sweep


@pytest.mark.parametrize("held_still", [False, True])
def test_commands_stay_within_the_robots_limits(searcher, room, held_still):
    """Neither the look around, a pause, wheels that do not turn, nor the way back from there."""
    robot = searcher([*room(8.0, 4.0), toilet(7.4, 1.8)], 1.0, 2.0)
    robot.ask("toilet")
    robot.search(40.0, lambda r: r.command.linear_m_s > 0.5)
    if held_still:
        for _ in range(30):
            robot.results.append(robot.mission.step(robot.world.observe()))
            robot.world.step(None, 0.2)
        assert events(robot.results, "contact"), "it notices without a bumper"
    else:
        robot.mission.operator.pause()
        robot.results.append(robot.mission.step(robot.world.observe()))
        assert robot.results[-1].command.linear_m_s == 0.0, "at once"
        for _ in range(5):
            robot.world.step(robot.results[-1].command, 0.2)
            robot.results.append(robot.mission.step(robot.world.observe()))
        robot.mission.operator.resume()
        robot.world.step(robot.results[-1].command, 0.2)
    robot.search(60.0)
    assert robot.last.state is MissionState.FOUND
    speeds = np.array([r.command.linear_m_s for r in robot.results])
    rates = np.array([r.command.yaw_rate_rad_s for r in robot.results])
    for values, most in (
        (speeds, ZED.max_linear_acceleration_m_s2),
        (rates, ZED.max_yaw_acceleration_rad_s2),
    ):
        faster = np.maximum(np.abs(values[1:]) - np.abs(values[:-1]), 0.0)
        assert faster.max() > 0.0
        assert faster.max() <= 0.2 * most + 1e-9


def test_the_planner_goes_on_from_rest_or_from_what_the_hand_commanded(searcher, room):
    robot = searcher([*room(8.0, 4.0), toilet(7.4, 1.8)], 1.0, 2.0)
    robot.ask("toilet")
    robot.search(40.0, lambda r: r.command.linear_m_s > 0.5)
    before = robot.results[-1].command
    # Kept from driving, it starts from rest.
    robot.mission.motion.resume_from(Command())
    robot.world.step(None, 0.2)
    command = robot.mission.step(robot.world.observe()).command
    assert 0.0 < command.linear_m_s <= 0.2 * ZED.max_linear_acceleration_m_s2 + 1e-9
    robot.mission.motion.resume_from(Command())
    robot.mission.motion.resume_from(before, manual=True)
    robot.world.step(before, 0.2)
    command = robot.mission.step(robot.world.observe()).command
    assert command.linear_m_s == pytest.approx(before.linear_m_s, abs=0.2 * 0.8 + 1e-9)
    robot.mission.motion.resume_from(before, manual=True)
    robot.mission.operator.pause()
    assert robot.mission.step(robot.world.observe()).command.linear_m_s == 0.0


LOW = RobotProfile(
    name="low",
    spheres=upright_body(0.3, 0.7, 0.05),
    max_linear_m_s=0.5,
    max_yaw_rate_rad_s=1.0,
    max_tilt_rate_rad_s=1.0,
    min_tilt_rad=-0.2,
    max_tilt_rad=-0.2,
    camera_height_m=0.6,
    camera_forward_m=0.2,
    horizontal_fov_rad=math.radians(87.0),
    image_aspect=4.0 / 3.0,
    max_depth_m=4.0,
)
"""A low base whose camera is fixed, and sees no floor nearer than 0.75 m."""


def test_a_robot_with_a_fixed_camera_turns_once_and_finds(searcher, room):
    wall = ("wall", "wall", (3.0, 0.0, 0.0), (3.1, 2.6, 2.5))
    robot = searcher([*room(), wall, toilet(5.0, 0.5)], 1.0, 1.0, robot=LOW)
    robot.ask("toilet")
    results = robot.search(90.0)
    assert robot.last.state is MissionState.FOUND
    assert robot.world.collisions == 0
    turned = sum(r.snapshot.state is MissionState.LOOKING_AROUND for r in results) * 0.2
    assert turned < 1.3 * 2.0 * math.pi / LOW.max_yaw_rate_rad_s
    assert all(r.command.tilt_rad == pytest.approx(-0.2) for r in results)


def test_a_fixed_camera_may_be_mounted_a_little_off_its_profile(searcher, room):
    robot = searcher([*room(), toilet(5.0, 1.8)], 1.0, 2.0, robot=LOW)
    robot.world.base.robot = dataclasses.replace(LOW, min_tilt_rad=-0.3, max_tilt_rad=-0.3)
    robot.world.base.tilt_rad = -0.3
    robot.ask("toilet")
    robot.search(40.0)
    assert robot.last.state is MissionState.FOUND
