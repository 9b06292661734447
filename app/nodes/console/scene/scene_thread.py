"""The thread that owns the scene model: reads messages, draws, and publishes the page's state."""

import logging
import secrets
import threading
import time
import zlib
from concurrent.futures import ThreadPoolExecutor
from typing import Final

import msgspec
import viser

from app.links.network.inbox import Inbox
from app.links.network.map_gaps import MapGaps
from app.messages import keys
from app.nodes.console.calls.call_detection import CallDetection
from app.nodes.console.calls.call_log import CallLog
from app.nodes.console.camera.camera_scene import CAMERA_PARTS, camera_scene
from app.nodes.console.critical_thread import OnFailure, critical_thread
from app.nodes.console.link.navigator_link import NavigatorLink
from app.nodes.console.link.versions import not_understood
from app.nodes.console.panels.tabs import Tabs
from app.nodes.console.scene.browser_views import BrowserViews
from app.nodes.console.scene.clicks import Clicks
from app.nodes.console.scene.explanations import Explanations
from app.nodes.console.scene.goal_list import goal_list
from app.nodes.console.scene.place_requests import PlaceRequests
from app.nodes.console.scene.pointed_places import name_under
from app.nodes.console.scene.scene_requests import Hover
from app.nodes.console.scene.shell_state import ShellState, shell_state, waiting_state
from app.nodes.console.scene.state_feed import StateFeed
from app.nodes.console.web.browsers import acting_browser
from app.nodes.console.web.viser_server import LoopbackViserServer
from app.view.drawing.camera_follow import CameraFollow
from app.view.model.scene_model import Part, SceneModel
from app.view.model.scene_reader import SceneReader

logger = logging.getLogger(__name__)

DRAW_S: Final = 0.05
"""Changes are collected this long before drawing: at most 20 drawings per second."""
PICTURE_S: Final = 0.7
"""Interval between two camera images in the scene; the panel shows every image."""
NOTICE_S: Final = 0.2
RECORDER_S: Final = 5.0
"""Time without a status after which a recorder, which tells it twice per second, has ended."""
FETCH_S: Final = 1.0
"""Interval between attempts to fetch topics published before the console subscribed."""
_WITH_THE_MAP: Final = (keys.MAP_KEYFRAME, keys.FAR_EVIDENCE, keys.PAINTED, keys.MAP_ALIGNMENT)
"""Topics that are published on change and have to be fetched again together with the map."""

EVERY: Final = (keys.MAP_VOXELS, keys.MAP_KEYFRAME, keys.EVENT, keys.TF, keys.TF_STATIC)
"""Topics of which every message counts."""


