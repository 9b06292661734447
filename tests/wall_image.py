"""Images of a wall across the view, at a depth that is known."""

import numpy as np

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, Float64Array, make_transform


def wall_image(
    depth_m: float, *, T_world_camera: Float64Array | None = None, stamp_ns: int = 1
) -> Frame:
    """Return a frame of a level camera that looks along x, 1 m above the floor by default."""
    if T_world_camera is None:
        T_world_camera = make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0))
    return Frame(
        stamp_ns=stamp_ns,
        color=np.zeros((90, 120, 3), np.uint8),
        depth=np.full((90, 120), depth_m, np.float32),
        camera=PinholeCamera.from_horizontal_fov(120, 90, 1.2),
        T_world_camera=T_world_camera,
        T_world_base=np.eye(4),
        tilt_rad=0.0,
    )
