import dataclasses
import math

import numpy as np
import pytest

from ippon.robot import HABITAT, ZED, CollisionSphere, RobotProfile, upright_body
from tests.long_robot import LONG


@pytest.mark.parametrize("robot", [ZED, HABITAT])
def test_body_lies_between_clearance_and_height(robot: RobotProfile) -> None:
    low = min(s.z_m - s.radius_m for s in robot.spheres)
    high = max(s.z_m + s.radius_m for s in robot.spheres)
    assert 0.0 < low <= 0.11
    assert high == pytest.approx(1.2 if robot is ZED else 1.41)


def test_spheres_overlap_without_gaps() -> None:
    spheres = upright_body(0.2, 1.5, 0.05)
    gaps = np.diff([s.z_m for s in spheres])
    assert (gaps <= 0.2 + 1e-9).all()


def test_habitat_challenge_camera() -> None:
    assert math.degrees(HABITAT.vertical_fov_rad) == pytest.approx(54.2, abs=0.1)


def test_level_camera_looks_forward() -> None:
    T = ZED.T_base_camera(0.0)
    assert np.allclose(T[:3, :3] @ [0, 0, 1], [1, 0, 0])
    assert np.allclose(T[:3, :3] @ [0, 1, 0], [0, 0, -1])


def test_positive_tilt_looks_up() -> None:
    forward = ZED.T_base_camera(0.4)[:3, :3] @ [0, 0, 1]
    assert forward[2] == pytest.approx(math.sin(0.4))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"spheres": ()}, "collision sphere"),
        ({"spheres": (CollisionSphere(x_m=0, y_m=0, z_m=0.3, radius_m=0.0),)}, "collision sphere"),
        ({"spheres": upright_body(0.001, 1.0, 0.05)}, "at most 500 spheres"),
        ({"spheres": upright_body(3.0, 0.02, 0.01)}, "at most 500 spheres"),
        ({"max_linear_m_s": 0.0}, "max_linear_m_s"),
        ({"min_tilt_rad": 1.0}, "min_tilt_rad"),
        ({"max_tilt_rad": 2.0}, "from -90 to 90 degrees"),
        ({"camera_height_m": math.nan}, "finite"),
        ({"horizontal_fov_rad": 3.2}, "0 and 180"),
        ({"min_depth_m": 6.0}, "max_depth_m"),
        ({"max_step_m": 0.0}, "max_step_m lies in 0.01"),
        ({"max_yaw_acceleration_rad_s2": 0.0}, "max_yaw_acceleration_rad_s2"),
    ],
)
def test_nonsense_profiles_are_refused(change: dict[str, object], message: str) -> None:
    good = {
        "name": "x",
        "spheres": upright_body(0.2, 1.0, 0.05),
        "max_linear_m_s": 0.5,
        "max_yaw_rate_rad_s": 1.0,
        "max_tilt_rate_rad_s": 1.0,
    }
    with pytest.raises(ValueError, match=message):
        RobotProfile(**{**good, **change})  # type: ignore[arg-type]


def test_where_the_floor_comes_into_view() -> None:
    assert ZED.floor_in_view_m == 0.0
    fixed = dataclasses.replace(
        ZED, min_tilt_rad=0.0, max_tilt_rad=0.0, camera_forward_m=0.2, image_aspect=1.0
    )
    assert not fixed.can_tilt
    assert fixed.floor_in_view_m == pytest.approx(0.2 + 1.2 / math.tan(math.radians(37.0)))
    up = dataclasses.replace(fixed, min_tilt_rad=0.7, max_tilt_rad=0.7)
    assert up.floor_in_view_m == math.inf
    blind = dataclasses.replace(fixed, min_depth_m=2.0)
    assert blind.floor_in_view_m == pytest.approx(0.2 + 2.0), "depth begins at 2 m"
    short = dataclasses.replace(fixed, max_depth_m=1.5)
    assert short.floor_in_view_m == math.inf, "the floor is 2 m away along the lowest ray"


def test_a_round_body_is_one_circle_from_above() -> None:
    for robot in (ZED, HABITAT):
        assert robot.outline == ((0.0, 0.0, robot.radius_m),)
        assert robot.inscribed_radius_m == robot.radius_m
    flat = dataclasses.replace(ZED, spheres=upright_body(0.4, 0.3, 0.05))
    assert flat.is_round
    assert flat.outline == ((0.0, 0.0, flat.radius_m),)


def test_a_long_body_is_the_discs_that_no_other_holds() -> None:
    assert not LONG.is_round
    assert LONG.outline == ((-0.2, 0.0, 0.27), (0.0, 0.0, 0.27), (0.2, 0.0, 0.27))
    assert LONG.radius_m == pytest.approx(0.47)
    assert LONG.half_width_m == LONG.inscribed_radius_m == pytest.approx(0.27)
