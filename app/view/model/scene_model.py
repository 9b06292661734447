"""State of the operator's view, updated by messages.

Live view and review update the same model, which uses neither sockets nor browser. One thread owns
it. Every message marks what it changed, so that only changes are drawn.
"""

import math
from collections import deque
from collections.abc import Iterable
from typing import Final, Literal

import numpy as np

from app.messages.body import BodyConfiguration, BodyProfile
from app.messages.control import SavedSearches
from app.messages.driving import PaintedRegions, PaintedStroke
from app.messages.images import CompressedColor, StampedCamera
from app.messages.keys import BASE_FRAME, WORLD_FRAME
from app.messages.memory import MapAlignment, RememberedThing, Room
from app.messages.motion import StampedPath, StampedTransform, timed_link
from app.messages.recording import RecordingStatus
from app.messages.scene import FoundObject, VoxelCloud
from app.messages.status import Event, FarEvidenceCells, FindReport, LevelTable, Status, is_restart
from app.view.floor_height import FloorHeight
from app.view.model.candidates import Candidate, best_candidates
from app.view.model.history import History
from app.view.model.label_colors import LabelColors
from app.view.model.picture_store import PictureStore
from app.view.model.seek_history import SeekHistory
from app.view.model.unfound_goals import UnfoundGoals
from app.view.model.voxel_store import VoxelStore, VoxelUpdate
from app.view.recorders import Recorders
from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array
from ippon.planning.plan import TreeView

Part = Literal[
    "voxels",
    "tree",
    "path",
    "pose",
    "camera",
    "image",
    "status",
    "proximity",
    "events",
    "detections",
    "painted",
    "far_evidence",
    "recording",
]

NO_FAR_EVIDENCE: Final = FarEvidenceCells(stamp_ns=0, cell_m=0.25, cells=[])

_MAX_CELL_M: Final = 10.0
_MAX_HELD: Final = 256
_MAX_EVENTS: Final = 500
_MAX_FRAMES: Final = 256
_MAX_POSES: Final = 32
_MAX_TRAIL: Final = 20_000
_TRAIL_STEP_M: Final = 0.05
_RESTART_NS: Final = 1_000_000_000


