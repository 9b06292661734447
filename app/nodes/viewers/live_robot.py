"""The scene of a running robot, kept up to date for a viewer of another program."""

import logging
import threading
import time
from collections.abc import Callable
from typing import Final, Literal, Protocol

import zenoh

from app.links.network.inbox import Inbox
from app.links.network.map_gaps import MapGaps
from app.links.network.session import LinkError
from app.links.network.topic_listener import TopicListener
from app.messages import keys
from app.process.stop_signal import StopSignal
from app.view.model.scene_model import Part, SceneModel
from app.view.model.scene_reader import SceneReader

logger = logging.getLogger(__name__)

LinkState = Literal["waiting", "live", "silent"]

EVERY: Final = (keys.MAP_VOXELS, keys.MAP_KEYFRAME, keys.EVENT, keys.TF, keys.TF_STATIC)
"""Topics of which every message counts."""
IMAGES: Final = (keys.DEPTH, keys.DEPTH_RAW)
"""Topics that are shown and are no part of the scene."""
DRAW_S: Final = 0.05
CEILING_M: Final = 1.4
"""Height above which viewers hide the map by default, as the console does."""
LIVE_S: Final = 2.0
"""Silence after which a navigator counts as silent."""
_BACK_NS: Final = 1_000_000_000
_RETRY_S: Final = 0.5


class Viewer(Protocol):
    """What shows a robot. All methods are called in one thread."""

    def take(self, key: str, payload: bytes) -> None:
        """Show one message, after the scene has been updated with it."""
        ...

    def draw(self, scene: SceneModel, changed: frozenset[Part]) -> None:
        """Show what changed in the scene; called at most every `DRAW_S`."""
        ...

    def show_link(self, state: LinkState, text: str) -> None:
        """Show whether the robot is heard; called when that changes."""
        ...


def clock_ns(scene: SceneModel) -> int:
    """Return the newest robot time of a scene, nanoseconds; 0 before the first message."""
    stamps = [scene.camera_poses[-1][0]] if scene.camera_poses else []
    if scene.status is not None:
        stamps.append(scene.status.stamp_ns)
    return max(stamps, default=0)


def begins_again(now_ns: int, before_ns: int) -> bool:
    """Return whether a robot's clock has begun again between two of its times, nanoseconds."""
    return now_ns < before_ns - _BACK_NS


class LiveRobot:
    """Receives a robot's topics and passes them to one viewer."""

    def __init__(self, endpoint: str, robot: str) -> None:
        keys.check_prefix(robot)
        self.model = SceneModel()
        self.robot = robot
        self._reader = SceneReader(self.model)
        self._inbox = Inbox(EVERY)
        topics = (*self._reader.keys, *IMAGES)
        self._listener = TopicListener(endpoint, robot, topics, self._inbox.put)
        self._wants_map = threading.Event()
        self._failure: BaseException | None = None
        self._gaps = MapGaps(lambda: self._listener.openings, self._inbox)
        self._told_rejects = 0
        self._state: LinkState | None = None

    def run(self, viewer: Viewer, stop: StopSignal) -> None:
        """Show the robot until stopped, also while it is away.

        Raises:
            Exception: What the connecting thread did not expect.
        """
        ended = threading.Event()
        thread = threading.Thread(target=self._keep_open, args=(ended,), name="link", daemon=True)
        thread.start()
        drawn_at = 0.0
        try:
            while not stop.is_set():
                if self._failure is not None:
                    raise self._failure
                self._read(viewer)
                now = time.monotonic()
                if now - drawn_at >= DRAW_S:
                    drawn_at = now
                    self._tell_link(viewer)
                    viewer.draw(self.model, self.model.take_changes())
        finally:
            ended.set()
            # Ends a query that waits; a session that is just being opened is closed after it.
            self._listener.close()
            thread.join(timeout=5.0)
            self._listener.close()

    def _read(self, viewer: Viewer) -> None:
        batch = self._inbox.drain(DRAW_S)
        # A keyframe in this batch was fetched after the opening that it belongs to.
        if self._gaps.are_new():
            self.model.needs_keyframe = True
        for key, payload in batch:
            if key == keys.MAP_KEYFRAME and not self.model.needs_keyframe:
                continue
            if key in IMAGES or self._reader.feed(key, payload):
                viewer.take(key, payload)
            if key == keys.MAP_KEYFRAME and not self._gaps.are_filled():
                # Something was missed between the request and this reply.
                self.model.needs_keyframe = True
        total = self._reader.rejected.total()
        if total > 2 * self._told_rejects:
            self._told_rejects = total
            logger.warning("%d messages skipped, the last one %s", total, self._reader.problem)
        if self.model.needs_keyframe:
            self._wants_map.set()
        else:
            self._wants_map.clear()

    def _tell_link(self, viewer: Viewer) -> None:
        state: LinkState = "waiting"
        if self.model.status is not None and self._listener.silence_s() < LIVE_S:
            state = "live"
        elif self._state in ("live", "silent"):
            state = "silent"
        if state == self._state:
            return
        self._state = state
        text = _TEXTS[state](self._listener.endpoint, self.robot)
        if state == "silent":
            logger.warning("%s", text)
        else:
            logger.info("%s", text)
        viewer.show_link(state, text)

    def _keep_open(self, ended: threading.Event) -> None:
        try:
            while not ended.is_set():
                self._check()
                ended.wait(_RETRY_S)
        except Exception as error:  # noqa: BLE001 - raised again in the thread that shows
            self._failure = error
            self._inbox.wake()

    def _check(self) -> None:
        try:
            self._listener.check()
        except (LinkError, zenoh.ZError) as error:
            logger.debug("%s", error)
            return
        if self._wants_map.is_set():
            asked_at = self._gaps.now()
            payload = self._listener.query(keys.MAP_KEYFRAME)
            if payload is not None:
                self._gaps.note_fetched(asked_at)
                self._inbox.put(keys.MAP_KEYFRAME, payload)


_TEXTS: Final[dict[LinkState, Callable[[str, str], str]]] = {
    "waiting": lambda endpoint, robot: f"no navigator at {endpoint} for robot {robot}; waiting",
    "live": lambda endpoint, robot: f"receiving robot {robot} from {endpoint}",
    "silent": lambda endpoint, robot: (
        f"no data from robot {robot} at {endpoint}; what is shown is old"
    ),
}
