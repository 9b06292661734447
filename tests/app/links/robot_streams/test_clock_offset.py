import pytest

from app.links.robot_streams.clock_offset import estimate_offset
from tests.app.links.robot_streams.turning_robot import TurningRobot


@pytest.fixture(scope="module")
def turning():
    return TurningRobot()


@pytest.mark.slow
@pytest.mark.parametrize("offset_s", [-0.5, -0.18, -0.05, 0.0, 0.08, 0.3])
def test_the_offset_is_found_within_ten_milliseconds(turning, offset_s):
    estimate = estimate_offset(turning.depths, turning.camera, turning.pose_at(offset_s))
    assert estimate.offset_s == pytest.approx(offset_s, abs=0.01)
    assert estimate.error_s < 0.01


@pytest.mark.slow
def test_jitter_of_the_poses_does_not_shift_it(turning):
    pose_at = turning.pose_at(0.1, jitter_s=0.01)
    assert estimate_offset(turning.depths, turning.camera, pose_at).offset_s == pytest.approx(
        0.1, abs=0.015
    )