class SceneModel:
    """The scene after the last message."""

    def __init__(self) -> None:
        self.voxels = VoxelStore()
        self.voxel_size_m: float | None = None
        """None before the first status, until which voxels are held back."""
        self.tree: TreeView | None = None
        self.path_world: Float64Array = np.empty((0, 3))
        self.T_world_base: Float64Array | None = None
        self.T_world_camera: Float64Array | None = None
        self.body: BodyProfile | None = None
        """The robot's body; None until its navigator has told it."""
        self.camera_poses: deque[tuple[int, Float64Array]] = deque(maxlen=_MAX_POSES)
        """Stamp in nanoseconds and T_world_camera of the last poses, in order."""
        self.camera: PinholeCamera | None = None
        self.image: CompressedColor | None = None
        self.trail_world: list[tuple[float, float, float]] = []
        self.status: Status | None = None
        self.proximity: LevelTable | None = None
        self.events: deque[Event] = deque(maxlen=_MAX_EVENTS)
        self.detections: tuple[FoundObject, ...] = ()
        self.rejected: tuple[FindReport, ...] = ()
        """Finds of the present goal that the operator rejected."""
        self.unfound = UnfoundGoals()
        self.history = History()
        self.label_colors = LabelColors()
        """Colours of the labels in the colour mode of things."""
        self.pictures = PictureStore()
        """Pictures along the trajectory, for explanations."""
        self.painted: tuple[PaintedStroke, ...] = ()
        self.far_evidence = NO_FAR_EVIDENCE
        """Evidence of the object beyond the map's range."""
        self.recorders = Recorders()
        """Status of each recorder."""
        self.rooms: tuple[Room, ...] = ()
        """Rooms of the map, as last asked for."""
        self.things: tuple[RememberedThing, ...] = ()
        """What the robot remembers, as last asked for."""
        self.saved_searches = SavedSearches(searches=[])
        self.forgotten = 0
        """How often all of the scene was forgotten: at a restart of the navigator, at a seek."""
        self.needs_keyframe = True
        """Whether the map may lack voxels, so that a keyframe must be requested."""
        self._changed: set[Part] = set()
        self._held: deque[VoxelCloud] = deque(maxlen=_MAX_HELD)
        self._moving: dict[str, StampedTransform] = {}
        self._fixed: dict[str, StampedTransform] = {}
        self._T_map_world: Float64Array = np.eye(4)
        self._camera_frame: str | None = None
        self._floor = FloorHeight()
        self._last_find: FindReport | None = None
        self._candidates: tuple[Candidate, ...] | None = None

    @property
    def floor_z_m(self) -> float:
        """Height of the floor that the robot stands on, metres; 0 before its first pose."""
        return self._floor.z_m

    def take_changes(self) -> frozenset[Part]:
        """Return what changed since the last call."""
        self.pictures.place(self.camera_poses)
        changed, self._changed = frozenset(self._changed), set[Part]()
        return changed

    def on_status(self, status: Status) -> None:
        """Update the state of the navigator; after a restart of it, the map is cleared."""
        before = self.status
        if before is not None and is_restart(before, status):
            self._forget_session()
        elif before is not None and _goal_of(before) != _goal_of(status):
            self.rejected = ()
        if before is None or before.state != status.state:
            self._candidates = None
        self._last_find = status.find or self._last_find
        self.status = status
        self.unfound.follow(status, self.candidates)
        self.history.add(status)
        self._changed.add("status")
        if self.voxel_size_m is None and math.isfinite(status.voxel_size_m):
            self.voxel_size_m = status.voxel_size_m if status.voxel_size_m > 1e-3 else None
            for cloud in self._held:
                self._store(cloud)

    def on_voxels(self, cloud: VoxelCloud) -> None:
        """Update voxels; their values are absolute."""
        if self.needs_keyframe:
            self._held.append(cloud)
        self._store(cloud)

    def on_keyframe(self, cloud: VoxelCloud) -> None:
        """Replace all voxels, then apply newer changes again."""
        self.voxels.clear()
        self._candidates = None
        self._store(cloud)
        for delta in self._held:
            if delta.stamp_ns > cloud.stamp_ns:
                self._store(delta)
        if self.voxel_size_m is not None:
            self._held.clear()
            self.needs_keyframe = False
        else:
            self._held.appendleft(cloud)
        self._changed.add("voxels")

    def on_tree(self, tree: TreeView) -> None:
        """Replace the viewpoint tree."""
        self.tree = tree
        self._changed.add("tree")

    def on_path(self, path: StampedPath) -> None:
        """Replace the path that the robot follows."""
        self.path_world = path.points_world
        self._changed.add("path")

    def on_transforms(self, transforms: Iterable[StampedTransform], *, fixed: bool = False) -> None:
        """Update coordinate frames, and with them the poses of base and camera."""
        table = self._fixed if fixed else self._moving
        for transform in transforms:
            known = table.get(transform.child)
            if known is None and len(table) >= _MAX_FRAMES:
                continue
            if fixed or known is None or transform.stamp_ns >= known.stamp_ns - _RESTART_NS:
                table[transform.child] = transform
        self.T_world_base = self._chain(BASE_FRAME)
        if self._camera_frame is not None:
            self.T_world_camera = self._chain(self._camera_frame)
        self._follow_base()
        self._changed.add("pose")

    def on_configuration(self, configuration: BodyConfiguration) -> None:
        """Take over the robot's body."""
        self.body = configuration.profile
        self._changed.add("pose")

    def on_alignment(self, alignment: MapAlignment) -> None:
        """Take over where the frame of tf lies in the map."""
        self._T_map_world = alignment.as_transform()
        self.on_transforms(())

    def on_camera(self, camera: StampedCamera) -> None:
        """Update the intrinsics of the colour camera."""
        if camera.camera != self.camera or camera.frame_id != self._camera_frame:
            self.camera = camera.camera
            self._camera_frame = camera.frame_id
            self.T_world_camera = self._chain(camera.frame_id)
            self._changed.add("camera")

    def on_image(self, image: CompressedColor) -> None:
        """Update the latest camera image, encoded as received."""
        self.image = image
        self.pictures.place(self.camera_poses)
        self.pictures.hold(image, self.camera)
        self._changed.add("image")

    def on_far_evidence(self, far_evidence: FarEvidenceCells) -> None:
        """Replace the cells with evidence from beyond the map's range."""
        before = self.far_evidence
        if not 0.0 < far_evidence.cell_m < _MAX_CELL_M:
            return
        if (far_evidence.cell_m, far_evidence.cells) != (before.cell_m, before.cells):
            self.far_evidence = far_evidence
            self._changed.add("far_evidence")

    def on_painted(self, painted: PaintedRegions) -> None:
        """Replace the painted regions."""
        self.painted = tuple(painted.regions)
        self._changed.add("painted")

    def candidates(self) -> tuple[Candidate, ...]:
        """Return the most probable places of the object.

        They are computed on demand over the whole map, and cached until the state changes.
        """
        if self.voxel_size_m is None:
            return ()
        if self._candidates is None:
            self._candidates = best_candidates(self.voxels, self.voxel_size_m, self.pictures)
        return self._candidates

    def on_proximity(self, table: LevelTable) -> None:
        """Replace the proximity levels."""
        self.proximity = table
        self._changed.add("proximity")

    def on_places(self, rooms: Iterable[Room], things: Iterable[RememberedThing]) -> None:
        """Replace rooms and remembered things."""
        self.rooms, self.things = tuple(rooms), tuple(things)

    def on_saved_searches(self, saved: SavedSearches) -> None:
        """Replace the saved searches."""
        self.saved_searches = saved

    def on_event(self, event: Event) -> None:
        """Append to the log, and store rejected finds."""
        self.events.append(event)
        last = self._last_find
        if event.kind == "rejected" and last is not None and event.find in (None, last.number):
            self.rejected += (last,)
            self._last_find = None
            self._changed.add("detections")
        self._changed.add("events")

    def on_recording(self, status: RecordingStatus) -> None:
        """Take a recorder's status."""
        self.recorders.add(status)
        self._changed.add("recording")

    def on_detections(self, detections: tuple[FoundObject, ...]) -> None:
        """Replace the found objects."""
        self.detections = detections
        self._changed.add("detections")

    def restore(self, past: SeekHistory) -> None:
        """Reset everything except this history; the messages of the moment follow."""
        self._forget_session()
        self._fixed.clear()
        self.history = History()
        self._T_map_world = np.eye(4)
        self.status = self.proximity = self.image = self.T_world_base = self.T_world_camera = None
        self.trail_world = list(past.trail)
        self.events = deque(past.events, maxlen=_MAX_EVENTS)
        for status in past.statuses:
            self.history.add(status)
        self._changed |= {"status", "events"}

    def _forget_session(self) -> None:
        self.forgotten += 1
        self.voxels.clear()
        self.needs_keyframe = True
        self._held.clear()
        # Fixed transforms stay: a robot sends them only once.
        self._moving.clear()
        self._floor.restart()
        self.camera_poses.clear()
        self.trail_world.clear()
        self.history.clear()
        self.pictures.clear()
        self.painted, self.rejected, self.rooms, self.things = (), (), (), ()
        self.far_evidence = NO_FAR_EVIDENCE
        self.voxel_size_m = self._candidates = self._last_find = None
        self.unfound = UnfoundGoals()
        self.tree, self.path_world, self.detections = None, np.empty((0, 3)), ()
        self._changed |= {"voxels", "tree", "path", "pose", "detections", "painted", "far_evidence"}

    def _store(self, cloud: VoxelCloud) -> None:
        if self.voxel_size_m is None:
            return
        columns = (cloud.ooi, cloud.proximity, cloud.level, cloud.label, cloud.confidence)
        indices = cloud.indices(self.voxel_size_m).astype(np.int64)
        values = np.column_stack([cloud.color, *columns])
        self.voxels.apply(VoxelUpdate(indices=indices, attributes=values, surface=~cloud.removed))
        self._changed.add("voxels")

    def _chain(self, frame: str) -> Float64Array | None:
        T_world_frame: Float64Array = np.eye(4)
        for _ in range(16):
            if frame == WORLD_FRAME:
                return self._T_map_world @ T_world_frame
            link = self._moving.get(frame) or self._fixed.get(frame)
            if link is None:
                return None
            T_world_frame = link.T_parent_child @ T_world_frame
            frame = link.parent
        return None

    def _follow_base(self) -> None:
        """Keep its pose; on another floor, all that is drawn by its height is drawn anew."""
        base = timed_link(BASE_FRAME, self._moving, self._fixed)
        if base is not None and self.T_world_camera is not None:
            self.camera_poses.append((base.stamp_ns, self.T_world_camera))
        if base is None or self.T_world_base is None:
            return
        x, y, z = self.T_world_base[:3, 3].tolist()
        if self._floor.stand_on(z, base.stamp_ns):
            self.voxels.touch()
            self._changed |= {"voxels", "painted", "far_evidence"}
        if self.trail_world and math.dist(self.trail_world[-1], (x, y, z)) < _TRAIL_STEP_M:
            return
        self.trail_world.append((x, y, z))
        if len(self.trail_world) > _MAX_TRAIL:
            self.trail_world = self.trail_world[::2]


def _goal_of(status: Status) -> int | None:
    return None if status.goal is None else status.goal.goal_id
