"""Compares a robot's messages with its profile.

The planner relies on the profile: a camera with another mounting or field of view makes the gains
of viewpoints wrong.
"""

import logging
import math
import re
import time
from collections.abc import Callable
from typing import Final

import numpy as np

from ippon.frame import Frame
from ippon.geometry import Float64Array, invert_transform
from ippon.robot import RobotProfile
from ippon.tracking.upright import UPSIDE_DOWN, UprightCheck

logger = logging.getLogger(__name__)

CHECK_EVERY_S: Final = 5.0
HEIGHT_M: Final = 0.15
FORWARD_M: Final = 0.3
ANGLE_DEG: Final = 10.0
STEEP_DEG: Final = 80.0
"""With a steeper camera, up or down, roll and yaw are not compared."""
OPTICAL: Final = "does camera_info name the optical frame (z ahead, x to the right)?"
_LOOKS_UP: Final = math.sin(math.radians(5.0))
SHARE: Final = 0.1
"""Relative difference of field of view and aspect ratio that is accepted."""
_UNITS: Final = (10, 100, 1000)
"""Factors between the units of depth that are mistaken for each other."""
_FLOOR_REACH_M: Final = 6.0
_FLOOR_STRIDE: Final = 8
_FLOOR_FITS: Final = 0.1
"""Relative difference of a depth from that of the floor up to which the pixel shows the floor."""
_FLOOR_SHARE: Final = 0.3
"""Share of the pixels that look at the floor which must show it in another unit."""
_FLOOR_LEAST: Final = 50
_DIGITS: Final = re.compile(r"[\d.]+")


class ProfileCheck:
    """Checks frames at intervals, and reports each new contradiction once."""

    def __init__(self, profile: RobotProfile, report_event: Callable[[str, str], None]) -> None:
        self._profile = profile
        self._report_event = report_event
        self._mismatches: tuple[str, ...] = ()
        self._checked_at = -math.inf
        self._upright = UprightCheck()

    def check(self, frame: Frame) -> None:
        """Compare a frame with the profile, at most once in `CHECK_EVERY_S`."""
        now = time.monotonic()
        if now - self._checked_at < CHECK_EVERY_S:
            return
        self._checked_at = now
        # A measured value varies a little: texts that differ in digits alone are the same.
        reported = {_DIGITS.sub("", text) for text in self._mismatches}
        self._mismatches = profile_mismatches(self._profile, frame)
        # A camera that looks up sees ceilings in place of floor.
        if frame.T_world_camera[2, 2] < _LOOKS_UP:
            self._upright.add(frame)
        if self._upright.is_upside_down:
            self._mismatches = (*self._mismatches, UPSIDE_DOWN)
        for text in self._mismatches:
            if _DIGITS.sub("", text) not in reported:
                logger.warning("profile %s: %s", self._profile.name, text)
                self._report_event("error", f"robot profile {self._profile.name}: {text}")

    def notes(self) -> tuple[str, ...]:
        """Return the lines of the status that concern the profile."""
        return tuple(f"robot profile: {text}" for text in self._mismatches)


def profile_mismatches(profile: RobotProfile, frame: Frame) -> tuple[str, ...]:
    """Return where a frame's camera differs from the profile's.

    Returns:
        One sentence for each difference, with both values; empty where they agree.
    """
    T_base_camera: Float64Array = invert_transform(frame.T_world_base) @ frame.T_world_camera
    ahead = T_base_camera[:3, 2]
    pitch = math.degrees(math.asin(float(np.clip(ahead[2], -1.0, 1.0))))
    roll = math.degrees(math.atan2(T_base_camera[2, 0], -T_base_camera[2, 1]))
    yaw = math.degrees(math.atan2(ahead[1], ahead[0]))
    found = [*_mounting(profile, T_base_camera), *_lens(profile, frame)]
    unit = depth_unit_mismatch(frame)
    if unit is not None:
        found.append(unit)
    is_level = abs(pitch) < STEEP_DEG
    if is_level and abs(roll) > ANGLE_DEG:
        found.append(f"by tf the camera is rolled by {abs(roll):.0f} degrees: {OPTICAL}")
    elif is_level and abs(yaw) > ANGLE_DEG:
        found.append(
            f"by tf the camera looks {abs(yaw):.0f} degrees to the {'left' if yaw > 0 else 'right'}"
            " of where the base drives"
        )
    low, high = math.degrees(profile.min_tilt_rad), math.degrees(profile.max_tilt_rad)
    if not low - ANGLE_DEG <= pitch <= high + ANGLE_DEG:
        limits = f"{low:.0f} to {high:.0f}" if profile.can_tilt else f"{low:.0f}"
        tilted = f"by tf the camera is tilted by {pitch:.0f} degrees, the profile says {limits}"
        found.append(tilted if is_level else f"{tilted}: {OPTICAL}")
    return tuple(found)


