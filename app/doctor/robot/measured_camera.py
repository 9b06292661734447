"""What a profile needs of a robot's camera, read from its messages."""

import math
from dataclasses import dataclass

import numpy as np

from app.doctor.robot.checkup import last_frame
from app.doctor.robot.images import check_camera
from app.doctor.robot.samples import Samples
from ippon.geometry import invert_transform


class UnmeasuredError(Exception):
    """The robot does not send what is to be read; the text says what is missing and what to do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredCamera:
    """Lens and mount of a camera."""

    width: int
    height: int
    horizontal_fov_deg: float
    height_m: float | None
    """Above the base's frame; this and the next two are None without tf of the robot itself."""
    forward_m: float | None
    tilt_deg: float | None
    """Of the optical axis above the horizon."""
    left_m: float = 0.0
    """The planner takes the camera to be in the middle."""

    @property
    def width_over_height(self) -> float:
        """Aspect ratio of the image."""
        return self.width / self.height


def measure_camera(samples: Samples) -> MeasuredCamera:
    """Return lens and mount of a robot's camera.

    Args:
        samples: What the robot sent.

    Raises:
        UnmeasuredError: There are no intrinsics.
    """
    check = check_camera(samples)
    if check.camera is None:
        line = next(f for f in check.findings if f.what == "intrinsics")
        raise UnmeasuredError(f"no intrinsics: {line.detail}; {line.do}")
    camera = check.camera.camera
    frame = last_frame(samples, check)
    place: tuple[float | None, float | None, float | None] = (None, None, None)
    left_m = 0.0
    if frame is not None and not samples.is_mount_assumed:
        T_base_camera = invert_transform(frame.T_world_base) @ frame.T_world_camera
        forward_m, left_m, height_m = (float(x) for x in T_base_camera[:3, 3])
        up = float(np.clip(T_base_camera[2, 2], -1.0, 1.0))
        place = height_m, forward_m, math.degrees(math.asin(up))
    return MeasuredCamera(
        width=camera.width,
        height=camera.height,
        horizontal_fov_deg=math.degrees(2.0 * math.atan(0.5 * camera.width / camera.fx)),
        height_m=place[0],
        forward_m=place[1],
        tilt_deg=place[2],
        left_m=left_m,
    )
