"""What the body has shown of the floor: driven, swept over, run into."""

import math

import numpy as np
import pytest

from ippon.command import Command
from ippon.geometry import base_pose
from ippon.mapping.arrays import OCCUPIED, UNKNOWN
from ippon.planning.terrain.floor_grid import OBSTACLE, OPEN, UNSEEN
from ippon.planning.terrain.motion_check import can_stand
from ippon.planning.terrain.traversability import Traversability, TraversabilityConfig
from ippon.planning.terrain.traversal_record import (
    CONTACT,
    DRIVEN,
    REOPENED,
    SWEPT,
    TraversalRecord,
)
from ippon.robot import ZED
from tests.ippon.planning.terrain.test_clearance import make_grid
from tests.ippon.planning.terrain.test_traversability import POSE, kind_at, open_floor
from tests.long_robot import LONG


def marks_of(robot=ZED) -> TraversalRecord:
    """Marks over open floor of 6 by 6 m, the robot's pose in its middle not noted yet."""
    marks = TraversalRecord(
        robot, start_margin_m=0.0, contact_length_m=0.25, contact_half_angle_rad=0.45
    )
    marks.resize((60, 60), np.zeros(2, dtype=np.int64))
    return marks


def after_contact(volume, robot, pose=POSE, motion=None) -> Traversability:
    """The floor of a robot that touched something where it stands."""
    floor = Traversability(TraversabilityConfig(), robot)
    floor.update(volume.arrays(), pose)
    floor.mark_contact(pose, motion)
    floor.update(volume.arrays(), pose)
    return floor


def open_grid():
    return make_grid(np.full((60, 60), OPEN))


def test_the_floor_under_the_body_is_driven_and_its_middle_swept():
    marks, grid = marks_of(), open_grid()
    marks.record_pose(grid, POSE)
    marks.record_pose(grid, base_pose(4.0, 2.8, 0.0, 0.0))
    i, j = np.indices((60, 60))
    away = np.hypot(0.1 * i + 0.05 - 4.0, 0.1 * j + 0.05 - 2.8)
    np.testing.assert_array_equal((marks.cells & DRIVEN > 0)[34:], (away <= ZED.radius_m)[34:])
    swept = away <= ZED.radius_m - 0.075
    np.testing.assert_array_equal((marks.cells & SWEPT > 0)[34:], swept[34:])


def test_marks_move_with_the_grid():
    marks = marks_of()
    marks.record_pose(open_grid(), POSE)
    before = marks.cells
    marks.resize((70, 62), np.array([8, 0]))
    np.testing.assert_array_equal(marks.cells[8:68, :60], before)
    assert marks.cells.sum() == before.sum()
    marks.resize((50, 60), np.array([-18, 0]))
    np.testing.assert_array_equal(marks.cells, before[10:])


def test_contacts_are_reopened_and_closed_again_and_no_other_mark_changes():
    marks, grid = marks_of(), open_grid()
    marks.record_pose(grid, POSE)
    before = marks.cells.copy()
    assert not marks.reopen_contacts()
    marks.mark_contact(grid, POSE)
    assert (marks.cells & CONTACT > 0).any()
    touched = marks.cells.copy()
    assert marks.reopen_contacts()
    assert not (marks.cells & CONTACT).any()
    np.testing.assert_array_equal(marks.cells & (255 - REOPENED), before)
    assert marks.close_reopened()
    np.testing.assert_array_equal(marks.cells, touched)
    assert not marks.close_reopened()


def test_a_reopened_contact_that_the_body_drives_over_stays_open():
    marks, grid = marks_of(), open_grid()
    marks.record_pose(grid, POSE)
    marks.mark_contact(grid, POSE)
    marks.reopen_contacts()
    marks.record_pose(grid, base_pose(3.2, 2.8, 0.0, 0.0))
    assert not marks.close_reopened()


def test_a_contact_that_was_reopened_is_closed_on_a_floor_that_the_robot_has_left():
    marks, grid = marks_of(), open_grid()
    marks.stand_on(0.0)
    marks.record_pose(grid, POSE)
    marks.mark_contact(grid, POSE)
    touched = marks.cells.copy()
    marks.reopen_contacts()
    marks.stand_on(3.0)
    assert marks.close_reopened()
    marks.stand_on(0.0)
    np.testing.assert_array_equal(marks.cells, touched)


def test_what_the_body_sweeps_over_was_no_contact():
    marks, grid = marks_of(), open_grid()
    marks.mark_contact(grid, POSE)
    closed = np.argwhere(marks.cells & CONTACT)[0]
    marks.record_pose(grid, base_pose(*(0.1 * closed + 0.05), 0.0, 0.0))
    assert marks.cells[tuple(closed)] == DRIVEN | SWEPT


