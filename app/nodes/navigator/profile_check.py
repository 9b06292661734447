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
from ippon.geometry import Float64Array, invert_transform, views_differ
from ippon.robot import RobotProfile
from ippon.tracking.depth_points import points_of
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
_UNITS: Final = (10.0, 100.0, 1000.0, 0.1, 0.01, 0.001)
"""Factors between the units of depth that are mistaken for each other."""
_FLOOR_REACH_M: Final = 6.0
_FLOOR_FITS: Final = 0.1
"""Relative difference of a depth from that of the floor up to which the point is on the floor."""
_FACES_UP: Final = math.cos(math.radians(40.0))
"""Height of the normal of a floor, with the noise of depth; in any unit it is the same."""
_FLOOR_SHARE: Final = 0.3
"""Share of the points below the camera that must be on the floor in another unit."""
_FLOOR_LEAST: Final = 500
UNIT_VIEWS: Final = 3
"""Views that must show a floor in another unit. A single one may show a shelf at the height of the
camera."""
_UNIT_APART_M: Final = 0.3
_UNIT_APART_RAD: Final = math.radians(15.0)
_DIGITS: Final = re.compile(r"[\d.]+")


class ProfileCheck:
    """Checks frames at intervals, and reports each new contradiction once."""

    def __init__(self, profile: RobotProfile, report_event: Callable[[str, str], None]) -> None:
        self._profile = profile
        self._report_event = report_event
        self._mismatches: tuple[str, ...] = ()
        self._reported: set[str] = set()
        self._checked_at = -math.inf
        self._upright = UprightCheck()
        self._unit = DepthUnitCheck()

    def check(self, frame: Frame) -> None:
        """Compare a frame with the profile, at most once in `CHECK_EVERY_S`."""
        now = time.monotonic()
        if now - self._checked_at < CHECK_EVERY_S:
            return
        self._checked_at = now
        self._mismatches = profile_mismatches(self._profile, frame, self._unit.mismatch)
        # A camera that looks up sees ceilings in place of floor.
        if frame.T_world_camera[2, 2] < _LOOKS_UP:
            self._upright.add(frame)
        if self._upright.is_upside_down:
            self._mismatches = (*self._mismatches, UPSIDE_DOWN)
        for text in self._mismatches:
            # A measured value varies: texts that differ in digits alone are the same.
            kind = _DIGITS.sub("", text)
            if kind not in self._reported:
                self._reported.add(kind)
                logger.warning("profile %s: %s", self._profile.name, text)
                self._report_event("error", f"robot profile {self._profile.name}: {text}")

    def notes(self) -> tuple[str, ...]:
        """Return the lines of the status that concern the profile."""
        return tuple(f"robot profile: {text}" for text in self._mismatches)


class DepthUnitCheck:
    """Says that depth is in another unit where the floor shows it in several views."""

    def __init__(self) -> None:
        self._views = 0
        self._last: Float64Array | None = None
        self._factor = 1.0
        self._mismatch: str | None = None

    def mismatch(self, frame: Frame) -> str | None:
        """Return what is wrong with the unit by a frame and those before it; None for nothing."""
        factor = _unit_factor(frame)
        if factor is None:
            return self._mismatch
        if factor != self._factor:
            self._views, self._last, self._mismatch = 0, None, None
        T = frame.T_world_camera
        self._factor = factor
        if self._last is None or views_differ(T, self._last, _UNIT_APART_M, _UNIT_APART_RAD):
            self._views, self._last = self._views + 1, T
        if self._views >= UNIT_VIEWS:
            self._mismatch = _unit_text(frame, factor)
        return self._mismatch


def depth_unit_mismatch(frame: Frame) -> str | None:
    """Return what is wrong with the unit of depth by one frame; None where it may be right.

    The floor tells: in the right unit, much of what is below the camera has its height and faces
    up. What is right before the camera, such as a wall, may have its height but faces the camera.
    """
    factor = _unit_factor(frame)
    return None if factor is None else _unit_text(frame, factor)


def profile_mismatches(
    profile: RobotProfile,
    frame: Frame,
    unit_of: Callable[[Frame], str | None] = depth_unit_mismatch,
) -> tuple[str, ...]:
    """Return where a frame's camera differs from the profile's.

    Args:
        profile: What the planner relies on.
        frame: A frame of the robot.
        unit_of: Returns what is wrong with the unit of depth.

    Returns:
        One sentence for each difference, with both values; empty where they agree.
    """
    T_base_camera: Float64Array = invert_transform(frame.T_world_base) @ frame.T_world_camera
    ahead = T_base_camera[:3, 2]
    pitch = math.degrees(math.asin(float(np.clip(ahead[2], -1.0, 1.0))))
    roll = math.degrees(math.atan2(T_base_camera[2, 0], -T_base_camera[2, 1]))
    yaw = math.degrees(math.atan2(ahead[1], ahead[0]))
    found = [*_mounting(profile, T_base_camera), *_lens(profile, frame)]
    unit = unit_of(frame)
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


def _camera_height_m(frame: Frame) -> float:
    return float(frame.T_world_camera[2, 3] - frame.T_world_base[2, 3])


def _unit_factor(frame: Frame) -> float | None:
    """Return by which factor depth shows the floor where it is, 1 for the right unit.

    None where it shows none.
    """
    height_m = _camera_height_m(frame)
    if height_m <= 0.0:
        return None
    seen = points_of(frame.depth, frame.camera, 0.0, math.inf)
    up = frame.T_world_camera[2, :3]
    below = -(seen.points @ up)
    looks_at_floor = below * _FLOOR_REACH_M > height_m * seen.points[:, 2]
    if np.count_nonzero(looks_at_floor) < _FLOOR_LEAST:
        return None
    ratio = below[looks_at_floor] / height_m
    faces_up = seen.normals[looks_at_floor] @ up > _FACES_UP

    def share_at(factor: float) -> float:
        return float((faces_up & (np.abs(ratio * factor - 1.0) < _FLOOR_FITS)).mean())

    in_this_unit = share_at(1.0)
    for factor in _UNITS:
        if share_at(factor) >= _FLOOR_SHARE > 4.0 * in_this_unit:
            return factor
    return 1.0 if in_this_unit >= _FLOOR_SHARE else None


def _unit_text(frame: Frame, factor: float) -> str | None:
    height_m = _camera_height_m(frame)
    if factor > 1.0:
        return (
            f"depth is {factor:g} times too short for a floor {height_m:.2f} m below the camera: "
            "is its unit right (16UC1 in millimetres, 32FC1 in metres)?"
        )
    if factor < 1.0:
        return (
            f"depth is {1.0 / factor:g} times too long for a floor {height_m:.2f} m below the "
            "camera: is its unit right (16UC1 in millimetres, 32FC1 in metres)?"
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
