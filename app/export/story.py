"""A recording, read once for every export: its scene at the end, and where the robot was when."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.motion import decode_transforms
from app.nodes.review.player import Player
from app.recording.digest import Digest
from app.recording.errors import RecordingError
from app.recording.recording import Recording
from app.view.reader import SceneReader
from app.view.scene_model import BASE_FRAME, WORLD_FRAME, SceneModel
from ippon.geometry import Float64Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """Poses of the base."""

    time_ns: NDArray[np.int64]
    """(N,) of the robot's clock."""
    T_world_base: Float64Array
    """(N, 4, 4)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Story:
    """What exports are made from."""

    recording: Recording
    digest: Digest
    scene: SceneModel
    """At the end of the recording."""

    @property
    def name(self) -> str:
        """Of the session."""
        return self.recording.path.parent.name


def open_story(path: Path) -> Story:
    """Open a recording and go to its end.

    Raises:
        RecordingError: It cannot be read.
    """
    recording = Recording(path)
    scene = SceneModel()
    player = Player(recording, SceneReader(scene).feed)
    player.seek(recording.duration_s)
    return Story(recording=recording, digest=player.digest, scene=scene)


def read_trajectory(story: Story) -> Trajectory:
    """Return every pose of the base.

    Raises:
        RecordingError: There is none.
    """
    stamps: list[int] = []
    poses: list[Float64Array] = []
    for message in story.recording.all_messages((keys.TF,)):
        try:
            transforms = decode_transforms(message.payload)
        except MessageError:
            # Counted when the session was watched; a trajectory is made of what can be read.
            continue
        for t in transforms:
            later = not stamps or t.stamp_ns > stamps[-1]
            if t.child == BASE_FRAME and t.parent == WORLD_FRAME and later:
                stamps.append(t.stamp_ns)
                poses.append(t.T_parent_child)
    if not stamps:
        raise RecordingError(
            f"{story.recording.path} has no pose of the robot: no tf from {WORLD_FRAME} to "
            f"{BASE_FRAME}"
        )
    return Trajectory(time_ns=np.array(stamps, np.int64), T_world_base=np.stack(poses))


def need_map(story: Story) -> tuple[NDArray[np.int64], NDArray[np.uint8], float]:
    """Return (N, 3) voxel indices, their (N, 8) attributes, and the voxel's edge in metres.

    Raises:
        RecordingError: There is no map.
    """
    indices, attributes = story.scene.voxels.all_voxels()
    if story.scene.voxel_size_m is None or not len(indices):
        raise RecordingError(
            f"{story.recording.path} has no map: no {keys.MAP_VOXELS} of a navigator is in it"
        )
    return indices, attributes, story.scene.voxel_size_m
