from contextlib import nullcontext
from dataclasses import replace

import pytest

from app.cli.main import run
from app.cli.setup import profile_from_robot
from app.cli.setup.profile_from_robot import MOUNT, QUESTIONS, write_profile
from app.doctor.robot.measured_camera import MeasuredCamera
from app.doctor.robot.samples import Samples
from app.robot_file import read_profile

CAMERA = MeasuredCamera(
    width=640, height=480, horizontal_fov_deg=69.4, height_m=0.612, forward_m=0.2, tilt_deg=-12.3,
    left_m=0.05,
)  # fmt: skip


def test_what_is_read_and_what_is_answered_becomes_a_profile(tmp_path, capsys):
    answers = iter(["0.3", "tall", "0.7", "", "0.4", "45", "", "3.5"])
    text = write_profile("scout", CAMERA, lambda _: next(answers))
    path = tmp_path / "scout.yaml"
    path.write_text(text, "utf-8")
    robot = read_profile(str(path))
    assert (robot.name, robot.camera_height_m, robot.camera_forward_m) == ("scout", 0.612, 0.2)
    assert (robot.radius_m, robot.max_linear_m_s, robot.max_depth_m) == (0.3, 0.4, 3.5)
    assert robot.image_aspect == pytest.approx(4 / 3, abs=1e-3)
    assert "tilt: -12.3  # read" in text
    assert "clearance_m: 0.05  # typical" in text
    assert "radius_m: 0.3  # answered" in text
    assert "0.05 m to the left" in text
    assert "a number is needed; got 'tall'" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["7", "off", "a: b", "Büro"])
def test_a_name_that_yaml_takes_for_something_else_is_read_back(name, tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text(write_profile(name, CAMERA, None), "utf-8")
    assert read_profile(str(path)).name == name


def test_a_level_camera_has_no_tilt_of_rounding_errors():
    level = replace(CAMERA, tilt_deg=-4.37e-15, forward_m=2e-17)
    text = write_profile("scout", level, None)
    assert "  tilt: 0  # read\n" in text
    assert "  forward_m: 0  # read\n" in text


def test_without_tf_the_mount_is_asked_for_and_without_a_terminal_nothing_is():
    bare = MeasuredCamera(
        width=640, height=480, horizontal_fov_deg=69.0, height_m=None, forward_m=None, tilt_deg=None
    )
    asked = []
    write_profile("scout", bare, lambda text: asked.append(text) or "")
    assert len(asked) == len(QUESTIONS) + len(MOUNT)
    assert write_profile("scout", bare, None).count("# typical") == len(asked)


def test_a_robot_that_sends_nothing_is_refused(monkeypatch, capsys):
    monkeypatch.setattr(profile_from_robot, "open_client", lambda _: nullcontext())
    monkeypatch.setattr(profile_from_robot, "listen", lambda *_: Samples(seconds=0.0))
    arguments = ["profile", "--from-robot", "scout", "--connect", "tcp/127.0.0.1:1"]
    assert run(arguments) == 2
    assert "no intrinsics: nothing comes on camera/color/camera_info" in capsys.readouterr().err


def test_a_shipped_profile_is_printed_with_its_sources(capsys):
    assert run(["profile", "spot"]) == 0
    assert capsys.readouterr().out.startswith("# Boston Dynamics Spot")
