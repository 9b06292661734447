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
from app.view.floor_height import layer_below
from app.view.model.picking import SurfaceLookup, first_voxel, nearest_viewpoint, seen_from
from app.view.model.picture_store import StoredPicture
from app.view.model.scene_model import SceneModel
from app.view.model.voxel_pictures import SEEN_M, pictures_showing
from app.view.words import ENGLISH, Words
from ippon.geometry import Float64Array, make_transform, rotation_y
from ippon.guidance.levels import Level
from ippon.planning.plan import NodeKind, TreeView

PICTURES: Final = 3
_MARK_PX: Final = 5


class ShownPicture(msgspec.Struct, frozen=True, kw_only=True):
    """One picture on the explanation card."""

    name: str
    caption: str


class ClickExplanation(msgspec.Struct, frozen=True, kw_only=True):
    """Content of the explanation card; all texts are plain text."""

    number: int = 0
    """Of the question: a card that was closed opens for the next one."""
    title: str = ""
    thing: str = ""
    """The remembered thing that is explained; empty for a surface or viewpoint."""
    rows: list[tuple[str, str]] = []
    pictures: list[ShownPicture] = []
    note: str = ""


Show = Callable[[str, bytes], None]


class ExplanationBuilder:
    """Builds explanations from the scene model; called by the scene thread."""

    def __init__(self, model: SceneModel, show: Show, say: Words = ENGLISH) -> None:
        self._words = say
        self._model = model
        self._show = show

    def explain(
        self, origin: Float64Array, direction: Float64Array, ceiling_m: float | None
    ) -> tuple[ClickExplanation, Highlight, tuple[float, float, float] | None]:
        """Explain the first viewpoint or voxel on a ray.

        Returns:
            The explanation, the highlight, and the voxel to ask the navigator about, or None.
        """
        model, size, say = self._model, self._model.voxel_size_m, self._words
        if size is None:
            empty = ClickExplanation(title=say("click.empty"), note=say("click.empty.note"))
            return empty, NOTHING, None
        below = None if ceiling_m is None else layer_below(ceiling_m, model.floor_z_m, size)
        lookup = SurfaceLookup(model.voxels, below)
        voxel = first_voxel(origin, direction, size, lookup)
        bead = None if model.tree is None else self._bead(origin, direction, model.tree)
        if model.tree is not None and bead is not None and (voxel is None or bead[1] < voxel[1]):
            return (*self._viewpoint(model.tree, bead[0], size), None)
        if voxel is None:
            nothing = ClickExplanation(title=say("click.nothing"), note=say("click.nothing.note"))
            return nothing, NOTHING, None
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
        say, number = self._words, self._words.number
        level = say(f"panel.level.{Level(int(tree.levels[node])).text}")
        yaw_deg, tilt_deg = (
            math.degrees(float(angles[node])) for angles in (tree.yaws_rad, tree.tilts_rad)
        )
        rows = [
            (say("click.gain"), say("click.gain.value", n=number(tree.gains[node], 1))),
            (say("click.cost"), say("click.cost.value", n=number(tree.path_costs_s[node], 1))),
            (say("click.rate"), number(tree.gains[node] / (tree.path_costs_s[node] + 1.0), 2)),
            (say("click.level"), say("click.level.value", level=level)),
            (say("click.voxels"), say("click.voxels.value", n=number(tree.terminations[node]))),
            (
                say("click.looks"),
                say("click.looks.value", yaw=f"{yaw_deg:.0f}", tilt=f"{tilt_deg:.0f}"),
            ),
            (say("click.sees"), say("click.sees.value", n=len(seen))),
        ]
        title = say("click.robot" if node == 0 else f"click.viewpoint.{kind.name.lower()}")
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
        say = self._words
        x, y, z = (say.number(v, 2) for v in point)
        explanation = ClickExplanation(
            title=say("click.surface"),
            rows=[(say("click.where"), say("click.where.value", x=x, y=y, z=z))],
            pictures=pictures,
            note="" if pictures else say("click.unpictured"),
        )
        return explanation, Highlight(seen=NOTHING.seen, at=point, voxel_size_m=size), point

    def _pictures(
        self, voxel: tuple[int, int, int], size: float, lookup: SurfaceLookup
    ) -> list[ShownPicture]:
        shown: list[ShownPicture] = []
        for seen in islice(pictures_showing(self._model.pictures, voxel, size, lookup), PICTURES):
            name = f"{seen.picture.number}-{seen.u}-{seen.v}"
            self._show(name, marked(seen.picture, seen.u, seen.v))
            caption = self._words("click.picture", m=self._words.number(seen.depth_m, 1))
            shown.append(ShownPicture(name=name, caption=caption))
        return shown


def of_thing(
    explanation: ClickExplanation, thing: str, share: float | None, say: Words
) -> ClickExplanation:
    """Put what is remembered of a thing before what the map says of its surface.

    Args:
        explanation: Of the surface.
        thing: What the page calls the thing; empty changes nothing.
        share: Probability that it is of its kind; None for a thing of no kind.
        say: Words of the page.
    """
    if not thing:
        return explanation
    known = [] if share is None else [(thing, say.percent(share, 1))]
    return msgspec.structs.replace(
        explanation, title=_title(thing), thing=thing, rows=[*known, *explanation.rows]
    )


def with_labels(
    explanation: ClickExplanation, reply: InspectReply, wanted: str, say: Words
) -> ClickExplanation:
    """Add the navigator's reply about a voxel."""
    rows: list[tuple[str, str]] = []
    if reply.ooi is not None and wanted and wanted != explanation.thing:
        rows.append((wanted, say.percent(reply.ooi, 1)))
    rows += [(say.name(share.label), say.percent(share.probability, 1)) for share in reply.labels]
    title = say("click.surface") if not reply.labels else say.name(reply.labels[0].label)
    level = [] if reply.level is None else [(say("click.level"), say(f"panel.level.{reply.level}"))]
    room = [(say("click.room"), say.room(reply.room))] if reply.room else []
    unknown = [] if rows else [(say("click.labels"), say("click.unclassified"))]
    first: list[tuple[str, str]] = []
    if explanation.thing:
        # What is remembered of the thing stays first; the surface's labels follow.
        title = explanation.thing
        first = [row for row in explanation.rows[:1] if row[0] == title]
        rows = [row for row in rows if row[0] != title]
    return msgspec.structs.replace(
        explanation,
        title=_title(title),
        rows=[*first, *rows, *unknown, *level, *room, *explanation.rows[len(first) :]],
    )


def _title(name: str) -> str:
    return name[:1].upper() + name[1:]


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
