"""Explains a clicked viewpoint or surface: its values in map and plan, and images of it."""

import math
from collections.abc import Callable, Sequence
from itertools import islice
from typing import Final

import msgspec
import numpy as np
import simplejpeg

from app.messages.cdr import MessageError
from app.messages.control import InspectReply
from app.messages.images import decompress_color
from app.view.colors import CERTAIN_BRUSH
from app.view.drawing.overlay_layer import NOTHING, Highlight
from app.view.drawing.tree_layer import HEIGHT_M
from app.view.model.picking import SurfaceLookup, first_voxel, nearest_viewpoint, seen_from
from app.view.model.picture_store import StoredPicture
from app.view.model.scene_model import SceneModel
from app.view.model.voxel_pictures import SEEN_M, pictures_showing
from ippon.geometry import Float64Array, make_transform, rotation_y
from ippon.guidance.levels import Level
from ippon.planning.plan import NodeKind, TreeView

PICTURES: Final = 3
_MARK_PX: Final = 5
KIND_WORDS: Final = {
    NodeKind.EXPLORING: "explores",
    NodeKind.MINIMAL: "low gain",
    NodeKind.TERMINATING: "can end the search",
}


class ShownPicture(msgspec.Struct, frozen=True, kw_only=True):
    """One picture on the explanation card."""

    name: str
    caption: str


class ClickExplanation(msgspec.Struct, frozen=True, kw_only=True):
    """Content of the explanation card; all texts are plain text."""

    title: str = ""
    rows: list[tuple[str, str]] = []
    pictures: list[ShownPicture] = []
    note: str = ""


Inspect = Callable[[tuple[float, float, float]], InspectReply]
Show = Callable[[str, bytes], None]


class ExplanationBuilder:
    """Builds explanations from the scene model; called by the scene thread."""

    def __init__(self, model: SceneModel, show: Show) -> None:
        self._model = model
        self._show = show

    def explain(
        self, origin: Float64Array, direction: Float64Array, ceiling_m: float | None
    ) -> tuple[ClickExplanation, Highlight, tuple[float, float, float] | None]:
        """Explain the first viewpoint or voxel on a ray.

        Returns:
            The explanation, the highlight, and the voxel to ask the navigator about, or None.
        """
        model, size = self._model, self._model.voxel_size_m
        if size is None:
            return (
                ClickExplanation(title="Nothing here yet", note="The map is empty."),
                NOTHING,
                None,
            )
        below = None if ceiling_m is None else round(ceiling_m / size)
        lookup = SurfaceLookup(model.voxels, below)
        voxel = first_voxel(origin, direction, size, lookup)
        bead = None if model.tree is None else self._bead(origin, direction, model.tree)
        if model.tree is not None and bead is not None and (voxel is None or bead[1] < voxel[1]):
            return (*self._viewpoint(model.tree, bead[0], size), None)
        if voxel is None:
            note = "Click a surface of the map, or the sphere of a viewpoint."
            return ClickExplanation(title="Nothing there", note=note), NOTHING, None
        return self._voxel(voxel[0], size, lookup)

    def _bead(
        self, origin: Float64Array, direction: Float64Array, tree: TreeView
    ) -> tuple[int, float] | None:
        lift = np.array([0.0, 0.0, HEIGHT_M])
        return nearest_viewpoint(origin, direction, tree.positions_world + lift)

    def _viewpoint(
        self, tree: TreeView, node: int, size: float
    ) -> tuple[ClickExplanation, Highlight]:
        x, y, z = (float(v) for v in tree.positions_world[node])
        seen = self._seen_from(tree, node, size)
        kind = NodeKind(int(tree.kinds[node]))
        level = Level(int(tree.levels[node])).text
        yaw_deg, tilt_deg = (
            math.degrees(float(angles[node])) for angles in (tree.yaws_rad, tree.tilts_rad)
        )
        rows = [
            ("Gain", f"{tree.gains[node]:.1f} expected object voxels"),
            ("Cost", f"{tree.path_costs_s[node]:.1f} s to drive there"),
            ("Gain per second", f"{tree.gains[node] / (tree.path_costs_s[node] + 1.0):.2f}"),
            ("Level", f"{level}: weight of unseen space there"),
            (
                "Object voxels",
                f"{tree.terminations[node]:.0f} visible from close by",
            ),
            ("Looks", f"to {yaw_deg:.0f}°, tilt {tilt_deg:.0f}°"),
            ("Sees", f"{len(seen)} surface voxels, highlighted in the scene"),
        ]
        title = "The robot" if node == 0 else f"Viewpoint: {KIND_WORDS[kind]}"
        at = (x, y, z + HEIGHT_M)
        return (
            ClickExplanation(title=title, rows=rows[5:] if node == 0 else rows),
            Highlight(seen=seen, at=at, voxel_size_m=size),
        )

    def _seen_from(self, tree: TreeView, node: int, size: float):
        camera, base = self._model.camera, self._model.T_world_base
        mounted = self._model.T_world_camera
        if camera is None or base is None or mounted is None:
            return NOTHING.seen
        height = float(mounted[2, 3] - base[2, 3])
        yaw, tilt = float(tree.yaws_rad[node]), float(tree.tilts_rad[node])
        c, s = math.cos(yaw), math.sin(yaw)
        heading = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        level = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
        position = tree.positions_world[node].astype(np.float64)
        position[2] += height
        T_world_camera = make_transform(heading @ rotation_y(-tilt) @ level, position)
        half = (0.5 * camera.width / camera.fx, 0.5 * camera.height / camera.fy)
        return seen_from(self._model.voxels, size, T_world_camera, half, SEEN_M)

    def _voxel(
        self, voxel: tuple[int, int, int], size: float, lookup: SurfaceLookup
    ) -> tuple[ClickExplanation, Highlight, tuple[float, float, float]]:
        center = (np.array(voxel) + 0.5) * size
        point = (float(center[0]), float(center[1]), float(center[2]))
        pictures = self._pictures(voxel, size, lookup)
        explanation = ClickExplanation(
            title="Surface",
            rows=[("Where", f"{point[0]:.2f}, {point[1]:.2f}, height {point[2]:.2f} m")],
            pictures=pictures,
            note="" if pictures else "No stored image shows it.",
        )
        return explanation, Highlight(seen=NOTHING.seen, at=point, voxel_size_m=size), point

    def _pictures(
        self, voxel: tuple[int, int, int], size: float, lookup: SurfaceLookup
    ) -> list[ShownPicture]:
        shown: list[ShownPicture] = []
        for seen in islice(pictures_showing(self._model.pictures, voxel, size, lookup), PICTURES):
            name = f"{seen.picture.number}-{seen.u}-{seen.v}"
            self._show(name, marked(seen.picture, seen.u, seen.v))
            shown.append(ShownPicture(name=name, caption=f"from {seen.depth_m:.1f} m"))
        return shown


