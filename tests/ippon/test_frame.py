import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.errors import FrameRejectedError
from ippon.frame import Frame
from ippon.observation import Heatmap


def frame(**change: object) -> Frame:
    good = {
        "stamp_ns": 1,
        "color": np.zeros((3, 4, 3), np.uint8),
        "depth": np.ones((3, 4), np.float32),
        "camera": PinholeCamera.from_horizontal_fov(4, 3, 1.0),
        "T_world_camera": np.eye(4),
        "T_world_base": np.eye(4),
        "tilt_rad": 0.0,
    }
    return Frame(**{**good, **change})  # type: ignore[arg-type]


def test_a_good_frame_is_taken() -> None:
    assert frame().contact is False


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"color": np.zeros((4, 3, 3), np.uint8)}, "colour is"),
        ({"depth": np.ones((3, 4), np.float64)}, "depth is"),
        ({"T_world_camera": np.full((4, 4), np.nan)}, "T_world_camera is not a rigid"),
        ({"T_world_base": 2 * np.eye(4)}, "T_world_base is not a rigid"),
    ],
)
def test_a_contradictory_frame_is_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(FrameRejectedError, match=message):
        frame(**change)


def test_heatmap_has_a_channel_for_an_object_outside_the_labels() -> None:
    heatmap = Heatmap(
        labels=("wall", "bed"), ooi="hat", probabilities=np.zeros((2, 2, 3), np.uint8)
    )
    assert heatmap.ooi_channel == 2


def test_heatmap_shares_the_channel_of_a_common_object() -> None:
    heatmap = Heatmap(
        labels=("wall", "bed"), ooi="bed", probabilities=np.zeros((2, 2, 2), np.uint8)
    )
    assert heatmap.ooi_channel == 1
    none = Heatmap(labels=("wall",), ooi=None, probabilities=np.zeros((2, 2, 1), np.uint8))
    assert none.ooi_channel is None


def test_heatmap_with_a_missing_channel_is_refused() -> None:
    with pytest.raises(ValueError, match=r"is \(h, w, 3\) uint8"):
        Heatmap(labels=("wall", "bed"), ooi="hat", probabilities=np.zeros((2, 2, 2), np.uint8))
