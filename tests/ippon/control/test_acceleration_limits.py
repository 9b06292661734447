"""Commands that a body can follow."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ippon.command import Command
from ippon.control.acceleration_limits import limit_acceleration
from ippon.robot import ZED

UP = ZED.max_linear_acceleration_m_s2 * 0.1
TURN = ZED.max_yaw_acceleration_rad_s2 * 0.1


@pytest.mark.parametrize(
    ("wanted", "last", "at_once", "speed"),
    [
        (0.7, 0.0, False, UP),
        (0.7, 0.0, True, UP),
        (-0.7, 0.0, False, -UP),
        (0.0, 0.7, False, 0.7 - UP),
        (0.0, 0.7, True, 0.0),
        (0.3, 0.7, True, 0.3),
        (0.7, 0.3, True, 0.3 + UP),
        (-0.2, 0.7, False, 0.7 - UP),
        (-0.2, 0.7, True, -UP),
        (0.7, 0.699, False, 0.7),
    ],
)
def test_speeds_up_and_slows_down_within_limits(wanted, last, at_once, speed):
    command = limit_acceleration(
        Command(linear_m_s=wanted, yaw_rate_rad_s=9.0, tilt_rad=-0.3),
        Command(linear_m_s=last, tilt_rad=0.2),
        ZED,
        0.1,
        brakes_at_once=at_once,
    )
    assert command.linear_m_s == pytest.approx(speed)
    assert command.yaw_rate_rad_s == pytest.approx(TURN)
    assert command.tilt_rad == -0.3


def test_slowing_down_is_limited_unless_asked_otherwise():
    still, fast = Command(), Command(linear_m_s=0.7, yaw_rate_rad_s=1.0)
    command = limit_acceleration(still, fast, ZED, 0.1)
    assert command.linear_m_s == pytest.approx(0.7 - UP)
    assert command.yaw_rate_rad_s == pytest.approx(1.0 - TURN)


speeds = st.floats(-2.0, 2.0)


@settings(max_examples=30)
@given(wanted=speeds, last=speeds, dt_s=st.floats(0.05, 0.5), at_once=st.booleans())
def test_a_command_lies_between_the_last_and_the_wanted_one(wanted, last, dt_s, at_once):
    def limited(wanted, last):
        return limit_acceleration(
            Command(linear_m_s=wanted), Command(linear_m_s=last), ZED, dt_s, brakes_at_once=at_once
        ).linear_m_s

    speed = limited(wanted, last)
    assert min(wanted, last, 0.0) - 1e-12 <= speed <= max(wanted, last, 0.0) + 1e-12
    assert abs(speed) - abs(last) <= ZED.max_linear_acceleration_m_s2 * dt_s + 1e-12
    assert limited(-wanted, -last) == -speed
    assert limited(last, last) == last
    for _ in range(110):
        last = limited(wanted, last)
    assert last == pytest.approx(wanted), "and reaches the wanted one"