def test_a_contact_at_the_edge_of_the_grid_closes_what_there_is():
    marks, grid = marks_of(), open_grid()
    marks.mark_contact(grid, base_pose(-3.0, -3.0, 0.0, 0.0))
    assert not marks.cells.any(), "all of it lies outside"
    marks.mark_contact(grid, base_pose(5.6, 2.8, 0.0, 0.0))
    assert (marks.cells[59] & CONTACT > 0).any()


def test_a_contact_in_the_open_closes_the_triangle_ahead(dense_map):
    volume = open_floor(dense_map)
    floor = after_contact(volume, ZED)
    assert kind_at(floor, 3.15, 2.85) == OBSTACLE
    assert kind_at(floor, 3.25, 2.65) == OBSTACLE, "wider farther ahead"
    assert kind_at(floor, 2.45, 2.85) == OPEN, "not behind"
    assert kind_at(floor, 2.85, 2.85) == OPEN, "not under the robot"
    assert kind_at(floor, 2.85, 3.15) == OPEN, "not beside it"


def test_brushing_a_mapped_door_frame_leaves_the_door_open(dense_map, two_rooms):
    volume = two_rooms(0.9)
    # The robot touches the lower post (its voxel at y = 2.25) with its side.
    pose = base_pose(3.85, 2.53, 0.0, 0.0)
    floor = after_contact(volume, ZED, pose)
    assert kind_at(floor, 4.15, 2.65) == OPEN, "no triangle ahead"
    assert can_stand(floor.grid, floor.limits, np.array([3.85, 2.75]), 0.0)


def test_where_the_body_has_been_nothing_is_closed(dense_map):
    volume = open_floor(dense_map)
    floor = Traversability(TraversabilityConfig(), ZED)
    for x in np.arange(2.8, 3.6, 0.05):
        floor.update(volume.arrays(), base_pose(x, 2.8, 0.0, 0.0))
    floor.mark_contact(base_pose(3.0, 2.8, 0.0, 0.0))
    floor.update(volume.arrays(), base_pose(3.0, 2.8, 0.0, 0.0))
    assert kind_at(floor, 3.35, 2.85) == OPEN


def test_a_second_contact_where_the_body_has_been_closes_what_it_does_not_stand_on(dense_map):
    volume = open_floor(dense_map)
    floor = Traversability(TraversabilityConfig(), ZED)
    for x in np.arange(2.8, 3.6, 0.05):
        floor.update(volume.arrays(), base_pose(x, 2.8, 0.0, 0.0))
    for x in (3.0, 3.02):
        pose = base_pose(x, 2.8, 0.0, 0.0)
        floor.mark_contact(pose)
        floor.update(volume.arrays(), pose)
    assert kind_at(floor, 3.35, 2.85) == OBSTACLE
    assert kind_at(floor, 3.05, 2.85) == OPEN, "under the robot"
    assert kind_at(floor, 2.75, 2.85) == OPEN, "behind it"


def test_a_long_body_marks_what_it_stands_on_and_no_more(dense_map):
    volume = dense_map()
    volume.room((0.8, 0.8), (5.6, 5.6)).fill((0.8, 0.8, -0.1), (5.6, 5.6, 2.0), UNKNOWN)
    floor = Traversability(TraversabilityConfig(start_margin_m=0.0), LONG)
    floor.update(volume.arrays(), POSE)
    floor.update(volume.arrays(), base_pose(4.0, 2.8, 0.0, math.pi / 2))
    assert kind_at(floor, 4.0, 3.15) == OPEN, "its nose"
    assert kind_at(floor, 4.35, 2.8) == UNSEEN, "beside its flank"


def test_a_long_body_that_touched_something_closes_what_lies_before_its_nose(dense_map):
    volume = open_floor(dense_map)
    floor = after_contact(volume, LONG)
    assert kind_at(floor, 3.35, 2.85) == OBSTACLE
    assert kind_at(floor, 3.15, 2.85) == OPEN, "not under its nose"
    assert kind_at(floor, 2.85, 3.25) == OPEN, "not beside it"


TURNS_LEFT = Command(yaw_rate_rad_s=0.5)


def test_a_long_body_that_touched_something_as_it_turned_does_not_turn_on(dense_map):
    volume = open_floor(dense_map)
    floor = Traversability(TraversabilityConfig(), LONG)
    floor.update(volume.arrays(), POSE)
    here = POSE[:2, 3]
    assert floor.can_turn(here, 0.0, 1.5, 0.0, floor.clearance_at_pose(*here, 0.0))
    floor.mark_contact(POSE, TURNS_LEFT)
    floor.update(volume.arrays(), POSE)
    assert kind_at(floor, 3.05, 3.15) == OBSTACLE, "left of its nose"
    assert kind_at(floor, 2.55, 2.45) == OBSTACLE, "right of its tail"
    assert kind_at(floor, 3.05, 2.45) == kind_at(floor, 2.55, 3.15) == OPEN
    assert kind_at(floor, 3.35, 2.85) == OPEN, "not ahead"
    leave = floor.clearance_at_pose(*here, 0.0)
    assert not floor.can_turn(here, 0.0, 1.5, 0.0, leave)
    assert floor.can_turn(here, 0.0, -0.5, 0.0, leave), "it may turn back"


