"""Points of the surface at which an image of a detector recognises the object."""

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.mission.finds.recognised_points import points_at, recognised_points
from ippon.mission.snapshot import Find
from ippon.observation import Heatmap
from ippon.observation_model import ObservationModels

CAMERA = PinholeCamera.from_horizontal_fov(64, 48, 1.2)
SURE = 230


def frame(depth: np.ndarray, scores: np.ndarray) -> Frame:
    """An image from one metre above the origin along x; `scores` are those of the hat."""
    probabilities = np.zeros((*scores.shape, 2), np.uint8)
    probabilities[..., 1] = scores
    heatmap = Heatmap(labels=("wall",), ooi="hat", probabilities=probabilities, kind="scores")
    return Frame(
        stamp_ns=0,
        color=np.zeros((48, 64, 3), np.uint8),
        depth=depth.astype(np.float32),
        camera=CAMERA,
        T_world_camera=make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0)),
        T_world_base=make_transform(np.eye(3), (0.0, 0.0, 0.0)),
        tilt_rad=0.0,
        heatmap=heatmap,
    )


def find(at, size=(0.2, 0.2, 0.2)) -> Find:
    return Find(position_world=at, size_m=size, probability=1.0, voxels=8, box_px=None)


@pytest.mark.parametrize("scale", [1, 2])
def test_points_lie_where_the_pixels_that_score_show_the_surface(scale):
    depth = np.full((48, 64), 2.0)
    scores = np.zeros((48 // scale, 64 // scale), np.uint8)
    # The right upper quarter of the image: y below 0, z above the camera.
    scores[: 24 // scale, 32 // scale :] = SURE
    points = recognised_points(frame(depth, scores), "hat", ObservationModels())
    assert len(points) == (24 // scale) * (32 // scale)
    assert points[:, 0] == pytest.approx(2.0)
    half_m = np.array([2.0 * 32 / CAMERA.fx, 2.0 * 24 / CAMERA.fy])
    pixel_m = 2.0 / CAMERA.fx
    assert points[:, 1].min() == pytest.approx(-half_m[0], abs=2 * pixel_m)
    assert points[:, 1].max() == pytest.approx(0.0, abs=2 * pixel_m)
    assert points[:, 2].max() == pytest.approx(1.0 + half_m[1], abs=2 * pixel_m)
    assert points[:, 2].min() == pytest.approx(1.0, abs=2 * pixel_m)


def test_what_scores_too_little_or_has_no_depth_is_no_point():
    depth = np.full((48, 64), 2.0)
    depth[:, :16], depth[:, 16:32] = 0.0, np.nan
    scores = np.full((48, 64), SURE, np.uint8)
    scores[:, 32:48] = 3
    points = recognised_points(frame(depth, scores), "hat", ObservationModels())
    assert len(points) == 48 * 16
    nothing = frame(depth, np.zeros((48, 64), np.uint8))
    assert recognised_points(nothing, "hat", ObservationModels()).shape == (0, 3)
    assert recognised_points(nothing, "cup", ObservationModels()).shape == (0, 3)


def test_points_at_a_find_are_those_near_it_and_not_too_many():
    depth = np.full((48, 64), 2.0)
    scores = np.full((48, 64), SURE, np.uint8)
    points = recognised_points(frame(depth, scores), "hat", ObservationModels())
    here = points_at(points, find((2.0, 0.0, 1.0)), 0.3)
    assert len(here) == 64
    assert np.hypot(here[:, 0] - 2.0, here[:, 1]).max() <= 0.3 + 0.5 * np.sqrt(3 * 0.2**2)
    assert points_at(points, find((5.0, 0.0, 1.0)), 0.3).shape == (0, 2)
