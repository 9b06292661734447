import numpy as np
import pytest

from ippon.mission.behaviors.config import TravelPitchConfig
from ippon.mission.behaviors.travel_pitch import TravelPitch
from ippon.robot import HABITAT, ZED, RobotProfile


@pytest.mark.parametrize("robot", [ZED, HABITAT])
def test_sweep_stays_inside_the_limits_and_the_rate(robot: RobotProfile) -> None:
    pitch = TravelPitch(TravelPitchConfig(low_rad=-3.0, high_rad=3.0, period_s=1.0), robot)
    times = np.arange(0.0, 60.0, 0.01)
    tilts = np.array([pitch.tilt(t) for t in times])
    assert tilts.min() == pytest.approx(robot.min_tilt_rad, abs=1e-3)
    assert tilts.max() == pytest.approx(robot.max_tilt_rad, abs=1e-3)
    assert np.abs(np.diff(tilts)).max() / 0.01 <= robot.max_tilt_rate_rad_s


def test_without_sweep_the_camera_holds_one_tilt() -> None:
    pitch = TravelPitch(TravelPitchConfig(sweep=False, level_rad=-0.2), ZED)
    assert {pitch.tilt(t) for t in (0.0, 1.3, 7.0)} == {-0.2}
