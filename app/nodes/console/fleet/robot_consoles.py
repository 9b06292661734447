"""The pages of all robots: each has its console, from its first visit until nobody looks."""

import asyncio
import logging
import threading
import time
from dataclasses import dataclass
from typing import Final

import msgspec
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.routing import Mount, Route
from starlette.types import Receive, Scope, Send

from app.messages.control import decode
from app.messages.lease import Credential
from app.nodes.console.fleet.goal_assignment import GoalAssignment, GoalToGive
from app.nodes.console.fleet.robot_console import RobotConsole
from app.nodes.console.fleet.robot_list import RobotList
from app.nodes.console.fleet.robot_paths import path_of, split_path
from app.nodes.console.web.browsers import Browser
from app.nodes.console.web.gateway import Gateway
from app.nodes.console.web.guard import read_body, refuse
from app.view.words import ENGLISH, Words

logger = logging.getLogger(__name__)

IDLE_S: Final = 60.0
"""Time after the last look at which the console of a robot is closed."""
CHECK_S: Final = 5.0
MAX_BODY: Final = 20_000
MAX_OPEN: Final = 8
"""Robots that can be looked at at once, besides the console's own: each draws its map."""


@dataclass(slots=True, kw_only=True)
class _Opened:
    console: RobotConsole
    gateway: Gateway
    app: Starlette
    used_s: float
    has_failed: bool = False


class RobotConsoles:
    """Serves /robot/NAME/ and the list of robots.

    Args:
        endpoint: Of the router.
        own: The console's own robot, whose page is also at /robot/NAME/.
        own_gateway: Serves it.
        say: The words.
    """

    def __init__(self, endpoint: str, own: str, own_gateway: Gateway, say: Words = ENGLISH) -> None:
        self._words = say
        self._endpoint, self._own = endpoint, own
        self._own_gateway = own_gateway
        self._list = RobotList(endpoint, say)
        self._goals = GoalAssignment(endpoint, own, say)
        self._lock = threading.Lock()
        self._open: dict[str, _Opened] = {}
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._check, name="robots", daemon=True)

    def start(self) -> None:
        """Begin to close what nobody looks at."""
        self._thread.start()

    def close(self) -> None:
        """Close all consoles."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(timeout=5.0)
        with self._lock:
            for opened in self._open.values():
                opened.console.close()
            self._open.clear()
        self._list.close()

    def routes(self) -> list[Route | Mount]:
        """Return the routes of the list and of the robots' pages."""
        return [
            Route("/api/robots", self._robots),
            Route("/api/robots/give", self._give, methods=["POST"]),
            Mount("/robot", self._serve),
        ]

    async def _robots(self, _: Request) -> Response:
        """Answer with all robots on the router, a `RobotsShown`."""
        shown = await asyncio.to_thread(self._list.shown)
        own = [
            msgspec.structs.replace(one, path="/") if one.name == self._own else one
            for one in shown.robots
        ]
        content = msgspec.json.encode(msgspec.structs.replace(shown, robots=own))
        return Response(
            content, media_type="application/json", headers={"Cache-Control": "no-store"}
        )

    async def _give(self, request: Request) -> Response:
        """Give a `GoalToGive` to the nearest free robot, and answer with a `GoalGiven`."""
        body = await read_body(request, MAX_BODY)
        if body is None:
            return PlainTextResponse("too long\n", status_code=413)
        try:
            goal = decode(body, GoalToGive)
        except msgspec.DecodeError as error:
            return PlainTextResponse(f"not a goal: {error}\n", status_code=400)
        browser: Browser = request.scope["browser"]

        def credential_of(robot: str) -> Credential:
            """Return the credential of the browser with its lease of a robot, if it has one."""
            if robot == self._own:
                return browser.credential()
            with self._lock:
                opened = self._open.get(robot)
            if opened is None:
                return Credential(session=browser.session, name=browser.name)
            return browser.twin(opened.console.browsers).credential()

        given = await asyncio.to_thread(self._goals.give, goal, browser, credential_of)
        return Response(msgspec.json.encode(given), media_type="application/json")

    async def _serve(self, scope: Scope, receive: Receive, send: Send) -> None:
        found = split_path(scope["path"])
        if found is None:
            await refuse("no such robot", 404, scope, receive, send)
            return
        robot, below = found
        if robot == self._own and below in ("", "/") and scope["type"] == "http":
            await RedirectResponse("/", status_code=303)(scope, receive, send)
            return
        if not below and scope["type"] == "http":
            await RedirectResponse(path_of(robot), status_code=303)(scope, receive, send)
            return
        opened = self._open.get(robot)
        if opened is None or opened.has_failed:
            # Only then in a thread: a Stop must not wait for the router or for another console.
            opened = await asyncio.to_thread(self._opened, robot)
        if isinstance(opened, str):
            await refuse(opened, 404, scope, receive, send)
            return
        opened.used_s = time.monotonic()
        browser = scope["browser"]
        inner = {
            **scope,
            "path": below,
            "raw_path": below.encode(),
            "root_path": "",
            "browser": browser and browser.twin(opened.console.browsers),
        }
        await opened.app(inner, receive, send)

    def _opened(self, robot: str) -> _Opened | str:
        """Return the console of a robot, opened if need be; why not, where that cannot be."""
        with self._lock:
            opened = self._open.get(robot)
            if opened is not None and not opened.has_failed:
                return opened
            if not self._list.knows(robot):
                return self._words("robots.unknown", name=robot, endpoint=self._endpoint)
            if opened is not None:
                self._open.pop(robot).console.close()
            if len(self._open) >= MAX_OPEN:
                return self._words("robots.most", n=MAX_OPEN, name=self._own)
            return self._begin(robot)

    def _begin(self, robot: str) -> _Opened:
        def fail(_: Exception) -> None:
            opened.has_failed = True

        console = RobotConsole(self._endpoint, robot, fail, say=self._words)
        gateway = self._own_gateway.beside(
            console.viser_server, console.state_feed, console.link, path_of(robot)
        )
        app = Starlette(routes=gateway.robot_routes())
        opened = _Opened(console=console, gateway=gateway, app=app, used_s=time.monotonic())
        self._open[robot] = opened
        console.start()
        logger.info("the page of robot %s is open", robot)
        return opened

    def close_idle(self) -> None:
        """Close the consoles that nobody has looked at for a while."""
        now = time.monotonic()
        idle: list[RobotConsole] = []
        with self._lock:
            for robot, opened in tuple(self._open.items()):
                if opened.gateway.open_sockets:
                    opened.used_s = now
                elif now - opened.used_s > IDLE_S:
                    logger.info("nobody looks at robot %s", robot)
                    idle.append(self._open.pop(robot).console)
        # Closing takes seconds.
        for console in idle:
            console.close()

    def _check(self) -> None:
        while not self._stop.wait(CHECK_S):
            self.close_idle()
