"""The processes of a demo: started in order, supervised, and ended together."""

import queue
import re
import shlex
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import httpx2
import zenoh

from app.errors import DemoError
from app.links.network.requests import RequestRefusedError, ask, last_message
from app.links.network.session import LinkError, open_client
from app.messages import keys
from app.messages.control import SearchAccepted, SearchRequest, decode
from app.messages.recording import RecordingStatus
from app.nodes.console.config import PASSWORD_VARIABLE
from app.process.children import PROGRAM, Child, free_port, port_is_free, wait_for_end

REQUESTER: Final = "ippon demo"
FIRST_PAGE_PORT: Final = 8080
FIRST_LINK_PORT: Final = 7447
TRIES: Final = 10
"""Ports to try when other programs take each one between its check and its use."""
READY_S: Final = 300.0
"""Time for the navigator's start, which compiles every kernel at the first time."""
PAGE_S: Final = 60.0
LONGEST_NAME: Final = 60
EXIT_USAGE: Final = 2
OPTIONAL: Final = frozenset({"console", "recorder"})
"""Processes whose end does not end the demo."""


class _PortTakenError(Exception):
    """Another program took the port after it was checked."""


class DemoProcesses:
    """Child processes of one demo, and the session to its navigator.

    Args:
        robot: Key prefix.
        endpoint: zenoh endpoint of the navigator; set by `start_navigator`.
        page_port: Port of the page; set by `start_console`.
    """

    def __init__(
        self, robot: str, endpoint: str = "", page_port: int = 0, language: str = "en"
    ) -> None:
        self.language = language
        self.robot = robot
        self.endpoint = endpoint
        self.page_port = page_port
        self.children: list[Child] = []
        self.recorder: Child | None = None
        self.recorded: str | None = None
        """Folder of the recording; None without one."""
        self._session: zenoh.Session | None = None
        self._console: Child | None = None

    @property
    def session(self) -> zenoh.Session:
        """Session to the navigator, open after `start_navigator`."""
        assert self._session is not None, "start_navigator() comes first"
        return self._session

    def close(self) -> None:
        """End the processes, the last one started first."""
        self._close_session()
        for child in reversed(self.children):
            child.stop()

    def start_navigator(
        self, arguments: Sequence[str], beside: Callable[[], None] | None = None
    ) -> None:
        """Start the navigator at a free port and wait until it is ready.

        Args:
            arguments: Arguments of `ippon navigate`, without endpoint and prefix.
            beside: Called as soon as the endpoint is known, to start what connects to it.

        Raises:
            DemoError: It ended, was not ready in time, or found no port.
        """
        first = FIRST_LINK_PORT
        for _ in range(TRIES):
            port = free_port(first)
            try:
                self._try_navigator(arguments, port, beside)
            except _PortTakenError:
                self._close_session()
                self._end_console()
                first = port + 1
            else:
                return
        raise DemoError(f"no port for the navigator: {TRIES} were taken one after the other")

    def begin_console(self, wanted: int | None, first: int = FIRST_PAGE_PORT) -> None:
        """Start the console's process, which waits for the navigator.

        Args:
            wanted: Port of the page; None for the first free one.
            first: The first port to try.
        """
        self.page_port = wanted or free_port(first)
        where = ["--connect", self.endpoint, *self._page(self.page_port)]
        # A login would keep the demo from asking whose page it is.
        self._console = self._start("console", ["console", *where], {PASSWORD_VARIABLE: ""})

    def start_console(self, wanted: int | None) -> str:
        """Start the console, if it was not begun, and return the address of its page.

        Args:
            wanted: Port of the page; None for the first free one.

        Raises:
            DemoError: It ended, did not answer in time, or the port was taken.
        """
        first = FIRST_PAGE_PORT
        for _ in range(TRIES):
            if self._console is None:
                self.begin_console(wanted, first)
            try:
                self._await_page(self.page_port)
            except _PortTakenError:
                self._console = None
                if wanted is not None:
                    raise DemoError(f"port {wanted} was taken in the meantime") from None
                first = self.page_port + 1
            else:
                return f"http://127.0.0.1:{self.page_port}"
        raise DemoError(f"no port for the page: {TRIES} were taken one after the other")

    def start_recorder(self, root: Path | None) -> str | None:
        """Start the recorder; return the folder of the recording, None if it cannot record.

        Args:
            root: Folder of the sessions; None for the default.
        """
        where = () if root is None else ("--out", str(root.absolute()))
        child = self._start("recorder", ["record", "--connect", self.endpoint, *where])
        self.recorder = child
        deadline = time.monotonic() + PAGE_S
        while time.monotonic() < deadline and wait_for_end([child], 0.0) is None:
            payload = last_message(self.session, self._key(keys.RECORDING), 0.5)
            if payload is not None:
                status = decode(payload, RecordingStatus)
                if status.state == "recording":
                    self.recorded = status.session
                    return self.recorded
                if status.state == "failed":
                    break
            time.sleep(0.05)
        return None

    def start_robot(self, arguments: Sequence[str]) -> None:
        """Start the simulated robot.

        Args:
            arguments: Arguments of `ippon sim`, without endpoint and prefix.
        """
        self._start("robot", ["sim", *arguments, "--connect", self.endpoint])

    def status_updates(self) -> "queue.SimpleQueue[bytes]":
        """Return a queue that receives every status of the navigator; it must be read."""
        updates: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self.session.declare_subscriber(
            self._key(keys.STATUS), lambda sample: updates.put(sample.payload.to_bytes())
        )
        return updates

    def search(self, wanted: str, context: str) -> int:
        """Start a search and return the number of its goal.

        Raises:
            DemoError: The navigator refused or did not reply.
        """
        request = SearchRequest(object=wanted, context=context, requester=REQUESTER)
        try:
            accepted = ask(
                self.session, self._key(keys.SEARCH), request, SearchAccepted, timeout_s=10.0
            )
        except (LinkError, RequestRefusedError) as error:
            raise DemoError(str(error)) from error
        return accepted.goal_id

    def supervise(self) -> Iterator[str]:
        """Yield the name of each optional process that ends.

        Raises:
            DemoError: Another process ended.
        """
        watched = list(self.children)
        while True:
            ended = wait_for_end(watched, 1.0)
            if ended is None:
                continue
            if ended.name not in OPTIONAL:
                raise DemoError(
                    f"the {ended.name} ended with status {ended.ended()}; see its log above"
                )
            watched.remove(ended)
            yield ended.name

    def console_command(self) -> str:
        """Return the command that restarts the console, from any folder."""
        where = ("--connect", self.endpoint, "--robot", self.robot)
        return shlex.join([*PROGRAM, "console", *where, *self._page(self.page_port)])

    def _page(self, port: int) -> list[str]:
        language = [] if self.language == "en" else ["--language", self.language]
        return [*language, "--port", str(port)]

    def _key(self, topic: str) -> str:
        return f"{self.robot}/{topic}"

    def _start(
        self, name: str, arguments: Sequence[str], environment: Mapping[str, str] | None = None
    ) -> Child:
        child = Child(name, [*arguments, "--robot", self.robot], environment)
        self.children.append(child)
        return child

    def _close_session(self) -> None:
        if self._session is not None:
            self._session.close()  # pyright: ignore[reportUnknownMemberType]
            self._session = None

    def _end_console(self) -> None:
        if self._console is not None:
            self._console.stop()
            self.children.remove(self._console)
            self._console = None

    def _try_navigator(
        self, arguments: Sequence[str], port: int, beside: Callable[[], None] | None
    ) -> None:
        self.endpoint = f"tcp/127.0.0.1:{port}"
        child = self._start("navigator", ["navigate", "--listen", self.endpoint, *arguments])
        if beside is not None:
            beside()
        deadline = time.monotonic() + READY_S
        while time.monotonic() < deadline:
            self._check_running(child, port)
            try:
                self._session = self._session or open_client(self.endpoint, 0.5)
            except LinkError:
                continue
            # A navigator of another robot at this endpoint does not answer.
            if last_message(self._session, self._key(keys.LABELS), 0.5) is not None:
                return
        raise DemoError(
            f"the navigator was not ready within {READY_S:g} s: this machine is slow or busy; "
            "start the demo again, what is compiled is kept"
        )

    def _await_page(self, port: int) -> None:
        assert self._console is not None, "begin_console() comes first"
        deadline = time.monotonic() + PAGE_S
        with httpx2.Client(base_url=f"http://127.0.0.1:{port}", timeout=1.0) as client:
            while time.monotonic() < deadline:
                self._check_running(self._console, port)
                if _page_is_of(self.robot, client):
                    return
        raise DemoError(f"the console did not answer at port {port} within {PAGE_S:g} s")

    def _check_running(self, child: Child, port: int) -> None:
        if wait_for_end([child], 0.1) is None:
            return
        if child.ended() == EXIT_USAGE and not port_is_free(port):
            self.children.remove(child)
            raise _PortTakenError
        raise DemoError(f"the {child.name} ended during its start; see its log above")


def prefix_part(name: str) -> str:
    """Return a name as a part of a key prefix: letters, digits, '_', '.' and '-'."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", name)[:LONGEST_NAME] or "home"


def _page_is_of(robot: str, client: httpx2.Client) -> bool:
    """Return whether the page shows this robot; another demo's console may have the port."""
    try:
        answer = client.get("/health")
        return answer.is_success and answer.json()["state"].get("robot") == robot
    except (httpx2.HTTPError, ValueError, KeyError, AttributeError, TypeError):
        return False
