"""Publishes the map, the viewpoint tree, the path and the detections."""

import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Final

import numpy as np
import zenoh

from app.links.network.latched_topic import LatchedTopic
from app.links.network.query_queue import QueryQueue
from app.links.network.sender import Sender
from app.messages import keys
from app.messages.control import encode
from app.messages.motion import StampedPath, encode_path
from app.messages.scene import (
    FoundObject,
    VoxelCloud,
    encode_found_objects,
    encode_tree,
    encode_voxels,
)
from app.messages.status import FarEvidenceCells
from ippon.mapping.objects.surface_changes import SurfaceDelta, SurfaceTracker
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.snapshot import Find, Snapshot

MAX_DETECTIONS: Final = 20
MAX_BACKLOG_BYTES: Final = 4 * 2**20
"""Unsent bytes above which changes of the map accumulate in the tracker instead, and requests for
all of it wait."""
MAX_WAITING: Final = 16
"""Largest number of pending requests for the whole map; more are dropped."""
KEYFRAMES_HZ: Final = 5.0
"""Requests for the whole map, which has megabytes, that are answered in a second."""
KEYFRAMES_AT_ONCE: Final = 20


class MapPublisher:
    """Publishes changes with each step, and the whole map at intervals and on request."""

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        voxel_map: VoxelMap,
        keyframe_every_s: float,
        sender: Sender,
    ) -> None:
        self._sender = sender
        self._keyframe_key = f"{robot}/{keys.MAP_KEYFRAME}"
        self._requests: QueryQueue | None = None
        self._waiting: list[zenoh.Query] = []
        self._waiting_lock = threading.Lock()
        self._last: Snapshot | None = None
        self._republish = 0
        self._voxel_m = voxel_map.config.voxel_size_m
        self._tracker = SurfaceTracker(voxel_map)
        self._keyframe_every_s = keyframe_every_s
        self._keyframe_at = time.monotonic()
        self._frame_ns = 0
        self._stamp_ns = -1
        # After a lost delta, subscribers would show a wrong voxel until its next change.
        block = zenoh.CongestionControl.BLOCK
        self._voxels = session.declare_publisher(
            f"{robot}/{keys.MAP_VOXELS}", congestion_control=block
        )
        self._keyframe = session.declare_publisher(self._keyframe_key, congestion_control=block)
        self._plan = {
            key: LatchedTopic(session, f"{robot}/{key}", sender)
            for key in (keys.PLAN_TREE, keys.PLAN_PATH, keys.DETECTIONS, keys.FAR_EVIDENCE)
        }

    def publish(self, snapshot: Snapshot) -> None:
        """Publish the map's changes and the plan of one step."""
        self._frame_ns = snapshot.stamp_ns
        if self._sender.backlog_bytes <= MAX_BACKLOG_BYTES:
            self._publish_changes()
            if time.monotonic() - self._keyframe_at > self._keyframe_every_s:
                self._keyframe_at = time.monotonic()
                heard: Any = self._keyframe.matching_status
                if heard.matching:
                    self._put(self._keyframe, self.keyframe())
        if self._last is not None and snapshot.stamp_ns < self._last.stamp_ns:
            # Viewers clear their state with the next status: publish everything after it.
            self._republish = 2
        before = self._last if self._republish == 0 else None
        for key, payload in plan_messages(snapshot, before):
            self._plan[key].put(payload)
        self._last, self._republish = snapshot, max(0, self._republish - 1)

    def serve(self, session: zenoh.Session, wake: Callable[[], None]) -> None:
        """Take requests for the whole map; `wake` is called for each that `answer` will answer."""

        def queue(query: zenoh.Query) -> None:
            if self.ask(query):
                wake()
            else:
                query.drop()

        self._requests = QueryQueue(
            session, self._keyframe_key, queue, rate_hz=KEYFRAMES_HZ, burst=KEYFRAMES_AT_ONCE
        )

    def ask(self, query: zenoh.Query) -> bool:
        """Queue a request for the whole map until `answer`; safe from any thread.

        Returns:
            Whether it will be answered; False if too many are pending.
        """
        with self._waiting_lock:
            if len(self._waiting) >= MAX_WAITING:
                return False
            self._waiting.append(query)
            return True

    def answer(self) -> None:
        """Answer all pending requests with one encoding of the whole map, once the link is free."""
        if self._sender.backlog_bytes > MAX_BACKLOG_BYTES:
            return
        with self._waiting_lock:
            queries, self._waiting = self._waiting, []
        if queries:
            payload = self.keyframe()
            for query in queries:
                reply = partial(_reply, query, self._keyframe_key, payload)
                self._sender.put(len(payload), reply)

    def keyframe(self) -> bytes:
        """Return the whole map, and publish the latest changes to subscribers."""
        self._publish_changes()
        return encode_voxels(self._cloud(self._tracker.keyframe()))

    def _publish_changes(self) -> None:
        delta = self._tracker.update()
        if len(delta.index):
            self._put(self._voxels, encode_voxels(self._cloud(delta)))

    def _put(self, publisher: zenoh.Publisher, payload: bytes) -> None:
        self._sender.put(len(payload), partial(publisher.put, payload))

    def _cloud(self, delta: SurfaceDelta) -> VoxelCloud:
        # Several messages may belong to one frame: each gets a newer stamp than the one before, so
        # that receivers can order them.
        self._stamp_ns = max(self._frame_ns, self._stamp_ns + 1)
        return cloud_of(delta, self._stamp_ns, self._voxel_m)


