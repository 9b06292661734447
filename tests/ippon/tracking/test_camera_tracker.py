"""Tracking of rendered and recorded frames, what happens when it is lost, and how it comes back."""

import numpy as np
import pytest

from app.datasets.dataset import open_dataset, read_color, read_depth
from ippon.camera import PinholeCamera
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform, rotation_y
from ippon.tracking.camera_tracker import CameraTracker, TrackerConfig
from tests.locations import SHARED

pytestmark = pytest.mark.slow

KITCHEN = SHARED / "rgbd" / "redkitchen_a"


def track(walk, frames, tracker=None):
    tracker = tracker or CameraTracker(walk.camera, walk.poses[0])
    return [tracker.track(*frame) for frame in frames], tracker


@pytest.fixture(scope="module")
def turned(walk):
    """Poses of a whole turn, and the tracker that was given it."""
    return track(walk, walk.frames)


def test_a_turn_with_a_noisy_camera_is_followed_to_two_centimetres(walk, turned):
    tracked, tracker = turned
    errors = walk.errors([one.T_world_camera for one in tracked])
    assert np.median(errors[:, 0]) < 0.02, np.median(errors, axis=0)
    assert np.median(errors[:, 1]) < 0.5, np.median(errors, axis=0)
    # Open3D adds in no fixed order: where little holds the pose, at frame 65, the largest error is
    # 1.6 to 2.6 cm in 28 runs, and was 4.4 cm once.
    assert errors[:, 0].max() < 0.1, errors.max(axis=0)
    assert errors[:, 1].max() < 2.0, errors.max(axis=0)
    assert min(one.fit for one in tracked) > 0.5
    assert tracker.surface_points > 5000


def test_poses_stay_rigid_when_each_step_continues_the_last(walk):
    tracker = CameraTracker(walk.camera, walk.poses[0])
    tracker._odometry = lambda _: tracker._step
    tracked, _ = track(walk, walk.frames[:60], tracker)
    rotation = tracked[-1].T_world_camera[:3, :3]
    assert np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-12


def test_a_camera_that_is_covered_is_lost_and_finds_its_place_where_it_has_been(walk, turned):
    tracked, tracker = turned
    dark = (np.zeros_like(walk.frames[0][0]), np.zeros_like(walk.frames[0][1]))
    lost = tracker.track(*dark)
    assert lost.T_world_camera is None
    assert lost.problem == "too little depth in view: 0 points, 300 are needed"
    assert tracker.is_lost
    # Uncovered, it looks back by 100 degrees.
    found = tracker.track(*walk.frames[64])
    assert not tracker.is_lost
    known = tracked[64].T_world_camera
    assert np.linalg.norm(found.T_world_camera[:3, 3] - known[:3, 3]) < 0.1


def test_a_camera_that_faces_a_bare_wall_squarely_is_not_lost():
    camera = PinholeCamera.from_horizontal_fov(320, 240, 1.2)
    R = rotation_y(0.35) @ R_BASE_CAMERA_LEVEL
    rays = camera.rays() @ R.T
    with np.errstate(divide="ignore"):
        floor = np.where(rays[..., 2] < 0.0, -1.3 / rays[..., 2], np.inf)
    depth = np.minimum(floor, 3.0 / rays[..., 0]).astype(np.float32)
    tracker = CameraTracker(camera, make_transform(R, (0.0, 0.0, 1.3)))
    for _ in range(5):
        tracked = tracker.track(np.zeros((240, 320, 3), np.uint8), depth)
        assert tracked.problem == ""
        assert np.allclose(tracked.T_world_camera[:3, 3], (0.0, 0.0, 1.3), atol=0.02)


def test_a_jump_is_not_believed(walk):
    _, tracker = track(walk, walk.frames[:10])
    jumped = tracker.track(*walk.frames[45])
    assert jumped.T_world_camera is None
    assert jumped.problem
    # Where it has never been, it stays lost.
    assert tracker.track(*walk.frames[46]).T_world_camera is None
    assert "fits a place where the camera has been" in tracker.track(*walk.frames[46]).problem


def test_nothing_in_view_at_first_is_no_loss(walk):
    tracker = CameraTracker(walk.camera, walk.poses[0])
    empty = np.zeros_like(walk.frames[0][1])
    assert tracker.track(walk.frames[0][0], empty).T_world_camera is None
    assert not tracker.is_lost
    assert tracker.track(*walk.frames[0]).T_world_camera is not None


@pytest.mark.skipif(not KITCHEN.exists(), reason="the recorded kitchen is not in ../shared")
@pytest.mark.parametrize("count", [80, pytest.param(200, marks=pytest.mark.large)])
def test_a_recorded_kitchen_is_tracked_without_a_loss(count):
    dataset = open_dataset(KITCHEN)
    first = dataset.frames[0].T_world_camera
    tracker = CameraTracker(dataset.camera, first)
    errors = []
    assert len(dataset.frames) == 200
    for one in dataset.frames[:count]:
        depth = read_depth(one.depth, dataset.depth_unit_m, dataset.camera)
        pose = tracker.track(read_color(one.color, dataset.camera), depth).T_world_camera
        relative = np.linalg.inv(one.T_world_camera) @ pose
        angle = np.arccos(np.clip(0.5 * (np.trace(relative[:3, :3]) - 1.0), -1.0, 1.0))
        errors.append((np.linalg.norm(relative[:3, 3]), np.degrees(angle)))
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    # The recorded poses themselves jump by 4 cm at frame 41: see docs/results.md.
    assert rms[0] < 0.12, rms
    assert rms[1] < 2.0, rms


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"nearest_m": 6.0}, "nearest_m lies below farthest_m"),
        ({"min_fit": 0.9}, "min_fit lies above 0 and up to min_fit_found"),
    ],
)
def test_a_configuration_without_meaning_is_refused(changes, text):
    with pytest.raises(ValueError, match=text):
        TrackerConfig(**changes)
