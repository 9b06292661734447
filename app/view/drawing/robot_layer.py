"""The robot in the scene: body, camera with its live picture, trail and path."""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.messages.body import BodyProfile
from app.view.colors import PATH, ROBOT, linear
from app.view.drawing.line_segments import draw_segments
from app.view.drawing.robot_body import body_mesh
from app.view.drawing.viser_private import show_jpeg_in_frustum
from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array, quaternion_from_rotation

FRUSTUM_M: Final = 0.6
"""Distance of the image plane from the camera."""

_BODY_RADIUS_M: Final = 0.24
_BODY_HEIGHT_M: Final = 0.22
_MAST_RADIUS_M: Final = 0.035
_PATH: Final = linear(np.array(PATH, dtype=np.uint8))
_DARK: Final = (0x1B, 0x24, 0x2E)
_LIFT_M: Final = 0.06
"""Height of trail and path above the floor voxels."""
_CHEVRON_EVERY_M: Final = 1.2
_CHEVRON_M: Final = 0.16
_TRAIL: Final = 4000
"""Points of the trail that are drawn."""
_TAIL: Final = 100
"""Points after which the whole trail is sent again; what is newer is a line of its own."""


class RobotLayer:
    """Draws the robot under fixed node names."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._body: Any = None
        self._mast: Any = None
        self._drawn: BodyProfile | None = None
        """The body that is drawn; None for that of a robot whose body is not known."""
        self._top_m = _BODY_HEIGHT_M
        """Height of the body that is drawn."""
        self._frustum: Any = None
        self._frustum_camera: PinholeCamera | None = None
        self._path: Any = None
        self._goal: Any = None
        self._trail: Any = None
        self._tail: Any = None
        self._sent: tuple[int, tuple[float, float, float] | None] = (0, None)
        """Points of the trail when it was sent as a whole, and the last one of them."""

    def draw_pose(
        self,
        T_world_base: Float64Array | None,
        T_world_camera: Float64Array | None,
        profile: BodyProfile | None = None,
    ) -> None:
        """Move body and camera.

        Args:
            T_world_base: (4, 4) pose of the base; None draws nothing.
            T_world_camera: (4, 4) pose of the camera; None leaves it where it is.
            profile: The robot's own body; None draws a disc.
        """
        if T_world_base is None:
            return
        if self._body is None or profile != self._drawn:
            self._body = self._make_body(profile)
        self._body.position = T_world_base[:3, 3]
        self._body.wxyz = quaternion_from_rotation(T_world_base[:3, :3])
        if T_world_camera is None:
            return
        height = float(T_world_camera[2, 3] - T_world_base[2, 3])
        if self._mast is None and height > self._top_m:
            self._make_mast(height)
        if self._frustum is not None:
            self._frustum.position = T_world_camera[:3, 3]
            self._frustum.wxyz = quaternion_from_rotation(T_world_camera[:3, :3])

    def draw_camera(self, camera: PinholeCamera, visible: bool) -> None:
        """Draw the camera frustum from the intrinsics."""
        if self._frustum is None:
            self._frustum = self._scene.add_camera_frustum(
                "/camera",
                fov=camera.vertical_fov,
                aspect=camera.width / camera.height,
                scale=FRUSTUM_M,
                thickness=0.014,
                color=ROBOT,
                format="jpeg",
                cast_shadow=False,
                receive_shadow=False,
            )
        elif camera != self._frustum_camera:
            self._frustum.fov = camera.vertical_fov
            self._frustum.aspect = camera.width / camera.height
        self._frustum_camera = camera
        self._frustum.visible = visible

    def draw_image(self, jpeg: bytes) -> None:
        """Show the latest image in the frustum."""
        if self._frustum is not None and jpeg.startswith(b"\xff\xd8"):
            show_jpeg_in_frustum(self._frustum, jpeg)

    def draw_path(self, path_world: Float64Array, visible: bool) -> None:
        """Draw the path with a ring at its end."""
        shown = visible and len(path_world) > 1
        if not shown:
            for handle in (self._path, self._goal):
                if handle is not None:
                    handle.visible = False
            return
        lifted = path_world.astype(np.float32) + np.array([0.0, 0.0, 2 * _LIFT_M], np.float32)
        segments = np.stack([lifted[:-1], lifted[1:]], axis=1)
        ring = _ring(lifted[-1], 0.22)
        self._path = draw_segments(self._scene, self._path, "/path/line", segments, _PATH, 0.05)
        self._goal = draw_segments(self._scene, self._goal, "/path/goal", ring, _PATH, 0.035)

    def draw_trail(self, trail_world: list[tuple[float, float, float]], visible: bool) -> None:
        """Draw the trail, fading with age, with chevrons in the direction of travel."""
        if not visible or len(trail_world) < 2:
            for handle in (self._trail, self._tail):
                if handle is not None:
                    handle.visible = False
            self._sent = (0, None)
            return
        n, last = self._sent
        grows = 0 < n <= len(trail_world) <= n + _TAIL and trail_world[n - 1] == last
        if not grows:
            n = len(trail_world)
            self._sent = (n, trail_world[-1])
            self._trail = self._line(self._trail, "/trail/line", trail_world[-_TRAIL:], 0.5)
        if n < len(trail_world):
            self._tail = self._line(self._tail, "/trail/tail", trail_world[n - 1 :], 1.0)
        elif self._tail is not None:
            self._tail.visible = False

    def _line(
        self, handle: Any, name: str, trail: list[tuple[float, float, float]], oldest: float
    ) -> Any:
        """Draw a part of the trail, whose first point has a share of the brightness."""
        points = np.array(trail, dtype=np.float32)
        points[:, 2] += _LIFT_M
        lines = np.stack([points[:-1], points[1:]], axis=1)
        age = np.linspace(oldest, 1.0, len(lines), dtype=np.float32)
        chevrons, at = _chevrons(points)
        segments = np.concatenate([lines, chevrons])
        fade = np.concatenate([age, age[at]])
        colors = (np.array(ROBOT, dtype=np.float32) * fade[:, None]).astype(np.uint8)
        shaped = linear(np.repeat(colors[:, None, :], 2, axis=1))
        return draw_segments(self._scene, handle, name, segments, shaped, 0.035)

    def _make_body(self, profile: BodyProfile | None) -> Any:
        scene = self._scene
        # A node of the same name replaces the one before with all that is on it.
        body = scene.add_frame("/robot", show_axes=False)
        self._drawn, self._mast = profile, None
        if profile is None:
            self._top_m = _BODY_HEIGHT_M
            scene.add_cylinder(
                "/robot/base",
                radius=_BODY_RADIUS_M,
                height=_BODY_HEIGHT_M,
                color=ROBOT,
                position=(0.0, 0.0, 0.5 * _BODY_HEIGHT_M + 0.04),
            )
            top = _BODY_HEIGHT_M + 0.045
        else:
            top = self._top_m = max(one.z_m + one.radius_m for one in profile.spheres)
            vertices, faces = body_mesh(profile.spheres)
            scene.add_mesh_simple("/robot/base", vertices, faces, color=ROBOT)
        arrow = np.array(
            [[0.21, 0.0, top], [-0.12, 0.13, top], [-0.06, 0.0, top], [-0.12, -0.13, top]],
            dtype=np.float32,
        )
        scene.add_mesh_simple(
            "/robot/heading",
            arrow,
            np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32),
            color=_DARK,
            side="double",
        )
        return body

    def _make_mast(self, height_m: float) -> None:
        self._mast = self._scene.add_cylinder(
            "/robot/mast",
            radius=_MAST_RADIUS_M,
            height=height_m - self._top_m,
            color=ROBOT,
            position=(0.0, 0.0, 0.5 * (height_m + self._top_m)),
        )


def _ring(center: NDArray[np.float32], radius_m: float) -> NDArray[np.float32]:
    angles = np.linspace(0.0, 2.0 * math.pi, 25)
    points = np.stack(
        [radius_m * np.cos(angles), radius_m * np.sin(angles), np.zeros_like(angles)], axis=1
    )
    points = (points + center).astype(np.float32)
    return np.stack([points[:-1], points[1:]], axis=1)


def _chevrons(points: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Return (2 C, 2, 3) strokes of C chevrons along a trail, and (2 C,) their indices in it."""
    steps = np.diff(points[:, :2], axis=0)
    marks = np.floor(np.cumsum(np.hypot(steps[:, 0], steps[:, 1])) / _CHEVRON_EVERY_M)
    at = np.flatnonzero(np.diff(marks) > 0) + 1
    # Direction over several steps, because single steps are noisy.
    course = points[np.minimum(at + 3, len(points) - 1), :2] - points[np.maximum(at - 3, 0), :2]
    length = np.hypot(course[:, 0], course[:, 1])
    moved = length > 0.5 * _CHEVRON_M
    at = at[moved]
    if not len(at):
        return np.empty((0, 2, 3), np.float32), np.empty(0, np.int64)
    ahead = course[moved] / length[moved, None]
    side = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    tip = points[at + 1]
    strokes = []
    for sign in (-1.0, 1.0):
        tail = tip.copy()
        tail[:, :2] += _CHEVRON_M * (-ahead + np.float32(0.8 * sign) * side)
        strokes.append(np.stack([tail, tip], axis=1))
    return np.concatenate(strokes), np.concatenate([at, at])