def plan_messages(snapshot: Snapshot, before: Snapshot | None) -> Iterator[tuple[str, bytes]]:
    """Yield key and payload of a step's tree (if any), path, detections and far evidence.

    Args:
        snapshot: The step's.
        before: Snapshot of the previous step, None for none: far evidence is sent when it changes.
    """
    stamp = snapshot.stamp_ns
    path = np.empty((0, 3))
    if snapshot.plan is not None:
        yield keys.PLAN_TREE, encode_tree(snapshot.plan.tree, stamp)
        path = snapshot.plan.path_world
    yield keys.PLAN_PATH, encode_path(StampedPath(stamp_ns=stamp, points_world=path))
    label = snapshot.goal.object if snapshot.goal is not None else ""
    finds = [detection_of(find, label) for find in snapshot.candidates[:MAX_DETECTIONS]]
    yield keys.DETECTIONS, encode_found_objects(finds, stamp)
    # Unchanged arrays keep their identity.
    if before is not None and before.far_evidence is snapshot.far_evidence:
        return
    rows: list[list[float]] = np.round(snapshot.far_evidence.astype(np.float64), 3).tolist()
    places = FarEvidenceCells(
        stamp_ns=stamp,
        cell_m=snapshot.far_evidence_cell_m,
        cells=[(x, y, nat) for x, y, nat in rows],
    )
    yield keys.FAR_EVIDENCE, encode(places)


def cloud_of(delta: SurfaceDelta, stamp_ns: int, voxel_m: float) -> VoxelCloud:
    """Return changed voxels as a message."""
    return VoxelCloud(
        stamp_ns=stamp_ns,
        centers_world=(delta.index.astype(np.float32) + np.float32(0.5)) * np.float32(voxel_m),
        color=delta.color,
        ooi=delta.ooi,
        proximity=delta.proximity,
        level=delta.level,
        label=delta.label,
        confidence=delta.confidence,
        removed=delta.removed,
    )


def _reply(query: zenoh.Query, key: str, payload: bytes) -> None:
    with query:
        query.reply(key, payload)


def detection_of(find: Find, label: str) -> FoundObject:
    """Return a find as a message."""
    return FoundObject(
        label=label,
        probability=find.probability,
        center_world=find.position_world,
        size_m=find.size_m,
    )
