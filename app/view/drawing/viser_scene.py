"""Draws the scene model with viser: only changes, under fixed node names."""

import math
import time
from dataclasses import replace
from typing import Any, Final

from app.view.drawing.derived_layers import DerivedLayers
from app.view.drawing.find_layer import (
    APART_M,
    FindLayer,
    ObjectMark,
    found_before,
    marks_of,
    places_of,
)
from app.view.drawing.overlay_layer import OverlayLayer
from app.view.drawing.robot_layer import RobotLayer
from app.view.drawing.tree_layer import TreeLayer
from app.view.drawing.voxel_layer import LEAST_CONFIDENCE, VoxelLayer
from app.view.model.scene_model import Part, SceneModel
from app.view.view_options import ViewOptions
from app.view.words import ENGLISH, Words
from ippon.geometry import Float64Array

NAMES_SHARE: Final = 0.2
"""Least distance between two names, as a share of the longer side of the map."""
GAINS_S: Final = 2.0
"""Minimum interval from the end of a recolouring of the map, by gain or kind, to the next one."""
ROOTS: Final = (
    "/map", "/object_voxels", "/skin", "/clearance", "/tree", "/path", "/trail", "/camera",
    "/robot", "/finds", "/painted", "/far_evidence", "/pointed",
)  # fmt: skip
"""Root of every node of the drawing, except lights and floor."""
Rgb = tuple[int, int, int]
DARK_FLOOR: Final[tuple[Rgb, Rgb]] = ((56, 64, 76), (72, 82, 98))
"""Lines of the floor every 0.5 m and every 2 m, little lighter than the dark theme's ground."""
LIGHT_FLOOR: Final[tuple[Rgb, Rgb]] = ((176, 185, 195), (188, 196, 205))
"""The same for the light theme, where dark lines would compete with the map."""
ALL_PARTS: Final[frozenset[Part]] = frozenset(
    {
        "voxels",
        "tree",
        "path",
        "pose",
        "camera",
        "image",
        "status",
        "detections",
        "painted",
        "far_evidence",
    }
)


def add_floor(scene: Any, colors: tuple[Rgb, Rgb], floor_z_m: float) -> Any:
    """Draw the floor's grid, or draw it anew; return its handle.

    Args:
        scene: That of the server, for all, or of a client, for it alone.
        colors: Of the lines every 0.5 m and every 2 m.
        floor_z_m: Height of the floor.
    """
    return scene.add_grid(
        "/floor",
        width=40.0,
        height=40.0,
        cell_size=0.5,
        section_size=2.0,
        cell_color=colors[0],
        section_color=colors[1],
        infinite_grid=True,
        fade_distance=30.0,
        position=_grid_at(floor_z_m),
    )


def _grid_at(floor_z_m: float) -> tuple[float, float, float]:
    return 0.0, 0.0, floor_z_m - 0.06