def with_labels(
    explanation: ClickExplanation, reply: InspectReply, wanted: str
) -> ClickExplanation:
    """Add the navigator's reply about a voxel."""
    rows: list[tuple[str, str]] = []
    if reply.ooi is not None and wanted:
        rows.append((wanted, f"{reply.ooi:.1%}"))
    rows += [(share.label.replace("_", " "), f"{share.probability:.1%}") for share in reply.labels]
    title = "Surface" if not reply.labels else reply.labels[0].label.replace("_", " ")
    level = [("Level", reply.level)] if reply.level is not None else []
    room = [("Room", reply.room)] if reply.room else []
    unknown = [] if rows else [("Labels", "not classified yet")]
    return msgspec.structs.replace(
        explanation,
        title=title.capitalize(),
        rows=[*rows, *unknown, *level, *room, *explanation.rows],
    )


def marked(picture: StoredPicture, u: int, v: int) -> bytes:
    """Return a picture as JPEG with a square around a pixel."""
    try:
        image = decompress_color(picture.encoded).copy()
    except MessageError:
        return picture.encoded
    _square(image, u, v, CERTAIN_BRUSH)
    return simplejpeg.encode_jpeg(image, quality=80, colorspace="RGB")


def _square(image: np.ndarray, u: int, v: int, color: Sequence[int]) -> None:
    height, width = image.shape[:2]
    far = max(6, width // 24)
    for half in range(far, far + max(2, _MARK_PX // 2)):
        top, bottom = max(v - half, 0), min(v + half, height - 1)
        left, right = max(u - half, 0), min(u + half, width - 1)
        image[top, left : right + 1] = color
        image[bottom, left : right + 1] = color
        image[top : bottom + 1, left] = color
        image[top : bottom + 1, right] = color
