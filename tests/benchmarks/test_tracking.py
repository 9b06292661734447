"""Errors of a tracked pose, and Open3D's odometry on rendered frames."""

import numpy as np
import pytest

from ippon.geometry import make_transform, rotation_z
from tests.benchmarks.tracking import error_of


def test_errors_of_a_pose_do_not_depend_on_the_world():
    truth = make_transform(rotation_z(0.4), (1.0, 2.0, 3.0))
    pose = make_transform(rotation_z(0.4 + np.radians(5.0)), (1.03, 2.04, 3.0))
    assert error_of(pose, truth) == pytest.approx((5.0, 5.0))
    moved = make_transform(rotation_z(1.0), (-5.0, 0.0, 1.0))
    assert error_of(moved @ pose, moved @ truth) == pytest.approx((5.0, 5.0))
    assert error_of(truth, truth) == (0.0, pytest.approx(0.0, abs=1e-6))
