"""A search in a simulated home whose processes and link can be disturbed."""

import contextlib
import os
import signal
import time

import msgspec
import psutil

from app.links.network.requests import ask, last_message
from app.links.network.session import LinkError, open_client
from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.control import (
    ControlReply,
    ControlRequest,
    SearchAccepted,
    SearchRequest,
    decode,
)
from app.messages.motion import decode_twist
from app.messages.status import Status
from app.nodes.robot_sim import GroundTruth

STILL = 0.005


class FaultySearch:
    """Navigator, robot and watcher; `launch` starts processes of the product."""

    def __init__(self, launch, endpoint, folder, robot_endpoint=None):
        self._launch, self.endpoint, self._folder = launch, endpoint, folder
        self._robot_endpoint = robot_endpoint or endpoint
        self._session = None
        self._twists = []
        self.navigator = self.robot = None

    def start_navigator(self):
        """Start it, or its successor; return the time of the start."""
        began = time.monotonic()
        where = ("--listen", self.endpoint, "--robot", "r")
        self.navigator = self._launch(
            "navigate", *where, "--map", str(self._folder / "home.map"), "--resume"
        )
        return began

    def start_robot(self, home="3", start="0"):
        where = ("--connect", self._robot_endpoint, "--robot", "r")
        home = ("--home", home, "--start", start)
        self.robot = self._launch("sim", *where, *home, "--width", "160")

    @property
    def session(self):
        if self._session is None:
            self._session = open_client(self.endpoint, 60.0)
            subscribe(self._session, f"r/{keys.CMD_VEL}", self._watch)
        return self._session

    def _watch(self, payload):
        with contextlib.suppress(MessageError):
            twist = decode_twist(payload)
            if twist.linear_m_s or twist.yaw_rate_rad_s:
                self._twists.append(time.monotonic())

    def search(self, wanted, count=1):
        deadline = time.monotonic() + 120.0
        while self.status(1.0) is None:
            assert time.monotonic() < deadline
            time.sleep(0.1)
        request = SearchRequest(object=wanted, count=count)
        ask(self.session, f"r/{keys.SEARCH}", request, SearchAccepted, 20.0)

    def control(self, action):
        request = ControlRequest(action=action)
        return ask(self.session, f"r/{keys.CONTROL}", request, ControlReply, 10.0).state

    def status(self, timeout_s=3.0):
        payload = last_message(self.session, f"r/{keys.STATUS}", timeout_s)
        return None if payload is None else decode(payload, Status)

    def truth(self):
        """Return the robot's truth; it is asked again while the link is disturbed."""
        deadline = time.monotonic() + 60.0
        while (payload := last_message(self.session, f"r/{keys.SIM_TRUTH}", 5.0)) is None:
            assert time.monotonic() < deadline, "the robot does not answer"
            time.sleep(0.1)
        return msgspec.json.decode(payload, type=GroundTruth)

    def wait_for(self, test, timeout_s=60.0):
        """Return the first status that passes."""
        deadline = time.monotonic() + timeout_s
        status = None
        while True:
            with contextlib.suppress(LinkError):
                status = self.status()
            if status is not None and test(status):
                return status
            assert time.monotonic() < deadline, status
            time.sleep(0.1)

    def wait_until_moving(self, timeout_s=60.0):
        """Wait for a command that moves the robot; return when it came."""
        self.session  # noqa: B018
        since = time.monotonic()
        while not (later := [at for at in self._twists[-20:] if at > since]):
            assert time.monotonic() - since < timeout_s, "it does not move"
            time.sleep(0.02)
        return later[0]

    def memory_mb(self):
        return psutil.Process(self.navigator.child.pid).memory_info().rss / 1e6

    def close(self):
        if self._session is not None:
            self._session.close()


def coasted_s(truth):
    """Return the longest time that the base moved on after a command, in real time."""
    return max((age for v, w, age in truth.speeds if abs(v) > STILL or abs(w) > STILL), default=0.0)


def freeze(process, seconds):
    """Stop a process for a time, as a page fault or a debugger does."""
    os.kill(process.child.pid, signal.SIGSTOP)
    time.sleep(seconds)
    os.kill(process.child.pid, signal.SIGCONT)


def starve(process, seconds, share=0.15, period_s=0.1):
    """Let a process run for a share of each period only."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        freeze(process, (1.0 - share) * period_s)
        time.sleep(share * period_s)
