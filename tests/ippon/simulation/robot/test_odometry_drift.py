import math

import numpy as np
import pytest

from ippon.geometry import base_pose, is_rigid
from ippon.simulation.robot.odometry_drift import DriftConfig, OdometryDrift


def along(count):
    return [base_pose(0.1 * k, 0.0, 0.0, 0.0) for k in range(count)]


def final_errors(config, metres):
    errors = []
    for seed in range(60):
        drift = OdometryDrift(along(1)[0], config, seed)
        for pose in along(int(10 * metres) + 1):
            drift.follow(pose)
        errors.append(drift.T_world_base[:2, 3] - (metres, 0.0))
    return np.array(errors)


def test_without_drift_the_truth_is_reported_exactly():
    drift = OdometryDrift(along(1)[0], DriftConfig(), 0)
    for pose in along(50):
        drift.follow(pose)
        np.testing.assert_array_equal(drift.T_world_base, pose)


def test_errors_grow_with_the_root_of_the_distance():
    config = DriftConfig(position_per_sqrt_m=0.02)
    near, far = final_errors(config, 1.0), final_errors(config, 9.0)
    assert near.std() == pytest.approx(0.02, rel=0.3)
    assert far.std() == pytest.approx(0.06, rel=0.3)


def test_heading_drifts_while_turning_and_the_pose_stays_one():
    config = DriftConfig(yaw_per_sqrt_rad=0.02)
    headings = []
    for seed in range(60):
        drift = OdometryDrift(along(1)[0], config, seed)
        for k in range(101):
            drift.follow(base_pose(0.0, 0.0, 0.0, 0.04 * k))
        assert is_rigid(drift.T_world_base, 1e-9)
        headings.append(math.atan2(drift.T_world_base[1, 0], drift.T_world_base[0, 0]) - 4.0)
    headings = (np.array(headings) + np.pi) % (2 * np.pi) - np.pi
    assert headings.std() == pytest.approx(0.04, rel=0.3)


def test_standing_still_does_not_drift():
    drift = OdometryDrift(along(1)[0], DriftConfig(position_per_sqrt_m=0.1), 0)
    for _ in range(20):
        drift.follow(along(1)[0])
    np.testing.assert_allclose(drift.T_world_base, along(1)[0], atol=1e-12)


def test_negative_growth_is_refused():
    with pytest.raises(ValueError, match="at least 0"):
        DriftConfig(yaw_per_sqrt_m=-0.1)