def test_a_mapped_obstacle_beside_the_tail_explains_a_contact_as_it_turns(dense_map):
    volume = open_floor(dense_map).fill((2.4, 2.4, 0.0), (2.6, 2.6, 0.8), OCCUPIED)
    floor = after_contact(volume, LONG, motion=TURNS_LEFT)
    assert kind_at(floor, 3.05, 3.15) == OPEN, "its nose touched nothing"
    assert kind_at(floor, 2.65, 2.55) == OBSTACLE, "the rim beside the box"


@pytest.mark.parametrize("robot", [ZED, LONG])
def test_a_contact_on_the_way_back_closes_what_is_behind(dense_map, robot):
    volume = open_floor(dense_map)
    floor = after_contact(volume, robot, motion=Command(linear_m_s=-0.2))
    beyond = robot.radius_m + 0.1
    assert kind_at(floor, 2.8 - beyond, 2.85) == OBSTACLE
    assert kind_at(floor, 2.8 + beyond, 2.85) == OPEN


def test_a_round_body_that_turns_touched_what_is_ahead(dense_map):
    volume = open_floor(dense_map)
    floors = [Traversability(TraversabilityConfig(), ZED) for _ in range(2)]
    for floor, motion in zip(floors, (None, TURNS_LEFT), strict=True):
        floor.update(volume.arrays(), POSE)
        floor.mark_contact(POSE, motion)
        floor.update(volume.arrays(), POSE)
    np.testing.assert_array_equal(floors[0].grid.kind, floors[1].grid.kind)


def test_each_floor_has_its_own_marks():
    marks, grid = marks_of(), open_grid()
    marks.stand_on(0.0)
    marks.record_pose(grid, POSE)
    marks.mark_contact(grid, POSE)
    below = marks.cells.copy()
    for step in range(1, 31):
        marks.stand_on(0.1 * step)
    assert not marks.cells.any()
    marks.record_pose(grid, base_pose(4.0, 4.0, 3.0, 0.0))
    above = marks.cells.copy()
    marks.stand_on(0.1)
    np.testing.assert_array_equal(marks.cells, below)
    marks.resize((70, 60), np.array([10, 0]))
    marks.stand_on(2.9)
    np.testing.assert_array_equal(marks.cells[10:], above)


@pytest.mark.parametrize(
    ("heights", "margin"), [((3.0,), True), (np.linspace(0.0, 3.0, 40), False)]
)
def test_a_floor_that_the_robot_was_taken_to_begins_as_the_first_did(heights, margin):
    """As by a lift: the camera does not see the floor beside the body there either.

    On stairs that it climbs, what it does not see may be the way down.
    """
    marks, grid = marks_of(), open_grid()
    marks._start_margin_m = 0.5
    marks.stand_on(0.0)
    marks.record_pose(grid, POSE)
    for z in heights:
        marks.stand_on(float(z))
        marks.record_pose(grid, base_pose(4.0, 2.8, float(z), 0.0))
    beside = marks.cells[40, 28 + 6]
    assert bool(beside & DRIVEN) is margin
    marks.stand_on(0.0)
    marks.record_pose(grid, base_pose(1.5, 2.8, 0.0, 0.0))
    assert not marks.cells[15, 28 + 6] & DRIVEN, "it knows this floor"


@pytest.mark.parametrize(
    ("noted", "margin"),
    [
        (np.linspace(0.0, 3.0, 40), False),
        ((0.0, 3.0, 3.02), True),
        ((0.0, 3.0, *np.linspace(3.0, 0.0, 40), *np.linspace(0.0, 3.0, 40)), False),
    ],
)
def test_how_a_floor_was_reached_is_known_though_nothing_was_planned_on_the_way(noted, margin):
    marks, grid = marks_of(), open_grid()
    marks._start_margin_m = 0.5
    marks.stand_on(0.0)
    marks.record_pose(grid, POSE)
    for z in noted:
        marks.note_height(float(z))
    marks.stand_on(float(noted[-1]))
    marks.record_pose(grid, base_pose(4.0, 2.8, float(noted[-1]), 0.0))
    assert bool(marks.cells[40, 28 + 6] & DRIVEN) is margin


def test_a_ramp_and_a_pose_that_drifts_keep_the_marks():
    marks, grid = marks_of(), open_grid()
    for z in (0.0, 0.6, 0.2, 0.9):
        marks.stand_on(z)
        marks.record_pose(grid, POSE)
        assert (marks.cells & DRIVEN > 0).any()
    before = marks.cells.copy()
    marks.stand_on(0.0)
    np.testing.assert_array_equal(marks.cells, before)
