"""Draws the scene of a robot into a Rerun recording."""

from typing import Any, Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from app.messages import keys
from app.messages.depth.depth_images import decode_depth_raw, depth_png, encode_depth
from app.messages.status import Event, Status
from app.nodes.viewers.live_robot import clock_ns
from app.view.colors import FOUND, ORANGE, PATH, ROBOT, node_colors
from app.view.drawing.find_layer import marks_of
from app.view.drawing.tree_layer import HEIGHT_M
from app.view.floor_height import layer_below
from app.view.model.attribute_colors import AttributeColor, attribute_colors
from app.view.model.scene_model import Part, SceneModel
from app.view.model.voxel_store import COLUMN, Column
from ippon.geometry import Float64Array
from ippon.vocabulary import in_words

TIMELINE: Final = "robot_time"
CLOUDS: Final[dict[str, AttributeColor]] = {
    "world/map/probability": "ooi",
    "world/map/proximity": "proximity",
    "world/map/colors": "camera",
}
CAMERA: Final = "world/camera"
COLOR: Final = f"{CAMERA}/color"
DEPTH: Final = f"{CAMERA}/depth"
ROBOT_BODY: Final = "world/robot"
TRAIL: Final = "world/trail"
TREE: Final = "world/plan/tree"
VIEWPOINTS: Final = "world/plan/viewpoints"
PLAN_PATH: Final = "world/plan/path"
FINDS: Final = "world/finds"
STATUS: Final = "status"
LOG: Final = "log"
FIGURES: Final = {
    "search/best_match": "best_ooi",
    "search/explored_m2": "explored_m2",
    "search/path_m": "path_length_m",
}
"""Plots, and the fields of the status that they show."""

_SINCE_1970_NS: Final = 1_000_000_000_000_000_000
"""Stamps above it count nanoseconds since 1970; those of a simulation begin at 0."""
_WARNINGS: Final = frozenset({"contact", "stream_lost", "bad_message", "map_full"})
_VIEWPOINT_M: Final = 0.07
_EDGE: Final = (148, 156, 168)
_SHADE: Final = 0.3
_PIECE: Final = 256
"""Points of the trail that are sent together."""


