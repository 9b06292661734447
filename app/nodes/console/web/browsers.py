"""The browsers that use the console: name, role and lease of each."""

import asyncio
import secrets
import threading
from collections import OrderedDict
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Final, Literal, get_args

from app.messages.lease import Credential, LeaseReply

Role = Literal["viewer", "operator", "supervisor"]
Standing = Literal["holds", "waits", "denied", "watches"]
ROLES: Final[tuple[Role, ...]] = get_args(Role)

MAX_BROWSERS: Final = 1000
"""Browsers that are remembered; the one that was not seen for longest is forgotten."""


class Browser:
    """One browser: its name, its role, and its lease where it has one."""

    def __init__(self, session: str, name: str, role: Role) -> None:
        self.session = session
        """Known to the browser, this console and the navigator only: it stands for the lease."""
        self.name = name
        self.role: Role = role
        self.epoch = 0
        """Of the last lease that the navigator gave to this browser."""
        self.standing: Standing = "watches"
        """As the navigator said last."""
        self.detail = ""
        self.expires_s: float | None = None
        """Wall clock at which the login ends; None without one."""
        self.own_controls: set[str] = set()
        """Controls that change nothing but what this browser sees."""
        self._tasks: set[asyncio.Task[object]] = set()

    @property
    def has_lease_or_request(self) -> bool:
        """Whether a lease or a request for one is kept alive."""
        return self.standing in {"holds", "waits"}

    def update_lease(self, reply: LeaseReply) -> None:
        """Remember how this one stands."""
        self.standing, self.detail = reply.standing, reply.detail
        if reply.standing == "holds":
            self.epoch = reply.epoch

    @contextmanager
    def present(self) -> Generator[None]:
        """Have the current task end with the login."""
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        try:
            yield
        finally:
            self._tasks.discard(task)

    def disconnect(self) -> None:
        """End whatever serves this one. Called in the event loop."""
        for task in list(self._tasks):
            task.cancel()

    def credential(self) -> Credential:
        """Return what a request of this browser carries."""
        return Credential(session=self.session, name=self.name, epoch=self.epoch)


class Browsers:
    """Every browser that was here; safe from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._known: OrderedDict[str, Browser] = OrderedDict()
        self._count = 0

    def get_or_add(self, session: str, name: str = "", role: Role = "supervisor") -> Browser:
        """Return the browser of a session, a new one where it was not seen before.

        Args:
            session: Drawn at random, kept by the browser.
            name: As the login knows it; without a login a number does.
            role: As the login knows it; without a login whoever sits at this machine may all.
        """
        with self._lock:
            browser = self._known.get(session)
            if browser is None:
                self._count += 1
                browser = Browser(session, name or f"browser {self._count}", role)
                self._known[session] = browser
                while len(self._known) > MAX_BROWSERS:
                    self._known.popitem(last=False)
            self._known.move_to_end(session)
            return browser

    def find(self, session: str) -> Browser | None:
        """Return the browser of a session, None for one that was never get_or_add."""
        with self._lock:
            return self._known.get(session)


def new_session() -> str:
    """Draw a session that nobody can guess."""
    return secrets.token_urlsafe(24)


_acting: ContextVar[Browser | None] = ContextVar("acting_browser", default=None)


def acting_browser() -> Browser | None:
    """Return the browser whose click or key is being answered, None for nobody's."""
    return _acting.get()


def set_acting_browser(browser: Browser | None) -> None:
    """Answer in a browser's name from here on, in this task and what it starts."""
    _acting.set(browser)
