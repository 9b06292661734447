"""Lines over the camera picture: objects, the way ahead and the limits of the collision filter."""

from dataclasses import dataclass, field
from typing import Final, Literal

import msgspec
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from app.messages.driving import DriveStatus
from app.view.camera.picture_encoding import turned
from app.view.camera.way_ahead import commanded_way, edges_of, limit_ahead, planned_way
from app.view.drawing.find_layer import ObjectMark
from app.view.words import ENGLISH, Words
from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array, invert_transform, transform_points

NEAR_M: Final = 0.15
"""Depth below which a line is cut off."""
_FAR: Final = 3.0
"""Coordinates beyond this share of the image are cut; nothing there is visible."""
_BODY_M: Final = 0.25
"""Half the width of the way of a robot that does not tell its body's."""
_REACH_M: Final = 8.0
"""Distance up to which candidates are outlined."""
_CORNERS: Final = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.5

LineKind = Literal["find", "hidden", "candidate", "way", "edge", "stop", "slow", "seen"]


class ImageLine(msgspec.Struct, frozen=True, kw_only=True):
    """A polyline in the upright picture."""

    kind: LineKind
    points: list[tuple[float, float]]
    """x and y as shares of width and height; may be outside 0 to 1."""
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CameraScene:
    """What the lines are computed from, as of one moment; immutable."""

    camera: PinholeCamera | None = None
    poses: tuple[tuple[int, Float64Array], ...] = ()
    """Stamp in nanoseconds and T_world_camera of the last poses, in order."""
    T_world_base: Float64Array | None = None
    path_world: Float64Array = field(default_factory=lambda: np.empty((0, 3)))
    objects: tuple[ObjectMark, ...] = ()
    drive: DriveStatus = field(default_factory=DriveStatus)
    wanted: str = ""
    """Object of interest."""
    say: Words = ENGLISH
    """The words of the names."""

    def pose_at(self, stamp_ns: int) -> Float64Array | None:
        """Return T_world_camera at the time of an image, of the nearest known pose."""
        if not self.poses:
            return None
        return min(self.poses, key=lambda pose: abs(pose[0] - stamp_ns))[1]


NO_SCENE: Final = CameraScene()


def lines_of(
    scene: CameraScene, stamp_ns: int, turns: int, command: tuple[float, float] | None
) -> list[ImageLine]:
    """Return the lines over an image.

    Args:
        scene: Poses, objects and path.
        stamp_ns: Time of the image.
        turns: Quarter turns counterclockwise of the picture.
        command: Last command to the wheels, m/s and rad/s; None if none came recently.
    """
    camera, T_world_camera = scene.camera, scene.pose_at(stamp_ns)
    if camera is None or T_world_camera is None:
        return []
    T_camera_world = invert_transform(T_world_camera)

    def draw(kind: LineKind, points_world: Float64Array, text: str = "") -> None:
        for part in _projected(camera, transform_points(T_camera_world, points_world)):
            points = [turned(x, y, turns) for x, y in part]
            lines.append(ImageLine(kind=kind, points=points, text=text))

    lines: list[ImageLine] = []
    if scene.T_world_base is not None:
        for kind, points in _floor_lines(scene, scene.T_world_base, command):
            draw(kind, points)
    for one in scene.objects:
        outline = _outline(camera, T_camera_world, one)
        if outline is not None:
            points = [turned(x, y, turns) for x, y in outline]
            kind: LineKind = "candidate"
            if one.found:
                kind = "hidden" if one.hidden else "find"
            lines.append(ImageLine(kind=kind, points=points, text=one.text))
    return lines


def _floor_lines(
    scene: CameraScene, T_world_base: Float64Array, command: tuple[float, float] | None
) -> list[tuple[LineKind, Float64Array]]:
    drive = scene.drive
    if drive.mode == "manual" and drive.waypoint is None:
        way = commanded_way(T_world_base, *(command or (0.0, 0.0)))
    else:
        way = planned_way(scene.path_world, T_world_base)
    lines: list[tuple[LineKind, Float64Array]] = []
    if len(way) > 1:
        left, right = edges_of(way, drive.body_half_width_m or _BODY_M)
        lines.extend((("way", way), ("edge", left), ("edge", right)))
    if drive.stop_within_m > 0.0 and drive.mode != "auto":
        lines.append(("stop", limit_ahead(T_world_base, drive.stop_within_m)))
        lines.append(("slow", limit_ahead(T_world_base, drive.slow_within_m)))
    return lines


def _projected(camera: PinholeCamera, points: Float64Array) -> list[list[tuple[float, float]]]:
    """Project a polyline in the camera frame; cut where it is behind the image plane.

    Returns:
        Parts with x and y as shares of width and height.
    """
    parts: list[list[tuple[float, float]]] = []
    current: list[tuple[float, float]] = []
    for k, point in enumerate(points):
        before = points[k - 1] if k else point
        if (before[2] < NEAR_M) != (point[2] < NEAR_M):
            t = (NEAR_M - before[2]) / (point[2] - before[2])
            current.append(_pixel(camera, before + t * (point - before)))
        if point[2] >= NEAR_M:
            current.append(_pixel(camera, point))
        elif current:
            parts.append(current)
            current = []
    if current:
        parts.append(current)
    return [part for part in parts if len(part) > 1 and _is_visible(part)]


def _pixel(camera: PinholeCamera, point: Float64Array) -> tuple[float, float]:
    x, y, z = (float(c) for c in point)
    z = max(z, NEAR_M)
    u = (camera.fx * x / z + camera.cx + 0.5) / camera.width
    v = (camera.fy * y / z + camera.cy + 0.5) / camera.height
    return round(min(max(u, -_FAR), _FAR), 4), round(min(max(v, -_FAR), _FAR), 4)


def _is_visible(part: list[tuple[float, float]]) -> bool:
    xs, ys = zip(*part, strict=True)
    return min(xs) < 1.0 and max(xs) > 0.0 and min(ys) < 1.0 and max(ys) > 0.0


def _outline(
    camera: PinholeCamera, T_camera_world: Float64Array, one: ObjectMark
) -> list[tuple[float, float]] | None:
    """Return the closed outline of a box in the image; None if any of it is behind the camera."""
    corners = np.array(one.center_world) + _CORNERS * np.array(one.size_m)
    points = transform_points(T_camera_world, corners)
    if points[:, 2].min() < NEAR_M or (not one.found and points[:, 2].min() > _REACH_M):
        return None
    pixels = [_pixel(camera, point) for point in points]
    if not _is_visible(pixels):
        return None
    try:
        order = ConvexHull(np.array(pixels)).vertices.tolist()
    except QhullError:
        return None
    return [pixels[k] for k in (*order, order[0])]
