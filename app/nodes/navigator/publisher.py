"""What the navigator shows: map, tree, path, detections."""

import time
from typing import Final

import numpy as np
import zenoh

from app.links.latched import Latched
from app.messages import keys
from app.messages.motion import StampedPath, encode_path
from app.messages.scene import Detection, VoxelCloud, encode_detections, encode_tree, encode_voxels
from ippon.mapping.surface import SurfaceDelta, SurfaceTracker
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.snapshot import Find, Snapshot

MAX_DETECTIONS: Final = 20


class MapPublisher:
    """Publishes what changed, and the whole map when somebody needs it."""

    def __init__(
        self, session: zenoh.Session, robot: str, voxel_map: VoxelMap, keyframe_every_s: float
    ) -> None:
        self._voxel_m = voxel_map.config.voxel_size_m
        self._tracker = SurfaceTracker(voxel_map)
        self._keyframe_every_s = keyframe_every_s
        self._keyframe_at = time.monotonic()
        self._stamp_ns = 0
        # A lost delta would leave a wrong voxel behind until it changes again.
        block = zenoh.CongestionControl.BLOCK
        self._voxels = session.declare_publisher(
            f"{robot}/{keys.MAP_VOXELS}", congestion_control=block
        )
        self._keyframe = session.declare_publisher(
            f"{robot}/{keys.MAP_KEYFRAME}", congestion_control=block
        )
        self._tree = Latched(session, f"{robot}/{keys.PLAN_TREE}")
        self._path = Latched(session, f"{robot}/{keys.PLAN_PATH}")
        self._detections = Latched(session, f"{robot}/{keys.DETECTIONS}")

    def publish(self, snapshot: Snapshot) -> None:
        """Publish the map's changes and the plan of one step."""
        self._stamp_ns = snapshot.stamp_ns
        self._publish_changes()
        if time.monotonic() - self._keyframe_at > self._keyframe_every_s:
            self._keyframe_at = time.monotonic()
            self._keyframe.put(self.keyframe())
        stamp = snapshot.stamp_ns
        if snapshot.plan is not None:
            self._tree.put(encode_tree(snapshot.plan.tree, stamp))
        path = snapshot.plan.path_world if snapshot.plan is not None else np.empty((0, 3))
        self._path.put(encode_path(StampedPath(stamp_ns=stamp, points_world=path)))
        label = snapshot.goal.object if snapshot.goal is not None else ""
        finds = snapshot.candidates[:MAX_DETECTIONS]
        self._detections.put(encode_detections([_detection(f, label) for f in finds], stamp))

    def keyframe(self) -> bytes:
        """Return the whole map as it is now; those who follow the changes get the last ones."""
        self._publish_changes()
        return encode_voxels(self._cloud(self._tracker.keyframe()))

    def _publish_changes(self) -> None:
        delta = self._tracker.update()
        if len(delta.index):
            self._voxels.put(encode_voxels(self._cloud(delta)))

    def _cloud(self, delta: SurfaceDelta) -> VoxelCloud:
        centers = (delta.index.astype(np.float32) + np.float32(0.5)) * np.float32(self._voxel_m)
        return VoxelCloud(
            stamp_ns=self._stamp_ns,
            centers_world=centers,
            color=delta.color,
            ooi=delta.ooi,
            proximity=delta.proximity,
            level=delta.level,
            label=delta.label,
            confidence=delta.confidence,
            removed=delta.removed,
        )


def _detection(find: Find, label: str) -> Detection:
    return Detection(
        label=label,
        probability=find.probability,
        center_world=find.position_world,
        size_m=find.size_m,
    )
