"""The navigators on a router, asked for while a page lists them."""

import threading
import time
from typing import Final, Literal

import msgspec
import zenoh

from app.links.fleet.navigators import Question, ask_each, live_navigators
from app.links.network.session import LinkError, open_client
from app.links.network.topic_listener import CONNECT_S
from app.messages import keys
from app.messages.control import decode
from app.messages.status import Status
from app.nodes.console.fleet.robot_paths import path_of
from app.view.shown_state import shown_state
from app.view.spoken import spoken
from app.view.words import ENGLISH, Words
from ippon.vocabulary import in_words

FRESH_S: Final = 1.0
"""Time for which one answer serves all pages."""


class ListedRobot(msgspec.Struct, frozen=True, kw_only=True):
    """One robot in the list."""

    name: str
    path: str
    """Of its page."""
    link: Literal["live", "silent", "gone", "twice"]
    """`silent`: its navigator is there and does not answer; `gone`: it was there; `twice`: two
    navigators have this name."""
    state: str | None = None
    why: str = ""
    object: str = ""
    waiting: int = 0
    """Goals that wait."""
    holder: str = ""
    """Who has control; empty for nobody."""
    round_trip_ms: float | None = None
    """Time from question to answer."""
    seen_s: float = 0.0
    """Time since it was heard last."""


class RobotsShown(msgspec.Struct, frozen=True, kw_only=True):
    """All robots on the router."""

    robots: list[ListedRobot]
    problem: str = ""


class RobotList:
    """Asks the router for liveliness tokens and each navigator for its status; from any thread.

    Nothing is subscribed: while no page lists the robots, they cost nothing.

    Args:
        endpoint: Of the router.
        say: The words.
    """

    def __init__(self, endpoint: str, say: Words = ENGLISH) -> None:
        self._words = say
        self._endpoint = endpoint
        self._lock = threading.Lock()
        self._session: zenoh.Session | None = None
        self._shown = RobotsShown(robots=[])
        self._asked_s = -FRESH_S
        self._heard: dict[str, tuple[float, ListedRobot]] = {}
        """When each robot was heard last, and what was shown of it."""

    def shown(self) -> RobotsShown:
        """Return the robots as they are now, or were within `FRESH_S`."""
        with self._lock:
            if time.monotonic() - self._asked_s >= FRESH_S:
                try:
                    self._shown = RobotsShown(robots=self._ask())
                except (LinkError, zenoh.ZError) as error:
                    self._close()
                    robots = [self._unheard(name, "gone") for name in sorted(self._heard)]
                    problem = self._words.said(str(error))
                    self._shown = RobotsShown(robots=robots, problem=problem)
                self._asked_s = time.monotonic()
            return self._shown

    def knows(self, robot: str) -> bool:
        """Return whether a navigator of this name is, or was, on the router."""
        self.shown()
        with self._lock:
            return robot in self._heard

    def close(self) -> None:
        """Close the session."""
        with self._lock:
            self._close()

    def _ask(self) -> list[ListedRobot]:
        session = self._open()
        names = live_navigators(session)
        questions = {name: Question(f"{name}/{keys.STATUS}") for name in names}
        answers = ask_each(session, questions)
        now = time.monotonic()
        shown: list[ListedRobot] = []
        for name in names:
            replies = answers[name].payloads
            if replies:
                one = _listed(name, replies, self._words)
                self._heard[name] = (now, one)
                shown.append(one)
            else:
                shown.append(self._unheard(name, "silent"))
        gone = [name for name in self._heard if name not in names]
        return [*shown, *(self._unheard(name, "gone") for name in sorted(gone))]

    def _unheard(self, name: str, link: Literal["silent", "gone"]) -> ListedRobot:
        now = time.monotonic()
        nothing = ListedRobot(name=name, path=path_of(name), link=link)
        at, last = self._heard.setdefault(name, (now, nothing))
        return msgspec.structs.replace(
            last, link=link, round_trip_ms=None, seen_s=round(now - at, 1)
        )

    def _open(self) -> zenoh.Session:
        session = self._session
        if session is None or not session.info.routers_zid():
            self._close()
            session = self._session = open_client(self._endpoint, CONNECT_S)
        return session

    def _close(self) -> None:
        if self._session is not None:
            self._session.close()  # pyright: ignore[reportUnknownMemberType]
        self._session = None


def _listed(name: str, replies: list[tuple[float, bytes]], say: Words) -> ListedRobot:
    after_s, payload = replies[0]
    one = ListedRobot(
        name=name,
        path=path_of(name),
        link="live" if len(replies) == 1 else "twice",
        round_trip_ms=round(1e3 * after_s, 1),
    )
    try:
        status = spoken(decode(payload, Status), say)
    except msgspec.DecodeError as error:
        return msgspec.structs.replace(one, why=say("robots.unreadable", problem=str(error)[:200]))
    goal = status.goal
    holder = status.lease.holder
    return msgspec.structs.replace(
        one,
        state=shown_state(status),
        why=status.why,
        object="" if goal is None else in_words(goal.display or goal.object),
        waiting=len(status.queue),
        holder=holder,
    )