class RerunScene:
    """One recording; a scene is drawn into it as far as it changed since the last call."""

    def __init__(
        self, stream: rr.RecordingStream, ceiling_m: float, after: Event | None = None
    ) -> None:
        """Begin a recording.

        Args:
            stream: Where it goes.
            ceiling_m: Height above the robot's floor from which no voxel is drawn.
            after: Last event before the robot's clock began again; it and earlier ones are not
                drawn.
        """
        self._stream = stream
        self._ceiling_m = ceiling_m
        self._revision = 0
        self._body: Any = None
        self._last_event = after
        self._trail_drawn = 0
        """Points of the trail that were drawn."""
        stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    def draw(self, scene: SceneModel, changed: frozenset[Part]) -> None:
        """Draw everything that changed but map and trail."""
        self._at(clock_ns(scene))
        if "pose" in changed:
            self._draw_poses(scene)
        if "camera" in changed and scene.camera is not None:
            camera = scene.camera
            pinhole = rr.Pinhole(
                focal_length=(camera.fx, camera.fy),
                principal_point=(camera.cx, camera.cy),
                resolution=(camera.width, camera.height),
                camera_xyz=rr.ViewCoordinates.RDF,
                image_plane_distance=0.5,
            )
            # It may come before the robot's clock is known, and does not come again.
            self._stream.log(CAMERA, pinhole, static=True)
        if "tree" in changed:
            self._draw_tree(scene)
        if "path" in changed:
            self._log_line(PLAN_PATH, scene.path_world, PATH, 0.03)
        if "detections" in changed or "status" in changed:
            self._draw_finds(scene)
        if "status" in changed and scene.status is not None:
            self._draw_status(scene.status)
        if "events" in changed:
            self._draw_events(scene)
        if "image" in changed and scene.image is not None:
            self._at(scene.image.stamp_ns)
            encoded = scene.image.encoded
            kind = "image/jpeg" if encoded.startswith(b"\xff\xd8") else "image/png"
            self._stream.log(COLOR, rr.EncodedImage(contents=encoded, media_type=kind))

    def draw_map(self, scene: SceneModel) -> None:
        """Draw the trail, and the columns of the map that changed: 16 x 16 voxels each."""
        self._at(clock_ns(scene))
        self._draw_trail(scene.trail_world)
        voxel_m = scene.voxel_size_m
        if voxel_m is None:
            return
        columns, self._revision = scene.voxels.changed_since(self._revision)
        for column in columns:
            self._draw_column(scene, column, voxel_m)

    def draw_depth(self, key: str, payload: bytes) -> None:
        """Draw a depth image, compressed or not.

        Raises:
            MessageError: It cannot be decoded.
        """
        if key == keys.DEPTH_RAW:
            image = decode_depth_raw(payload)
            payload = encode_depth(image.depth, image.stamp_ns, image.frame_id)
        stamp_ns, _, png = depth_png(payload)
        self._at(stamp_ns)
        self._stream.log(DEPTH, rr.EncodedDepthImage(png, media_type="image/png", meter=1000.0))

    def write_line(self, text: str, level: str) -> None:
        """Append a line to the log."""
        self._stream.log(LOG, rr.TextLog(text, level=level))

    def _at(self, stamp_ns: int) -> None:
        if stamp_ns == 0:
            # A navigator has no time before its first frame: what is drawn is of the time before.
            return
        if stamp_ns > _SINCE_1970_NS:
            self._stream.set_time(TIMELINE, timestamp=np.datetime64(stamp_ns, "ns"))
        else:
            self._stream.set_time(TIMELINE, duration=np.timedelta64(stamp_ns, "ns"))

    def _draw_poses(self, scene: SceneModel) -> None:
        if scene.T_world_base is not None:
            self._stream.log(ROBOT_BODY, _transform(scene.T_world_base))
        if scene.T_world_camera is not None:
            self._stream.log(CAMERA, _transform(scene.T_world_camera))
        if scene.body is not self._body and scene.body is not None:
            self._body = scene.body
            spheres = scene.body.spheres
            body = rr.Ellipsoids3D(
                centers=[(s.x_m, s.y_m, s.z_m) for s in spheres],
                radii=[s.radius_m for s in spheres],
                colors=ROBOT,
                fill_mode="solid",
            )
            self._stream.log(f"{ROBOT_BODY}/body", body, static=True)

    def _draw_trail(self, trail: list[tuple[float, float, float]]) -> None:
        """Draw the pieces of the trail that grew; all of one that was thinned or begins anew."""
        if len(trail) < self._trail_drawn:
            self._stream.log(TRAIL, rr.Clear(recursive=True))
            self._trail_drawn = 0
        if len(trail) == self._trail_drawn:
            return
        for start in range(max(self._trail_drawn - 1, 0) // _PIECE * _PIECE, len(trail), _PIECE):
            # Each ends where the next one begins.
            piece = np.array(trail[start : start + _PIECE + 1])
            self._log_line(f"{TRAIL}/{start // _PIECE}", piece, ROBOT, 0.015)
        self._trail_drawn = len(trail)

    def _draw_tree(self, scene: SceneModel) -> None:
        tree = scene.tree
        if tree is None:
            self._stream.log(TREE, rr.Clear(recursive=False))
            self._stream.log(VIEWPOINTS, rr.Clear(recursive=False))
            return
        positions = tree.positions_world + np.array([0.0, 0.0, HEIGHT_M], np.float32)
        child = np.flatnonzero(tree.parents >= 0)
        edges = np.stack([positions[tree.parents[child]], positions[child]], axis=1)
        self._stream.log(TREE, rr.LineStrips3D(edges, colors=_EDGE, radii=0.01))
        nodes = rr.Points3D(
            positions, colors=node_colors(tree.kinds, tree.gains), radii=_VIEWPOINT_M
        )
        self._stream.log(VIEWPOINTS, nodes)

    def _draw_finds(self, scene: SceneModel) -> None:
        report = None if scene.status is None else scene.status.find
        marks = marks_of(report, scene.detections, scene.rejected)
        boxes = rr.Boxes3D(
            centers=[mark.center_world for mark in marks],
            sizes=[mark.size_m for mark in marks],
            colors=[FOUND if mark.found else ORANGE for mark in marks],
            labels=[mark.text for mark in marks],
        )
        self._stream.log(FINDS, boxes)

    def _draw_status(self, status: Status) -> None:
        goal = "" if status.goal is None else f"**{in_words(status.goal.object)}**\n\n"
        text = f"{goal}{status.state}: {status.why}"
        self._stream.log(STATUS, rr.TextDocument(text, media_type="text/markdown"))
        for entity, field in FIGURES.items():
            self._stream.log(entity, rr.Scalars(float(getattr(status, field))))

    def _draw_events(self, scene: SceneModel) -> None:
        events = list(scene.events)
        last = next((n for n, e in enumerate(events) if e is self._last_event), -1)
        for event in events[last + 1 :]:
            self._at(event.stamp_ns)
            level = "WARN" if event.kind in _WARNINGS else "INFO"
            self.write_line(event.text, "ERROR" if event.kind == "error" else level)
        self._last_event = events[-1] if events else None

    def _draw_column(self, scene: SceneModel, column: Column, voxel_m: float) -> None:
        below = layer_below(self._ceiling_m, scene.floor_z_m, voxel_m)
        voxels = scene.voxels.column(column, below)
        corner = np.array([column[0] * COLUMN, column[1] * COLUMN, 0], np.int64)
        indices = voxels.local + corner
        centers = ((indices + 0.5) * voxel_m).astype(np.float32)
        light = 1.0 - _SHADE + _SHADE * (voxels.openness[:, None] / 255.0)
        for parent, mode in CLOUDS.items():
            colors = attribute_colors(indices, voxels.attributes, voxel_m, mode, scene.floor_z_m)
            points = rr.Points3D(
                centers, colors=(colors * light).astype(np.uint8), radii=0.5 * voxel_m
            )
            self._stream.log(f"{parent}/{column[0]}_{column[1]}", points)

    def _log_line(
        self, entity: str, points: NDArray[Any], color: tuple[int, int, int], radius_m: float
    ) -> None:
        strips = [points] if len(points) > 1 else []
        self._stream.log(entity, rr.LineStrips3D(strips, colors=color, radii=radius_m))


def _transform(T_parent_child: Float64Array) -> rr.Transform3D:
    return rr.Transform3D(translation=T_parent_child[:3, 3], mat3x3=T_parent_child[:3, :3])
