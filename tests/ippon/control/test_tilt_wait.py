"""A tilt is awaited for longer than it ever takes, and not without end."""

import pytest

from ippon.control.tilt_wait import TiltWait
from ippon.robot import HABITAT, ZED


@pytest.mark.parametrize("robot", [ZED, HABITAT])
def test_a_tilt_that_does_not_come_ends_the_wait_after_twice_its_time(robot):
    wait = TiltWait(robot)
    steps = 1
    while not wait.is_over(0.5, 0.1, 0.2):
        assert not wait.given_up
        steps += 1
    whole_range_s = (robot.max_tilt_rad - robot.min_tilt_rad) / robot.max_tilt_rate_rad_s
    assert 0.2 * steps == pytest.approx(3.0 + 2.0 * whole_range_s, abs=0.3)
    assert wait.given_up
    assert wait.is_over(-0.5, 0.1, 0.2), "nor is it awaited again"
    assert wait.is_over(0.05, 0.1, 0.2)
    assert not wait.given_up
    assert not wait.is_over(0.5, 0.1, 0.2), "it moves again"


def test_a_break_in_the_frames_is_no_time_without_a_tilt():
    wait = TiltWait(ZED)
    assert not any(wait.is_over(0.5, 0.1, 60.0) for _ in range(5))
    wait.restart()
    assert not any(wait.is_over(0.5, 0.1, 60.0) for _ in range(5))
