import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ippon.geometry import (
    base_pose,
    invert_transform,
    is_rigid,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_y,
    rotation_z,
    transform_points,
    views_differ,
    wrap_angle,
    yaw_of,
)

angles = st.floats(-20.0, 20.0)
unit = st.floats(-1.0, 1.0)


@given(angles)
def test_wrapped_angle_is_the_same_direction(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi <= wrapped < math.pi
    assert math.isclose(math.cos(wrapped), math.cos(angle), abs_tol=1e-9)
    assert math.isclose(math.sin(wrapped), math.sin(angle), abs_tol=1e-9)


@given(unit, unit, unit, unit)
def test_quaternion_round_trip(w: float, x: float, y: float, z: float) -> None:
    q = np.array([w, x, y, z])
    if np.linalg.norm(q) < 1e-3:
        return
    rotation = rotation_from_quaternion(q)
    again = rotation_from_quaternion(quaternion_from_rotation(rotation))
    assert np.allclose(rotation, again, atol=1e-9)


@given(angles, angles)
def test_inverse_cancels(yaw: float, tilt: float) -> None:
    T = base_pose(1.0, -2.0, 0.5, yaw)
    T[:3, :3] = T[:3, :3] @ rotation_y(tilt)
    assert is_rigid(T)
    assert np.allclose(T @ invert_transform(T), np.eye(4), atol=1e-12)


@given(angles)
def test_yaw_of_pose(yaw: float) -> None:
    assert math.isclose(wrap_angle(yaw_of(base_pose(0, 0, 0, yaw)) - yaw), 0.0, abs_tol=1e-9)


def test_views_differ_by_where_the_cameras_stand_or_look() -> None:
    here = base_pose(1.0, 2.0, 0.0, 0.3)
    turned, rolled = here.copy(), here.copy()
    turned[:3, :3] = here[:3, :3] @ rotation_y(0.2)[:3, :3]
    rolled[:3, :3] = here[:3, :3] @ rotation_z(2.0)[:3, :3]
    assert views_differ(here, base_pose(1.5, 2.0, 0.0, 0.3), 0.4, 0.1)
    assert not views_differ(here, base_pose(1.3, 2.0, 0.0, 0.3), 0.4, 0.1)
    assert views_differ(here, turned, 0.4, 0.19)
    assert not views_differ(here, turned, 0.4, 0.21)
    assert not views_differ(here, rolled, 0.4, 0.1), "about the axis in which it looks"


def test_points_turn_counter_clockwise() -> None:
    T = base_pose(1.0, 0.0, 0.0, math.pi / 2)
    assert np.allclose(transform_points(T, np.array([[1.0, 0.0, 0.0]])), [[1.0, 1.0, 0.0]])


@pytest.mark.parametrize(
    "bad", [np.eye(3), np.full((4, 4), np.nan), np.diag([1.0, 1.0, -1.0, 1.0])]
)
def test_transforms_that_are_not_rigid(bad: np.ndarray) -> None:
    assert not is_rigid(bad)


def test_scaled_rotation_is_not_rigid() -> None:
    T = np.eye(4)
    T[:3, :3] = 2.0 * rotation_z(0.3)
    assert not is_rigid(T)


@pytest.mark.parametrize("bad", [[0, 0, 0, 0], [1, np.nan, 0, 0], [1, 0, 0]])
def test_an_invalid_quaternion_is_rejected(bad: list[float]) -> None:
    with pytest.raises(ValueError, match="four finite numbers"):
        rotation_from_quaternion(bad)
