"""Commands that a body can follow."""

import pytest

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
