"""Recording of an episode: the messages that robot and navigator would send."""

from pathlib import Path
from typing import Final

from app.messages import keys
from app.messages.control import encode
from app.messages.depth.depth_images import encode_depth
from app.messages.images import encode_camera, encode_color
from app.messages.keys import CAMERA_FRAME
from app.messages.motion import (
    encode_flag,
    encode_transforms,
    robot_transforms,
)
from app.messages.scene import encode_voxels
from app.messages.status import (
    Event,
    GoalStatus,
    LevelRow,
    LevelTable,
    Status,
    Timings,
)
from app.nodes.navigator.map_publisher import cloud_of, plan_messages
from app.nodes.navigator.status_report import find_report
from app.recording.writing.limits import RecordingLimits
from app.recording.writing.session import Session
from ippon.frame import Frame
from ippon.geometry import invert_transform
from ippon.guidance.levels import Guidance
from ippon.mapping.objects.surface_changes import SurfaceTracker
from ippon.mapping.objects.surface_voxels import N_FREE, N_USED
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.mission.snapshot import Snapshot, StepResult

ROBOT: Final = "ippon"
KEYFRAME_NS: Final = 10_000_000_000


class EpisodeRecorder:
    """Observes a trial and records it; times are simulated, from the start of the recording."""

    def __init__(self, root: Path, wall_ns: int, version: str, guidance: Guidance) -> None:
        """Begin a session in a new folder under `root`.

        Args:
            root: Folder of the sessions.
            wall_ns: Present time, nanoseconds since 1970.
            version: Version of the program.
            guidance: Levels of the search.

        Raises:
            OSError: The folder cannot be written.
        """
        self._session = Session(root, ROBOT, RecordingLimits(), wall_ns)
        self._wall_ns = wall_ns
        self._version = version
        self._guidance = guidance
        self._tracker: SurfaceTracker | None = None
        self._last: Snapshot | None = None
        self._keyframe_ns: int | None = None
        self._cloud_ns = -1
        self._frames = 0

    def observe(self, frame: Frame, result: StepResult, mission: Mission) -> None:
        """Write one step; see `ippon.evaluation.episode_record.FrameObserver`."""
        snapshot = result.snapshot
        self._add_frame(frame)
        if self._tracker is None:
            self._tracker = SurfaceTracker(mission.voxel_map)
            if snapshot.goal is not None:
                table = _table(snapshot.goal, self._guidance)
                self._add(keys.LEVELS, encode(table), frame.stamp_ns)
        self._frames += 1
        self._add_map(self._tracker, mission, frame.stamp_ns)
        self._add_plan(snapshot)
        self._add(keys.STATUS, encode(self._status(snapshot, mission)), frame.stamp_ns)

    def close(self) -> Path:
        """End the recording and return its folder."""
        self._session.close()
        return self._session.writer.folder

    def _add(self, key: str, payload: bytes, stamp_ns: int) -> None:
        self._session.add(key, payload, self._wall_ns + stamp_ns, stamp_ns * 1e-9)

    def _add_frame(self, frame: Frame) -> None:
        stamp = frame.stamp_ns
        T_base_camera = invert_transform(frame.T_world_base) @ frame.T_world_camera
        transforms = robot_transforms(stamp, frame.T_world_base, T_base_camera)
        self._add(keys.TF, encode_transforms(transforms), stamp)
        self._add(keys.CAMERA_INFO, encode_camera(frame.camera, stamp, CAMERA_FRAME), stamp)
        self._add(keys.CONTACT, encode_flag(frame.contact), stamp)
        self._add(keys.DEPTH, encode_depth(frame.depth, stamp, CAMERA_FRAME), stamp)
        self._add(keys.COLOR, encode_color(frame.color, stamp, CAMERA_FRAME), stamp)

    def _add_map(self, tracker: SurfaceTracker, mission: Mission, stamp_ns: int) -> None:
        voxel_m = mission.config.map.voxel_size_m
        self._cloud_ns = max(stamp_ns, self._cloud_ns + 1)
        changes = cloud_of(tracker.update(), self._cloud_ns, voxel_m)
        self._add(keys.MAP_VOXELS, encode_voxels(changes), stamp_ns)
        if self._keyframe_ns is None or stamp_ns - self._keyframe_ns >= KEYFRAME_NS:
            self._keyframe_ns = stamp_ns
            self._cloud_ns += 1
            whole = cloud_of(tracker.keyframe(), self._cloud_ns, voxel_m)
            self._add(keys.MAP_KEYFRAME, encode_voxels(whole), stamp_ns)

    def _add_plan(self, snapshot: Snapshot) -> None:
        stamp = snapshot.stamp_ns
        for key, payload in plan_messages(snapshot, self._last):
            self._add(key, payload, stamp)
        self._last = snapshot
        for event in snapshot.events:
            told = Event(stamp_ns=stamp, kind=event.kind, text=event.text)  # pyright: ignore[reportArgumentType]
            self._add(keys.EVENT, encode(told), stamp)

    def _status(self, snapshot: Snapshot, mission: Mission) -> Status:
        goal, find = snapshot.goal, snapshot.find
        state = snapshot.state.value
        told = goal and GoalStatus(
            goal_id=goal.goal_id,
            object=goal.object,
            context=goal.context,
            outcome=snapshot.outcome or "active",
        )
        return Status(
            robot=ROBOT,
            version=self._version,
            stamp_ns=snapshot.stamp_ns,
            wall_ns=self._wall_ns + snapshot.stamp_ns,
            state=state,
            why=snapshot.why,
            goal=told,
            queue=[],
            history=[],
            find=find_report(find, goal) if find is not None and goal is not None else None,
            streams=[],
            timings=Timings(),
            frames=self._frames,
            elapsed_s=snapshot.elapsed_s,
            path_length_m=snapshot.path_length_m,
            best_ooi=snapshot.best_ooi,
            explored_m2=snapshot.explored_m2,
            surface_voxels=_surface_voxels(mission),
            voxel_size_m=mission.config.map.voxel_size_m,
            map_revision=mission.voxel_map.revision,
            notes=["an episode of ippon eval"],
        )


def _surface_voxels(mission: Mission) -> int:
    tally = mission.voxel_map.surface.tally
    return int(tally[N_USED] - 1 - tally[N_FREE])


def _table(goal: Goal, guidance: Guidance) -> LevelTable:
    rows = [
        LevelRow(label=row.label, level=row.level.text, reason=row.reason) for row in guidance.rows
    ]
    return LevelTable(
        goal_id=goal.goal_id,
        object=goal.object,
        context=goal.context,
        provider=guidance.provider,
        elapsed_ms=0.0,
        rows=rows,
    )
