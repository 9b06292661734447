"""The browsers that use the console: name, role and lease of each."""

import asyncio
import math
import secrets
import threading
import time
from collections import OrderedDict
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Final, Literal, get_args

from app.messages.lease import Credential, LeaseReply
from app.view.view_options import ViewOptions

Role = Literal["viewer", "operator", "supervisor"]
Standing = Literal["holds", "waits", "denied", "watches"]
ROLES: Final[tuple[Role, ...]] = get_args(Role)

MAX_BROWSERS: Final = 1000
"""Maximum number of stored browsers; the least recently seen one is removed."""


class Browser:
    """One browser: its name, role and lease."""

    def __init__(self, session: str, name: str, role: Role) -> None:
        self.session = session
        """Secret shared by the browser, this console and the navigator; it identifies the lease."""
        self.name = name
        self.role: Role = role
        self.epoch = 0
        """Epoch of the last lease that this browser had."""
        self.standing: Standing = "watches"
        """Standing in the navigator's last reply."""
        self.detail = ""
        self.has_light_theme = False
        """Theme of its pages, as the last of them said."""
        self.expires_s: float | None = None
        """Monotonic time at which the login ends; None without one."""
        self.draft: tuple[str, str, str] | None = None
        """What was typed last on the Search tab, as object, context and scenario; None for nothing.
        It stands there again when a page is loaded anew."""
        self.view = ViewOptions()
        """What was chosen last on the Map tab; it holds again when the line was broken."""
        self.own_controls: set[str] = set()
        """Controls that affect only this browser's view."""
        self._tasks: dict[asyncio.Task[object], float] = {}
        """Tasks that serve it, and the monotonic time of the start of each."""

    @property
    def has_lease_or_request(self) -> bool:
        """Whether a lease or a request for one is kept alive."""
        return self.standing in {"holds", "waits"}

    def update_lease(self, reply: LeaseReply) -> None:
        """Store the standing from a reply of the navigator."""
        self.standing, self.detail = reply.standing, reply.detail
        if reply.standing == "holds":
            self.epoch = reply.epoch

    @contextmanager
    def present(self) -> Generator[None]:
        """Leave this context when the browser is disconnected."""
        task = asyncio.current_task()
        assert task is not None
        self._tasks[task] = time.monotonic()
        try:
            yield
        except asyncio.CancelledError:
            if task in self._tasks:
                raise
            task.uncancel()
        finally:
            self._tasks.pop(task, None)

    def disconnect(self, began_before_s: float = math.inf) -> None:
        """End what serves this browser. Called in the event loop.

        Args:
            began_before_s: What began later goes on; monotonic time.
        """
        for task, began_s in list(self._tasks.items()):
            if began_s < began_before_s:
                del self._tasks[task]
                task.cancel()

    def twin(self, browsers: "Browsers") -> "Browser":
        """Return this browser among those of another robot's pages; both end with the login."""
        twin = browsers.get_or_add(self.session, self.name, self.role)
        twin.expires_s = self.expires_s
        twin._tasks = self._tasks  # noqa: SLF001 - one class
        return twin

    def credential(self) -> Credential:
        """Return the credential for requests of this browser."""
        return Credential(session=self.session, name=self.name, epoch=self.epoch)


class Browsers:
    """All known browsers; safe from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._known: OrderedDict[str, Browser] = OrderedDict()
        self._count = 0

    def get_or_add(self, session: str, name: str = "", role: Role = "supervisor") -> Browser:
        """Return the browser of a session; a new one if the session is unknown.

        Args:
            session: Random text stored by the browser.
            name: Name of the login; by default a number.
            role: Role of the login; without a login, supervisor.
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
        """Return the browser of a session, None for an unknown session."""
        with self._lock:
            return self._known.get(session)


def new_session() -> str:
    """Return a new random session."""
    return secrets.token_urlsafe(24)


_acting: ContextVar[Browser | None] = ContextVar("acting_browser", default=None)


def acting_browser() -> Browser | None:
    """Return the browser whose request is being handled, None outside of a request."""
    return _acting.get()


def set_acting_browser(browser: Browser | None) -> None:
    """Set the acting browser of this task and of the tasks that it starts."""
    _acting.set(browser)
