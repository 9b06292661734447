"""Network link to the navigator: receives topics, sends requests, and reconnects."""

import asyncio
import logging
import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from functools import partial
from typing import Final, TypeVar

import msgspec
import zenoh

from app.links.network.inbox import Inbox
from app.links.network.requests import RequestRefusedError, ask
from app.links.network.session import LinkError, open_client
from app.links.network.topic_listener import CONNECT_S, TopicListener
from app.messages import keys
from app.messages.control import Accepted, ControlReply, ControlRequest, M, encode
from app.messages.driving import DriveModeName, DriveRequest, DriveStatus, TeleopTag
from app.messages.lease import LeaseReply, LeaseRequest, LeaseStatus, TakeRequest, sender_of
from app.messages.motion import StampedTwist, encode_twist
from app.messages.status import Status
from app.nodes.console.critical_thread import OnFailure, critical_thread
from app.nodes.console.link.commands import CommandError, LeaseAction
from app.nodes.console.link.panel_requests import REQUESTER, PanelRequests
from app.nodes.console.web.browsers import Browser, acting_browser
from app.nodes.console.web.permissions import (
    may_command,
    may_use_panels,
    request_refusal,
    take_refusal,
)
from app.view.spoken import spoken
from app.view.words import ENGLISH, Words
from ippon.control.drive_mode import TeleopInput

logger = logging.getLogger(__name__)

REPLY_S: Final = 2.0
STOP_S: Final = 5.0
"""How long a Stop is retried while the navigator cannot be reached."""
_STOP_PAUSE_S: Final = 0.1
_STOPS: Final = 4
"""Stops that wait for their replies at the same time."""
_LEASES: Final = 4
"""Commands about the lease that do so, the renewals of all pages among them."""
_RETRY_S: Final = 0.5
_T = TypeVar("_T")