def depth_unit_mismatch(frame: Frame) -> str | None:
    """Return what is wrong with the unit of depth; None where it may be right.

    The floor tells: in the right unit, many of the pixels that look down at it have its depth. A
    wall before the camera has other depths than the floor in any unit.
    """
    height_m = float(frame.T_world_camera[2, 3] - frame.T_world_base[2, 3])
    some = np.s_[::_FLOOR_STRIDE, ::_FLOOR_STRIDE]
    down = -(frame.camera.rays()[some] @ frame.T_world_camera[2, :3])
    depth = frame.depth[some].astype(np.float64)
    looks_at_floor = (down * _FLOOR_REACH_M > height_m) & (depth > 0.0)
    if height_m <= 0.0 or np.count_nonzero(looks_at_floor) < _FLOOR_LEAST:
        return None
    ratio = depth[looks_at_floor] * down[looks_at_floor] / height_m

    def share_at(factor: float) -> float:
        return float((np.abs(ratio * factor - 1.0) < _FLOOR_FITS).mean())

    for times in _UNITS:
        if share_at(times) >= _FLOOR_SHARE > 4.0 * share_at(1.0):
            return (
                f"depth is {times} times too short for a floor {height_m:.2f} m below the camera: "
                "is its unit right (16UC1 in millimetres, 32FC1 in metres)?"
            )
        if share_at(1.0 / times) >= _FLOOR_SHARE > 4.0 * share_at(1.0):
            return (
                f"depth is {times} times too long for a floor {height_m:.2f} m below the camera: "
                "is its unit right (16UC1 in millimetres, 32FC1 in metres)?"
            )
    return None


def _mounting(profile: RobotProfile, T_base_camera: Float64Array) -> list[str]:
    found: list[str] = []
    forward_m, left_m, height_m = (float(x) for x in T_base_camera[:3, 3])
    if abs(height_m - profile.camera_height_m) > HEIGHT_M:
        found.append(
            f"by tf the camera is {height_m:.2f} m above the base, the profile says "
            f"{profile.camera_height_m:.2f} m; is the base's frame on the floor?"
        )
    if math.hypot(forward_m - profile.camera_forward_m, left_m) > FORWARD_M:
        found.append(
            f"by tf the camera is {forward_m:.2f} m ahead and {left_m:.2f} m to the left of the "
            f"base, the profile says {profile.camera_forward_m:.2f} m ahead"
        )
    return found


def _lens(profile: RobotProfile, frame: Frame) -> list[str]:
    camera, found = frame.camera, list[str]()
    wide = 2.0 * math.atan(0.5 * camera.width / camera.fx)
    if abs(wide / profile.horizontal_fov_rad - 1.0) > SHARE:
        found.append(
            f"camera_info says {math.degrees(wide):.0f} degrees from left to right, the profile "
            f"{math.degrees(profile.horizontal_fov_rad):.0f}"
        )
    aspect = camera.width / camera.height
    if abs(aspect / profile.image_aspect - 1.0) > SHARE:
        found.append(
            f"images are {camera.width} x {camera.height}, the profile says "
            f"{profile.image_aspect:g} times as wide as high"
        )
    return found
