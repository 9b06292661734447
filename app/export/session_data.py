"""Data of a recording for exports: the scene at its end, and the robot's trajectory."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.datasets.bag_poses import BagPoses, poses_of
from app.datasets.bag_robot import BagRobot
from app.datasets.dataset import DatasetError
from app.datasets.messages import TF_ALONE
from app.links.robot_streams.transforms import BACKWARDS_NS
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.keys import BASE_FRAME, WORLD_FRAME
from app.messages.motion import decode_transforms
from app.nodes.review.player import Player
from app.recording.base_pose import BasePose
from app.recording.camera_topics import mixed
from app.recording.errors import RecordingError
from app.recording.map_alignment import MapAlignments
from app.recording.reading.bag_files import stored_in
from app.recording.reading.recording import Recording
from app.recording.timeline import SessionTimeline
from app.view.model.scene_model import SceneModel
from app.view.model.scene_reader import SceneReader
from ippon.geometry import Float64Array

logger = logging.getLogger(__name__)

OnProgress = Callable[[float], None]
"""Called with the fraction of an export that is done."""


def no_progress(_: float) -> None:
    """Ignore progress."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """Poses of the base over time."""

    time_ns: NDArray[np.int64]
    """(N,) nanoseconds of the robot's clock; ascending, except where that was set back."""
    T_world_base: Float64Array
    """(N, 4, 4) rigid transforms."""

    def driven_m(self) -> Float64Array:
        """Return (N,) the length of the way over the floor so far, metres."""
        places = self.T_world_base[:, :2, 3]
        return np.cumsum(np.linalg.norm(np.diff(places, axis=0, prepend=places[:1]), axis=1))


@dataclass(frozen=True, kw_only=True)
class SessionData:
    """Input of the exports."""

    path: Path
    """As it was named: a file, or a folder with all parts of a bag."""
    recording: Recording
    timeline: SessionTimeline
    scene: SceneModel
    """Scene at the end of the recording."""
    robot: BagRobot = field(default_factory=BagRobot)
    """What is told of the robot of a bag of another program."""

    @property
    def name(self) -> str:
        """Name of the session's folder, or of its file where the folder has others."""
        if self.path.is_dir():
            return self.path.resolve().name
        path = self.recording.path.resolve()
        return path.parent.name if self.is_alone else path.name

    @property
    def is_alone(self) -> bool:
        """Whether its folder has no other recording."""
        return self.path.is_dir() or len(stored_in(self.recording.path.resolve().parent)) == 1

    @cached_property
    def trajectory(self) -> Trajectory:
        """Every pose of the base, read from the file once.

        Raises:
            RecordingError: There is none, or those of several topics.
        """
        return _trajectory(self.recording, self.robot)

    def driven_m(self) -> float | None:
        """Return the length of the way over the floor, metres; None without poses.

        A bag whose poses are those of odometry, or of another base or world, has no trail.
        """
        if self.timeline.trail:
            return self.timeline.driven_m()
        try:
            return float(self.trajectory.driven_m()[-1])
        except RecordingError:
            return None


def read_session_data(
    path: Path, on_progress: OnProgress = no_progress, robot: BagRobot | None = None
) -> SessionData:
    """Open a recording and go to its end.

    Args:
        path: The file, or a session's folder.
        on_progress: Called with the fraction that is read.
        robot: What is told of the robot of a bag; None for nothing.

    Raises:
        RecordingError: It cannot be read.
    """
    robot = robot or BagRobot()
    recording = Recording(path, on_progress, robot.names)
    scene = SceneModel()
    player = Player(recording, SceneReader(scene).feed)
    player.seek(recording.duration_s)
    return SessionData(
        path=path, recording=recording, timeline=player.timeline, scene=scene, robot=robot
    )


def _trajectory(recording: Recording, robot: BagRobot) -> Trajectory:
    _check_topics(recording, TF_ALONE)
    trajectory = _follow(recording, TF_ALONE) if robot.base == BASE_FRAME else None
    if trajectory is None:
        poses = _other_poses(recording, robot)
        _check_topics(recording, poses)
        logger.warning("%s", poses.note(recording.path))
        trajectory = _follow(recording, poses)
    if trajectory is None:
        raise RecordingError(_no_pose(recording.path, robot.base))
    return trajectory


def _check_topics(recording: Recording, poses: BagPoses) -> None:
    """Refuse poses of several topics.

    Raises:
        RecordingError: There are several; says which, and how one is chosen.
    """
    if several := mixed(recording, poses.keys):
        raise RecordingError(f"{recording.path}: {several}")


def _other_poses(recording: Recording, robot: BagRobot) -> BagPoses:
    """Return where poses come from that are not those of `base_link` in a frame `map`.

    Raises:
        RecordingError: There are none.
    """
    messages = recording.all_messages((*TF_ALONE.keys, keys.ODOM))
    told = ((one.key, one.payload) for one in messages)
    try:
        return poses_of(recording.path, told, robot.T_base_camera, robot.clock_offset_s, robot.base)
    except DatasetError as error:
        known = robot.base == BASE_FRAME
        text = _no_pose(recording.path, robot.base) if known else str(error)
        raise RecordingError(text) from error


def _follow(recording: Recording, source: BagPoses) -> Trajectory | None:
    """Return the poses of the base in the map, else in the world of a source; None without any."""
    base, alignments = BasePose(source.world, source.base), MapAlignments(recording)
    stamps: list[int] = []
    poses: list[Float64Array] = []
    steps_back = 0
    for message in recording.all_messages(source.keys):
        try:
            is_odometry = message.key == keys.ODOM
            payload = source.converted(message.payload) if is_odometry else message.payload
            came = decode_transforms(payload)
        except MessageError:
            # Undecodable messages are skipped.
            continue
        base.T_map_world = alignments.at(message.time_ns)
        base.take(came, fixed=message.key == keys.TF_STATIC)
        stamp_ns, pose = base.stamp_ns(), base.pose()
        if stamp_ns is None or pose is None:
            continue
        early_ns = stamps[-1] - stamp_ns if stamps else -1
        if 0 <= early_ns < BACKWARDS_NS:
            # It is the same pose, or one that was overtaken on its way.
            continue
        steps_back += early_ns >= BACKWARDS_NS
        stamps.append(stamp_ns)
        poses.append(pose)
    if not stamps:
        return None
    if steps_back:
        logger.warning(
            "%s: steps back of the robot's clock: %d; the times of the trajectory begin anew after "
            "each", recording.path, steps_back,
        )  # fmt: skip
    return Trajectory(time_ns=np.array(stamps, np.int64), T_world_base=np.stack(poses))


def _no_pose(path: Path, base: str) -> str:
    return (
        f"{path} has no pose of the robot: neither tf nor odometry leads to {base} from "
        f"{WORLD_FRAME} or another root; `ippon doctor FILE` says what is missing, and "
        "--base-frame names a base that is called something else"
    )


def need_map(session: SessionData) -> tuple[NDArray[np.int64], NDArray[np.uint8], float]:
    """Return (N, 3) voxel indices, their (N, 8) attributes, and the voxel size in metres.

    Raises:
        RecordingError: There is no map.
    """
    indices, attributes = session.scene.voxels.all_voxels()
    if session.scene.voxel_size_m is None or not len(indices):
        raise RecordingError(
            f"{session.recording.path} has no map: it contains no {keys.MAP_VOXELS} of a navigator"
        )
    return indices, attributes, session.scene.voxel_size_m