class SceneThread:
    """Feeds the scene model from the inbox and draws what changed."""

    def __init__(
        self,
        viser_server: LoopbackViserServer,
        link: NavigatorLink,
        inbox: Inbox,
        state_feed: StateFeed,
        on_failure: OnFailure,
        calls: CallLog | None = None,
    ) -> None:
        """Make the scene of all browsers.

        Args:
            viser_server: Draws it.
            link: Sends requests.
            inbox: Messages of the network or of a recording.
            state_feed: State for the pages.
            on_failure: Told when the thread ends by an error.
            calls: Where people are called; None for a recording, which needs nobody.
        """
        self._calls = calls
        self._detection = CallDetection(link.say)
        self.model = SceneModel()
        self.reader = SceneReader(self.model, link.say)
        self._link = link
        self._inbox = inbox
        self._state_feed = state_feed
        self._instance = secrets.token_hex(8)
        self.follow = CameraFollow()
        self._tabs = Tabs(viser_server.server, link)
        drive = self._tabs.drive
        self._browser_views = BrowserViews(
            viser_server.server,
            self._tabs.map,
            None if drive is None else drive.clicks,
            self.follow,
            inbox.wake,
            link.say,
            self._tabs.search,
        )
        tool_of = self._browser_views.tool_of
        self._clicks = Clicks(viser_server.server, drive, tool_of, link, self._floor_z_m)
        self._explanations = Explanations(
            self.model, link, self._browser_views, self.follow, state_feed.show
        )
        self._changed: set[Part] = set()
        self._fetching = False
        self._fetched_at = -FETCH_S
        self._gaps = MapGaps(lambda: link.openings, inbox)
        self._unread = ""
        self._drawn_at = self._noticed_at = self._pictured_at = 0.0
        self._told_rejects = 0
        self._recorder_heard_s = 0.0
        self._fetcher = ThreadPoolExecutor(max_workers=1, thread_name_prefix="keyframe")
        self._places = PlaceRequests(link)
        self._stop = threading.Event()
        self._thread = critical_thread("scene thread", self._run, on_failure)
        viser_server.server.on_client_connect(self._joined)
        viser_server.server.on_client_disconnect(self._left)

    def start(self) -> None:
        """Begin."""
        self._notice(time.monotonic())
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._stop.set()
        self._inbox.wake()
        self._thread.join(timeout=5.0)
        self._places.close()
        self._fetcher.shutdown(wait=False, cancel_futures=True)

    def _run(self) -> None:
        while not self._stop.is_set():
            for key, payload in self._inbox.drain(DRAW_S):
                self._take(key, payload)
            self._fetch_if_needed()
            pointed = self._state_feed.scene
            self._explanations.step(self._clicks.questions(), pointed.looks(), self._fetcher)
            for browser in pointed.framings():
                for view in self._browser_views.of(browser):
                    self.follow.frame_map(view.client)
            pointed.answer_hovers(self._name)
            pointed.answer_choices(self._browser_views.click_choice)
            exports = self._state_feed.exports
            self._places.step(self.model, exports.plan_asked_s, again=exports.take_names_changed())
            exports.fill(self.model, self._link.say)
            now = time.monotonic()
            if now - self._drawn_at >= DRAW_S:
                self._drawn_at = now
                self._draw()
            if now - self._noticed_at >= NOTICE_S:
                self._notice(now)

    def _take(self, key: str, payload: bytes) -> None:
        # In a review only those come that are needed.
        is_whole = key == keys.MAP_KEYFRAME and not self._link.recorded
        if is_whole and not self.model.needs_keyframe:
            return
        is_read = self.reader.feed(key, payload)
        if is_whole and not self._gaps.are_filled():
            # Something was missed between the request and this reply.
            self.model.needs_keyframe = True
        if is_read and key == keys.EVENT:
            self._detection.hear(self.model.events[-1], time.monotonic())
        if key == keys.RECORDING:
            self._recorder_heard_s = time.monotonic()
        if key == keys.STATUS:
            self._unread = ""
            if not is_read:
                problem = self.reader.problem or ""
                self._unread = not_understood(payload, problem, self._link.say)
        if not is_read:
            total = self.reader.rejected.total()
            if total >= 2 * self._told_rejects:
                self._told_rejects = max(total, 1)
                logger.warning("%d messages skipped, the last one %s", total, self.reader.problem)

    def _fetch_if_needed(self) -> None:
        if self._gaps.are_new():
            self.model.needs_keyframe = True
        now = time.monotonic()
        if self._fetching or not self._link.is_open or now - self._fetched_at < FETCH_S:
            return
        missing = self._missing()
        if missing:
            self._fetching = True
            self._fetched_at = now
            self._fetcher.submit(self._fetch, missing)

    def _missing(self) -> list[str]:
        """Return the topics whose last message was published before the console subscribed."""
        status, table = self.model.status, self.model.proximity
        if status is None:
            return []
        goal = status.goal
        wanted = goal is not None and (table is None or table.goal_id != goal.goal_id)
        return [*_WITH_THE_MAP] * self.model.needs_keyframe + [keys.LEVELS] * wanted

    def _fetch(self, topics: list[str]) -> None:
        try:
            for topic in topics:
                asked_at = self._gaps.now()
                payload = self._link.query(topic)
                if payload is not None:
                    if topic == keys.MAP_KEYFRAME:
                        self._gaps.note_fetched(asked_at)
                    self._inbox.put(topic, payload)
        finally:
            self._fetching = False

    def _floor_z_m(self) -> float:
        return self.model.floor_z_m

    def _name(self, hover: Hover) -> str:
        views = self._browser_views.of(hover.browser)
        return name_under(self.model, views, hover, self._link.say)

    def _draw(self) -> None:
        changed = self.model.take_changes() | self._changed
        self._changed.clear()
        limited = self._limit_image_rate(changed)
        if limited:
            self._tabs.update(self.model, limited)
        self._browser_views.draw(self.model, limited)
        if changed & CAMERA_PARTS:
            self._state_feed.camera.show_scene(camera_scene(self.model, self._link.say))
        bounds = self._browser_views.bounds() if "voxels" in changed else None
        self.follow.step(bounds, self.model.floor_z_m)

    def _limit_image_rate(self, changed: frozenset[Part]) -> frozenset[Part]:
        """Delay the camera image of scene and panel while the last one is recent.

        viser's client drops a texture that is not decoded before the next one arrives: a slow
        browser would never show one.
        """
        if "image" not in changed:
            return changed
        if self._drawn_at - self._pictured_at >= PICTURE_S:
            self._pictured_at = self._drawn_at
            return changed
        self._changed.add("image")
        return changed - {"image"}

    def _forget_ended_recorders(self, now: float) -> None:
        """Show no recording that nobody writes any more; one that failed stays."""
        recorders = self.model.recorders
        if now - self._recorder_heard_s < RECORDER_S or not recorders.statuses:
            return
        if all(one.state != "failed" for one in recorders.statuses):
            recorders.clear()
            self._changed.add("recording")

    def _notice(self, now: float) -> None:
        self._noticed_at = now
        self._forget_ended_recorders(now)
        self._state_feed.goals = msgspec.json.encode(goal_list(self.model))
        self._call_people(now)
        self._state_feed.post(msgspec.json.encode(self._shell_state()))

    def _call_people(self, now: float) -> None:
        if self._calls is None:
            return
        model = self.model
        recordings = model.recorders.statuses
        if model.status is not None:
            self._calls.follow(model.status)
        occasions = self._detection.step(model.status, recordings, self._link.silence_s(), now)
        self._calls.step(occasions, now, time.time_ns(), self._detection.holding)
        self._state_feed.calls = msgspec.json.encode(self._calls.shown())

    def _shell_state(self) -> ShellState:
        link, feed, status = self._link, self._state_feed, self.model.status
        if status is None or self._unread:
            return waiting_state(self._instance, link, self._unread)
        link.drive_status, link.lease_status = status.drive, link.lease_in(status)
        return shell_state(
            status,
            link,
            self.model.unfound.latest,
            instance=self._instance,
            has_map=self.model.voxels.count > 0,
            explanation=self._explanations.now,
            goals=zlib.crc32(feed.goals),
            calls=zlib.crc32(feed.calls),
        )

    async def _joined(self, client: viser.ClientHandle) -> None:
        self._browser_views.join(client, acting_browser())

    async def _left(self, client: viser.ClientHandle) -> None:
        self._browser_views.leave(client)
