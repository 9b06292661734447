"""How close a body may come to things, and how fast it drives beside them."""

import dataclasses
import math

import numpy as np
import pytest

from ippon.planning.terrain.body_limits import (
    BodyLimits,
    body_limits_of,
    inscribed_radius,
    inscribed_unseen_radius,
    speed_at,
)
from ippon.robot import ZED, CollisionSphere, RobotProfile
from tests.ippon.planning.terrain.test_clearance import LIMITS
from tests.long_robot import LONG


def limits(robot: RobotProfile, overlap_m: float = 0.15) -> BodyLimits:
    return body_limits_of(
        robot, unseen_overlap_m=overlap_m, slow_clearance_m=0.25, slow_fraction=0.4
    )


def test_a_round_body_is_one_circle():
    found = limits(ZED)
    assert len(found.discs) == 0
    assert found.radius == inscribed_radius(found) == ZED.radius_m
    assert found.unseen_radius == inscribed_unseen_radius(found) == pytest.approx(0.1 * 1.25)
    assert limits(ZED, 0.05).unseen_radius == pytest.approx(ZED.radius_m - 0.05)
    assert found.speed == ZED.max_linear_m_s


def test_a_long_body_passes_with_its_width_and_turns_with_its_length():
    found = limits(LONG)
    assert found.radius == pytest.approx(0.47)
    assert inscribed_radius(found) == pytest.approx(0.27)
    assert found.unseen_radius == pytest.approx(0.32)
    assert inscribed_unseen_radius(found) == pytest.approx(0.135), "at least half of it"
    np.testing.assert_allclose(
        found.discs, [(x, 0.0, 0.27, 0.135) for x in (-0.2, 0.0, 0.2)], atol=1e-12
    )


def test_a_body_that_is_longer_ahead_is_as_long_behind():
    """An edge of the roadmap is for both directions, and is driven nose first either way."""
    nose = CollisionSphere(x_m=0.6, y_m=0.1, z_m=0.4, radius_m=0.1)
    found = limits(dataclasses.replace(LONG, spheres=(*LONG.spheres, nose)))
    assert found.radius == pytest.approx(math.hypot(0.6, 0.1) + 0.1)
    discs = {tuple(disc) for disc in np.round(found.discs[:, :3], 9).tolist()}
    assert {(0.6, 0.1, 0.1), (-0.6, -0.1, 0.1)} < discs
    assert discs == {(-x, -y, r) for x, y, r in discs}


def test_speed_falls_with_the_room_beside_the_body():
    speeds = [speed_at(LIMITS, room) for room in (-0.1, 0.0, 0.1, 0.25, 1.0)]
    assert speeds == sorted(speeds)
    assert speeds[0] == pytest.approx(0.4 * 0.8)
    assert speeds[-1] == speeds[-2] == pytest.approx(0.8)
