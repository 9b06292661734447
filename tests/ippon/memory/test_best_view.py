import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.memory.best_view import better_views

CAMERA = PinholeCamera.from_horizontal_fov(160, 120, 1.2)


@pytest.fixture
def frame():
    """Looks along x from one metre above the origin, at a wall that is 2 m away."""
    color = np.zeros((120, 160, 3), np.uint8)
    color[..., 0] = np.arange(160)
    return Frame(
        stamp_ns=0,
        color=color,
        depth=np.full((120, 160), 2.0, np.float32),
        camera=CAMERA,
        T_world_camera=make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0)),
        T_world_base=np.eye(4),
        tilt_rad=0.0,
    )


def test_a_thing_in_the_middle_gets_a_picture_round_it(frame, make_instance):
    (view,) = better_views(frame, [make_instance(at=(2.0, 0.0, 1.0))])
    height, width = view.color.shape[:2]
    assert 24 <= height < 80
    assert 24 <= width < 80
    assert abs(int(view.color[0, width // 2, 0]) - 80) <= 3, "the middle of the image"
    assert 0.0 < view.score < 0.2


def test_a_nearer_view_is_better_and_a_little_better_is_not_enough(frame, make_instance):
    far = make_instance(at=(2.2, 0.0, 1.0), view_score=0.0)
    (view,) = better_views(frame, [far])
    assert better_views(frame, [make_instance(at=(2.2, 0.0, 1.0), view_score=view.score)]) == ()
    near = make_instance(at=(1.8, 0.0, 1.0), view_score=0.5 * view.score)
    assert better_views(frame, [near])[0].score > view.score


@pytest.mark.parametrize(
    ("what", "at"),
    [
        ("hidden by the wall", (4.0, 0.0, 1.0)),
        ("on the other side of a thin wall", (2.3, 0.0, 1.0)),
        ("behind the camera", (-2.0, 0.0, 1.0)),
        ("out of view", (2.0, 3.0, 1.0)),
        ("mostly cut off", (2.0, 1.35, 1.0)),
        ("not there: the view goes on behind it", (1.0, 0.0, 1.0)),
    ],
)
def test_no_picture_of_what_does_not_show(frame, make_instance, what, at):
    assert better_views(frame, [make_instance(at=at)]) == (), what


def test_no_picture_of_what_is_gone_or_of_nothing(frame, make_instance):
    assert better_views(frame, []) == ()
    assert better_views(frame, [make_instance(at=(2.0, 0.0, 1.0), gone_ns=5)]) == ()


def test_the_best_gains_come_first_and_not_more_than_wanted(frame, make_instance):
    things = [make_instance(k, at=(2.0, 0.0, 0.9 + 0.05 * k)) for k in range(1, 6)]
    views = better_views(frame, things, at_most=2)
    assert [view.instance_id for view in views] == [2, 1]
