"""Paths that begin at the robot: what its body can drive, and shortcuts."""

import dataclasses
import math

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.planning.roadmap.robot_path import (
    AT_NODE_M,
    SHORTCUT_M,
    can_face,
    drive_time,
    shorten_path,
)
from ippon.planning.terrain.traversability import Traversability, TraversabilityConfig
from ippon.robot import ZED
from tests.ippon.planning.joined import Joined, late
from tests.long_robot import LONG

CORRIDOR = ((0.8, 1.2), (8.8, 2.0))
"""0.8 m wide: a body of 0.54 by 0.94 m fits along it, and cannot turn."""


def floor_of(volume, robot, at=(4.0, 1.6)) -> Traversability:
    floor = Traversability(TraversabilityConfig(), robot)
    floor.update(volume.arrays(), base_pose(*at, 0.0, 0.0))
    return floor


def test_a_path_takes_the_time_of_its_moves_and_of_its_turns(dense_map):
    floor = floor_of(dense_map().room((0.8, 0.8), (5.6, 5.6)), ZED)
    path = np.array([(2.0, 2.0), (4.0, 2.0), (4.0, 4.0)])
    assert drive_time(path, floor, ZED, 0.02, 1.0) == pytest.approx(
        4.0 / ZED.max_linear_m_s + 0.5 * math.pi / ZED.max_yaw_rate_rad_s
    )
    through_the_wall = path + np.array([2.0, 0.0])
    assert drive_time(through_the_wall, floor, ZED, 0.02, 1.0) is None


def test_a_long_body_that_cannot_turn_drives_ahead_or_back(dense_map):
    floor = floor_of(dense_map((9.6, 3.2, 2.4)).room(*CORRIDOR), LONG)
    ahead, back = np.array([(4.0, 1.6), (6.0, 1.6)]), np.array([(4.0, 1.6), (2.0, 1.6)])
    one_way = dataclasses.replace(LONG, can_reverse=False)
    assert drive_time(ahead, floor, LONG, 0.02, 0.0) == drive_time(back, floor, LONG, 0.02, 0.0)
    assert drive_time(ahead, floor, one_way, 0.02, 0.0) is not None
    assert drive_time(back, floor, one_way, 0.02, 0.0) is None, "it would have to turn round"
    there_and_back = np.vstack([ahead, (5.0, 1.6)])
    assert drive_time(there_and_back, floor, LONG, 0.02, 0.0) is None, "only to begin with"
    assert drive_time(back, floor_of(dense_map().room(*CORRIDOR), ZED), ZED, 0.02, 0.0) is not None


def test_a_target_within_15_cm_needs_no_turn(dense_map):
    floor = floor_of(dense_map((9.6, 3.2, 2.4)).room(*CORRIDOR), LONG)
    here, aside = np.array([4.0, 1.6]), np.array([0.0, 1.0])
    ahead = here + np.array([1.0, 0.05])
    assert can_face(floor, here, 0.0, here + (AT_NODE_M - 0.01) * aside, math.inf)
    assert not can_face(floor, here, 0.0, here + (AT_NODE_M + 0.01) * aside, math.inf)
    assert can_face(floor, here, 0.0, ahead, math.inf)
    assert not can_face(floor, here, 0.0, ahead, math.inf, 0.3), "with room to spare"


def test_no_corner_is_cut_where_a_long_body_would_have_to_turn(dense_map):
    volume = dense_map((9.6, 3.2, 2.4)).room(*CORRIDOR)
    ahead = np.array([(4.0, 1.6), (5.0, 1.63), (6.0, 1.6)])
    back = np.array([(4.0, 1.6), (3.0, 1.63), (2.0, 1.6)])
    for robot, way, corners in ((LONG, ahead, 2), (LONG, back, 3), (ZED, back, 2)):
        floor = floor_of(volume, robot)
        short = shorten_path(way, floor, 0.0)
        assert len(short) == corners
        assert drive_time(short, floor, robot, 0.02, 0.0) is not None


def test_shortening_keeps_ends_and_clearance_and_never_lengthens(corner):
    joined = Joined(corner)
    zigzag = np.array(
        [(1.3, 1.3), (1.6, 1.45), (2.2, 1.15), (3.0, 1.45), (4.65, 1.35), (4.75, 2.0), (4.7, 4.0)]
    )
    short = shorten_path(zigzag, joined.floor, 0.0)
    np.testing.assert_allclose(short[[0, -1]], zigzag[[0, -1]])
    assert len(short) < len(zigzag)

    def length(p):
        return np.linalg.norm(np.diff(p, axis=0), axis=1).sum()

    assert length(short) <= length(zigzag)
    assert drive_time(short, joined.floor, ZED, 0.02, 0.0) is not None


def test_a_way_that_there_is_no_time_to_shorten_stays_what_it_was(dense_map):
    joined = Joined(dense_map((28.0, 3.2, 2.4)).room((0.8, 0.8), (27.2, 2.4)))
    x = np.arange(1.5, 26.6, 0.5)
    way = np.column_stack([x, 1.6 + 0.1 * (np.arange(len(x)) % 2)])
    deadline = late()
    short = shorten_path(way, joined.floor, 0.0, deadline)
    assert deadline.cut_short
    assert 2 < len(short) < len(way), "its beginning is shortened: that is driven next"
    np.testing.assert_array_equal(short[0], way[0])
    np.testing.assert_array_equal(short[1:], way[-len(short) + 1 :])
    assert drive_time(short, joined.floor, ZED, 0.02, 0.0) is not None


def test_a_long_way_is_shortened_piece_by_piece(dense_map):
    joined = Joined(dense_map((28.0, 3.2, 2.4)).room((0.8, 0.8), (27.2, 2.4)))
    x = np.arange(1.5, 26.6, 0.5)
    way = np.column_stack([x, 1.6 + 0.1 * (np.arange(len(x)) % 2)])
    short = shorten_path(way, joined.floor, 0.0)
    pieces = np.linalg.norm(np.diff(short, axis=0), axis=1)
    assert pieces.max() <= SHORTCUT_M
    assert len(pieces) == 3
    assert pieces.sum() == pytest.approx(25.0, abs=0.05)
