"""A wall that a camera looks at, with one score for a label in each image."""

from collections.abc import Callable

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.observation import Heatmap

CAMERA = PinholeCamera(width=80, height=60, fx=70.0, fy=70.0, cx=39.5, cy=29.5)


@pytest.fixture
def wall() -> Callable[..., tuple[Frame, Heatmap]]:
    """Return a maker of images of the plane x = 2 m, taken from (0, y, 1.2)."""

    def make(value: int, *, y: float = 0.0, n: int = 0) -> tuple[Frame, Heatmap]:
        scores = np.full((60, 80, 1), value, np.uint8)
        heatmap = Heatmap(
            labels=(), ooi="cup", probabilities=scores, kind="scores", source="tester"
        )
        frame = Frame(
            stamp_ns=n * 10**8,
            color=np.zeros((60, 80, 3), np.uint8),
            depth=np.full((60, 80), 2.0, np.float32),
            camera=CAMERA,
            T_world_camera=make_transform(R_BASE_CAMERA_LEVEL, np.array([0.0, y, 1.2])),
            T_world_base=make_transform(np.eye(3), np.array([0.0, y, 0.0])),
            tilt_rad=0.0,
        )
        return frame, heatmap

    return make