class ViserScene:
    """Draws one `SceneModel` into one viser server, for all browsers, or into one client's scene.

    Args:
        server: The server, the client, or a `Subtree` of either.
        say: The words of the names.
    """

    def __init__(self, server: Any, say: Words = ENGLISH) -> None:
        self._server = server
        self._words = say
        scene = server.scene
        self.voxels = VoxelLayer(scene)
        self._tree = TreeLayer(scene)
        self._robot = RobotLayer(scene)
        self._finds = FindLayer(scene)
        self._derived = DerivedLayers(scene)
        self.overlay = OverlayLayer(scene)
        self._options: ViewOptions | None = None
        self._gains_at = -math.inf
        self._floor_z_m = 0.0
        self._revision = 0
        """Size of the drawn voxels."""
        # The default environment map keeps the scene dim until it is decoded.
        scene.configure_environment_map(hdri=None)
        scene.configure_default_lights(enabled=False)
        scene.add_light_ambient("/lights/all_round", color=(255, 255, 255), intensity=1.6)
        scene.add_light_directional(
            "/lights/sun", color=(255, 250, 240), intensity=2.2, position=(-2.0, -3.0, 5.0)
        )
        self._grid = add_floor(scene, DARK_FLOOR, self._floor_z_m)
        """None beneath another drawing, which has it."""

    def draw(self, model: SceneModel, changed: frozenset[Part], options: ViewOptions) -> None:
        """Draw the changes since the last call, in one batch."""
        if options != self._options:
            changed |= ALL_PARTS
            self._options = options
            self._gains_at = -math.inf
            self._derived.restart()
        recolored = self._recolored(model, changed, options)
        changed |= recolored
        floor_z_m = model.floor_z_m
        layers = options.layers
        with self._server.atomic():
            if floor_z_m != self._floor_z_m:
                self._floor_z_m = floor_z_m
                self._derived.restart()
                if self._grid is not None:
                    # Browsers with a grid of their own colours get the height, too.
                    self._grid.position = _grid_at(floor_z_m)
            if "voxels" in changed and model.voxel_size_m is not None:
                dirty, self._revision = model.voxels.changed_since(self._revision)
                # The mesh coincides with the voxels: drawing both would flicker.
                bare = replace(options, layers=layers - {"map"}) if "mesh" in layers else options
                self.voxels.draw(model.voxels, model.voxel_size_m, dirty, bare, floor_z_m)
                self._derived.draw(
                    model.voxels,
                    model.voxel_size_m,
                    options.ceiling_m,
                    frozenset(layers),
                    floor_z_m,
                )
            if "tree" in changed:
                self._tree.draw(model.tree, "tree" in layers)
            if "path" in changed:
                self._robot.draw_path(model.path_world, "path" in layers)
            if changed & {"camera", "pose", "image"}:
                self._draw_robot(model, changed, options)
            if "painted" in changed:
                self.overlay.draw_painted(model.painted, floor_z_m)
            if "far_evidence" in changed:
                places = model.far_evidence.cells if "far_evidence" in layers else []
                self.overlay.draw_far_evidence(places, model.far_evidence.cell_m, floor_z_m)
            if changed & {"status", "detections"}:
                marks = _marks(model, self._words, self._apart_m())
                self._finds.draw(marks, "finds" in layers, "labels" in layers)
        if recolored:
            self._gains_at = time.monotonic()

    def _recolored(
        self, model: SceneModel, changed: frozenset[Part], options: ViewOptions
    ) -> frozenset[Part]:
        """Update the map's gain colours at intervals, because they change the whole map."""
        now = time.monotonic()
        if options.mode == "thing" and options.thing is None:
            return self._recolored_kinds(model, changed, now)
        if options.mode != "gain" or model.tree is None or now - self._gains_at < GAINS_S:
            return frozenset()
        if "tree" not in changed:
            return frozenset()
        self.voxels.set_gains(model.tree.positions_world[:, :2], model.tree.gains)
        self._revision = 0
        return frozenset({"voxels"})

    def _recolored_kinds(
        self, model: SceneModel, changed: frozenset[Part], now: float
    ) -> frozenset[Part]:
        """Give labels their colours at intervals; a new colour changes the whole map."""
        if "voxels" not in changed or now - self._gains_at < GAINS_S:
            return frozenset()
        self._gains_at = now
        if model.proximity is not None:
            labels = [row.label for row in model.proximity.rows]
            model.label_colors.update(labels, model.voxels.label_counts(LEAST_CONFIDENCE))
        if model.label_colors.table is self.voxels.kinds:
            return frozenset()
        self.voxels.kinds = model.label_colors.table
        self._revision = 0
        return frozenset({"voxels"})

    def bounds(self) -> tuple[Float64Array, Float64Array] | None:
        """Return the least and greatest (x, y) of the drawn map in metres; None without one."""
        return self.voxels.bounds()

    def _apart_m(self) -> float:
        """Return the least distance between names: they keep their size when the map is small."""
        ends = self.bounds()
        return (
            APART_M
            if ends is None
            else max(APART_M, NAMES_SHARE * float((ends[1] - ends[0]).max()))
        )

    def _draw_robot(
        self, model: SceneModel, changed: frozenset[Part], options: ViewOptions
    ) -> None:
        layers = options.layers
        if "camera" in changed and model.camera is not None:
            self._robot.draw_camera(model.camera, "camera" in layers)
        if changed & {"camera", "pose"}:
            self._robot.draw_pose(model.T_world_base, model.T_world_camera, model.body)
        if "pose" in changed:
            self._robot.draw_trail(model.trail_world, "trail" in layers)
        if changed & {"camera", "image"} and model.image is not None and "camera" in layers:
            self._robot.draw_image(model.image.encoded)


def _marks(model: SceneModel, say: Words, apart_m: float) -> tuple[ObjectMark, ...]:
    status = model.status
    if status is None:
        return marks_of(None, model.detections, model.rejected, say, apart_m=apart_m)
    before = found_before(status, say)
    if status.state == "exhausted":
        return (*before, *places_of(model.candidates(), say))
    find, places, rejected = status.find, model.detections, model.rejected
    return (*before, *marks_of(find, places, rejected, say, before=before, apart_m=apart_m))