class NavigatorLink(PanelRequests):
    """Two zenoh sessions, one to listen and one for commands, so that map data cannot delay a Stop.

    The commanding session stays open while a router answers: silence alone does not close it.
    """

    def __init__(
        self,
        endpoint: str,
        robot: str,
        topics: Iterable[str],
        inbox: Inbox,
        on_failure: OnFailure,
        say: Words = ENGLISH,
        *,
        is_awaited: bool = False,
    ) -> None:
        self.say = say
        self.is_awaited = is_awaited
        """The command that started the console starts the navigator as well."""
        self.is_compiling = False
        """The navigator is there, and compiles before it takes requests."""
        self.endpoint = endpoint
        self.robot = robot
        self.problem = ""
        """Why the sessions could not be opened."""
        self.drive_status = DriveStatus()
        """Last drive status from the navigator, with the top speeds for manual drive."""
        self.lease_status = LeaseStatus()
        """Last control lease from the navigator."""
        self._input_seq = 0
        self._input_publisher: zenoh.Publisher | None = None
        self._listener = TopicListener(endpoint, robot, topics, inbox.put)
        self._commanding: zenoh.Session | None = None
        # Threads of their own: those of the event loop may all wait for other replies, and without
        # its renewals a lease ends.
        self._stops = ThreadPoolExecutor(_STOPS, thread_name_prefix="stop")
        self._leases = ThreadPoolExecutor(_LEASES, thread_name_prefix="lease")
        self._stop = threading.Event()
        self._thread = critical_thread("link", self._keep_open, on_failure)

    def start(self) -> None:
        """Open the sessions, in the background and for as long as it takes."""
        self._thread.start()

    def close(self) -> None:
        """Close the sessions."""
        self._stop.set()
        self._thread.join(timeout=5.0)
        for pool in (self._stops, self._leases):
            pool.shutdown(wait=False, cancel_futures=True)
        self._close_sessions()

    @property
    def is_open(self) -> bool:
        """Whether a router answers at the endpoint."""
        return self._listener.is_open

    @property
    def openings(self) -> int:
        """How often the link was opened or broke; each time, messages may have been missed."""
        return self._listener.openings

    def silence_s(self) -> float:
        """Return how long ago the navigator was heard last, or the console was started."""
        return self._listener.silence_s()

    def query(self, topic: str) -> bytes | None:
        """Ask for the last message of a topic; None when nobody answers."""
        return self._listener.query(topic)

    # Methods of `Controller` and `Actions`:

    async def control(self, request: ControlRequest) -> str:
        """Send a control request and return the resulting state."""
        if request.action != "stop":
            return await asyncio.to_thread(self._control, request)
        return await _run_in(self._stops, partial(self._control, request))

    async def drive(self, mode: DriveModeName) -> str:
        """Set the drive mode; the speed limit stays."""
        return await asyncio.to_thread(self.set_drive, mode)

    async def lease(self, action: LeaseAction, requester: str = "") -> LeaseReply:
        """Request, renew, release, grant, deny or take control for the acting browser."""
        return await _run_in(self._leases, partial(self._lease, action, requester))

    def lease_in(self, status: Status) -> LeaseStatus:
        """Return the control lease that the pages show."""
        return status.lease

    def may_use_panels(self, browser: Browser) -> bool:
        """Return whether a browser may use the panels: no other browser has control."""
        return may_use_panels(browser, self.lease_status)

    def send_input(self, held: TeleopInput) -> None:
        """Send the keys that an operator holds down; input that is not sent counts as released."""
        tops, publisher, browser = self.drive_status, self._input_publisher, acting_browser()
        if publisher is None or browser is None or not may_command(browser):
            return
        twist = StampedTwist(
            stamp_ns=time.time_ns(),
            linear_m_s=held.forward * tops.top_linear_m_s,
            yaw_rate_rad_s=held.turn * tops.top_yaw_rate_rad_s,
            tilt_rate_rad_s=held.tilt * tops.top_tilt_rate_rad_s,
        )
        # By the clock, as two consoles may serve one session: counts of their own would make the
        # navigator drop the keys of one of them.
        self._input_seq = max(self._input_seq + 1, time.time_ns() // 1_000_000)
        sender = sender_of(browser.session)
        tag = TeleopTag(sender=sender, epoch=browser.epoch, seq=self._input_seq)
        try:
            publisher.put(encode_twist(twist), attachment=encode(tag))
        except zenoh.ZError as error:
            logger.warning("a manual drive command could not be sent: %s", error)

    def set_drive(self, mode: DriveModeName | None = None, speed_limit: float | None = None) -> str:
        """Set the drive mode, the speed limit or both; what is None stays."""
        browser = acting_browser()
        if mode not in (None, "auto") and browser is not None and browser.standing != "holds":
            # Manual drive needs the lease, so request it first.
            reply = self._lease("request")
            if reply.standing != "holds":
                raise CommandError(reply.detail)
        request = DriveRequest(mode=mode, speed_limit=speed_limit)
        return self._request(keys.DRIVE, request, Accepted).detail

    def pause(self) -> str:
        """Pause the robot."""
        self._control(ControlRequest(action="pause", requester=REQUESTER))
        return self.say("reply.paused")

    def resume(self) -> str:
        """Resume after a pause or a stop."""
        self._control(ControlRequest(action="resume", requester=REQUESTER))
        return self.say("reply.resumed")

    def cancel(self) -> str:
        """End the current search."""
        self._control(ControlRequest(action="cancel", requester=REQUESTER))
        return self.say("reply.ended")

    def _lease(self, action: LeaseAction, requester: str = "") -> LeaseReply:
        browser = acting_browser()
        if browser is None:
            raise CommandError(self.say("refusal.page"))
        if action == "take":
            refusal = take_refusal(browser, self.say)
            if refusal:
                raise CommandError(refusal)
            reply = self._request(keys.LEASE_TAKE, TakeRequest(), LeaseReply)
        else:
            request = LeaseRequest(action=action, requester=requester)
            reply = self._request(keys.LEASE, request, LeaseReply)
        browser.update_lease(reply)
        return reply

    def _control(self, request: ControlRequest) -> str:
        deadline = time.monotonic() + (STOP_S if request.action == "stop" else 0.0)
        while True:
            try:
                return self._request(keys.CONTROL, request, ControlReply).state
            except _UndeliveredError:
                if time.monotonic() >= deadline or self._stop.wait(_STOP_PAUSE_S):
                    raise

    def _request(
        self, topic: str, message: msgspec.Struct, kind: type[M], timeout_s: float | None = None
    ) -> M:
        session, browser = self._commanding, acting_browser()
        refusal = "" if browser is None else request_refusal(browser, message, self.say)
        if refusal:
            raise CommandError(refusal)
        if session is None:
            raise _UndeliveredError(self.say("refusal.nobody", endpoint=self.endpoint))
        try:
            who = browser.credential() if browser is not None else None
            reply = ask(session, self._key(topic), message, kind, timeout_s or REPLY_S, who)
        except RequestRefusedError as error:
            raise CommandError(self.say.said(str(error))) from error
        except LinkError as error:
            raise _UndeliveredError(self.say.said(str(error))) from error
        except zenoh.ZError as error:
            raise _UndeliveredError(self.say("refusal.unsent", error=error)) from error
        return spoken(reply, self.say)

    def _key(self, topic: str) -> str:
        return f"{self.robot}/{topic}"

    def _keep_open(self) -> None:
        while not self._stop.is_set():
            self._check_sessions()
            self._stop.wait(_RETRY_S)

    def _check_sessions(self) -> None:
        try:
            if self._commanding is None or not _has_router(self._commanding):
                self._open_commanding()
            self._listener.check()
            is_silent = self.silence_s() > _RETRY_S
            self.is_compiling = is_silent and self._listener.has_token(keys.NAVIGATOR_STARTING)
            self.problem = ""
        except (LinkError, zenoh.ZError) as error:
            # A navigator that is being started does not answer yet.
            if str(error) != self.problem and not self.is_awaited:
                logger.warning("not connected to the navigator: %s", error)
            self.problem = str(error)

    def _open_commanding(self) -> None:
        self._input_publisher = None
        self._commanding = _closed(self._commanding)
        self._commanding = open_client(self.endpoint, CONNECT_S)
        self._input_publisher = self._commanding.declare_publisher(
            self._key(keys.TELEOP),
            priority=zenoh.Priority.REAL_TIME,
            congestion_control=zenoh.CongestionControl.DROP,
            express=True,
        )

    def _close_sessions(self) -> None:
        self._input_publisher = None
        self._listener.close()
        self._commanding = _closed(self._commanding)


class _UndeliveredError(CommandError):
    """The navigator did not reply; unlike a refusal, a retry may succeed."""


async def _run_in(pool: ThreadPoolExecutor, call: Callable[[], _T]) -> _T:
    """Await a call in a thread of a pool, on behalf of the acting browser."""
    context = copy_context()
    return await asyncio.get_running_loop().run_in_executor(pool, context.run, call)


def _has_router(session: zenoh.Session) -> bool:
    return bool(session.info.routers_zid())


def _closed(session: zenoh.Session | None) -> None:
    if session is not None:
        session.close()  # pyright: ignore[reportUnknownMemberType]
