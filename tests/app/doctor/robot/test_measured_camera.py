import pytest

from app.doctor.robot.measured_camera import UnmeasuredError, measure_camera
from app.messages import keys
from ippon.robot import ZED


def test_lens_and_mount_are_those_of_the_robot(samples):
    camera = measure_camera(samples)
    assert (camera.width, camera.height) == (160, 100)
    assert camera.horizontal_fov_deg == pytest.approx(74.0, abs=0.1)
    assert camera.height_m == pytest.approx(ZED.camera_height_m, abs=1e-6)
    assert camera.forward_m == pytest.approx(ZED.camera_forward_m, abs=1e-6)
    assert camera.tilt_deg == pytest.approx(0.0, abs=1e-6)


def test_a_mount_that_the_navigator_assumes_is_not_measured(samples):
    samples.is_mount_assumed = True
    camera = measure_camera(samples)
    assert (camera.height_m, camera.forward_m, camera.tilt_deg) == (None, None, None)
    assert camera.left_m == 0.0


def test_without_tf_the_mount_is_unknown_and_without_intrinsics_all_is(samples):
    del samples.arrivals[keys.TF]
    camera = measure_camera(samples)
    assert (camera.height_m, camera.forward_m, camera.tilt_deg) == (None, None, None)
    del samples.arrivals[keys.CAMERA_INFO]
    with pytest.raises(UnmeasuredError, match="no intrinsics: nothing comes on camera/color"):
        measure_camera(samples)
