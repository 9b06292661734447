import hashlib
import subprocess
import sys

import numpy as np
import pytest

from ippon.command import Command
from ippon.robot import HABITAT, ZED
from ippon.simulation.robot.mobile_base import BaseConfig
from ippon.simulation.robot.odometry_drift import DriftConfig
from ippon.simulation.world import SimulatedWorld, WorldConfig
from ippon.vocabulary import MATTERPORT_40


def world_of(scene, camera, seed=0, robot=ZED, config=None):
    world = SimulatedWorld(scene, robot, camera, scene.start_poses[0], seed, config)
    world.set_labels(MATTERPORT_40, "hat")
    return world


def drive(world, frames=12):
    for k in range(frames):
        yield world.observe()
        world.step(Command(linear_m_s=0.5, yaw_rate_rad_s=0.3 * (-1) ** k, tilt_rad=-0.3), 0.2)


def digest(frames):
    total = hashlib.sha256()
    for frame in frames:
        for array in (frame.color, frame.depth, frame.T_world_camera, frame.heatmap.probabilities):
            total.update(np.ascontiguousarray(array).tobytes())
    return total.hexdigest()


def test_the_same_seed_and_commands_give_the_same_frames(furnished, camera):
    one, two, other = (digest(drive(world_of(furnished, camera, s))) for s in (3, 3, 4))
    assert one == two
    assert one != other


@pytest.mark.process
def test_another_process_sees_the_same_frames(furnished, camera, tmp_path):
    """Nothing may depend on hash seeds, build order or addresses."""
    script = tmp_path / "digest.py"
    script.write_text(
        "import importlib.util, sys\n"
        "def load(name, path):\n"
        "    spec = importlib.util.spec_from_file_location(name, path)\n"
        "    module = importlib.util.module_from_spec(spec)\n"
        "    spec.loader.exec_module(module)\n"
        "    return module\n"
        "boxes, tests = load('boxes', sys.argv[1]), load('tests_of_world', sys.argv[2])\n"
        "from ippon.camera import PinholeCamera\n"
        "import numpy as np\n"
        "scene = boxes.furnished_scene()\n"
        "camera = PinholeCamera.from_horizontal_fov(160, 100, np.radians(74.0))\n"
        "print(tests.digest(tests.drive(tests.world_of(scene, camera, 3))))\n"
    )
    conftest = __file__.replace("test_world.py", "conftest.py")
    ran = subprocess.run(
        [sys.executable, str(script), conftest, __file__],
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONHASHSEED": "77", "PATH": "/usr/bin:/bin"},
        timeout=120,
    )
    assert ran.stdout.strip() == digest(drive(world_of(furnished, camera, 3)))


def test_frames_say_when_and_where(furnished, camera):
    world = world_of(furnished, camera)
    frames = list(drive(world, 5))
    assert [frame.stamp_ns for frame in frames] == [k * 200_000_000 for k in range(5)]
    assert frames[0].heatmap.ooi == "hat"
    for frame in frames:
        np.testing.assert_allclose(
            frame.T_world_camera, frame.T_world_base @ ZED.T_base_camera(frame.tilt_rad)
        )
        assert frame.depth.max() <= ZED.max_depth_m
    assert frames[-1].tilt_rad == pytest.approx(-0.3)
    assert len(world.trajectory) == 6
    np.testing.assert_allclose(world.trajectory[4, :2], frames[4].T_world_base[:2, 3])
    steps = np.linalg.norm(np.diff(world.trajectory, axis=0), axis=1)
    assert world.path_length_m() == pytest.approx(steps.sum())
    assert world.path_length_m() > 0.2


def test_standing_still_adds_nothing_to_the_trajectory(furnished, camera):
    world = world_of(furnished, camera)
    for _ in range(50):
        world.step(None, 0.2)
    assert world.stamp_ns == 10_000_000_000
    assert len(world.trajectory) == 1
    assert world.path_length_m() == 0.0


def test_labels_can_change_and_be_turned_off(furnished, camera):
    world = world_of(furnished, camera)
    world.set_labels(MATTERPORT_40, "chair")
    assert world.observe().heatmap.ooi_channel == MATTERPORT_40.index("chair")
    world.set_labels((), None)
    assert world.observe().heatmap is None


def test_contact_reaches_the_frame_and_is_counted(furnished, camera):
    world = world_of(furnished, camera)
    for _ in range(40):
        world.step(Command(linear_m_s=0.8), 0.2)
    assert world.observe().contact
    assert world.collisions == 1


def test_a_contact_that_ended_before_the_image_is_in_its_frame_once(furnished, camera):
    world = world_of(furnished, camera)
    while not world.base.contact:
        world.step(Command(linear_m_s=0.8), 0.1)
    while world.base.contact:
        world.step(Command(linear_m_s=-0.3), 0.1)
    assert world.observe().contact
    world.step(Command(linear_m_s=-0.3), 0.1)
    assert not world.observe().contact


def test_a_drifting_robot_believes_in_another_pose_than_the_true_one(furnished, camera):
    config = WorldConfig(
        drift=DriftConfig(position_per_sqrt_m=0.05), base=BaseConfig(latency_s=0.1)
    )
    world = world_of(furnished, camera, config=config)
    frames = list(drive(world, 6))
    believed = frames[-1].T_world_base[:2, 3]
    true = world.trajectory[5, :2]
    assert 0.001 < np.linalg.norm(believed - true) < 0.5
    np.testing.assert_allclose(
        frames[-1].T_world_camera, frames[-1].T_world_base @ ZED.T_base_camera(frames[-1].tilt_rad)
    )


def test_a_perfect_world_has_the_truth_in_its_frames(furnished, camera):
    frame = world_of(furnished, camera, config=WorldConfig.perfect()).observe()
    again = world_of(furnished, camera, seed=9, config=WorldConfig.perfect()).observe()
    np.testing.assert_array_equal(frame.depth, again.depth)
    np.testing.assert_array_equal(frame.heatmap.probabilities, again.heatmap.probabilities)


def test_other_robots_look_and_reach_as_their_profile_says(furnished, camera):
    portrait = type(camera).from_horizontal_fov(60, 80, HABITAT.horizontal_fov_rad)
    world = world_of(furnished, portrait, robot=HABITAT)
    frame = world.observe()
    assert frame.T_world_camera[2, 3] == pytest.approx(HABITAT.camera_height_m)
    assert frame.heatmap.probabilities.shape == (160, 120, 41)
    assert frame.depth[frame.depth > 0.0].min() >= HABITAT.min_depth_m


DETECTOR = WorldConfig(segmentation_errors="detector")


@pytest.mark.slow
def test_the_simulated_detector_gives_scores(furnished, camera):
    frames = list(drive(world_of(furnished, camera, config=DETECTOR)))
    assert {frame.heatmap.kind for frame in frames} == {"scores"}
    assert {frame.heatmap.source for frame in frames} == {"simulated detector"}
    assert {frame.heatmap.ooi for frame in frames} == {"hat"}
    one, two, other = (
        digest(drive(world_of(furnished, camera, s, config=DETECTOR))) for s in (3, 3, 4)
    )
    assert one == two
    assert one != other


def test_labels_may_be_taken_away_from_a_detector_and_given_back(furnished, camera):
    world = world_of(furnished, camera, config=DETECTOR)
    world.set_labels((), None)
    assert world.observe().heatmap is None
    world.set_labels(("chair",), None)
    heatmap = world.observe().heatmap
    assert (heatmap.labels, heatmap.ooi) == (("chair",), None)
