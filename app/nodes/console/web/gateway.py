"""The public port: the page, viser's client, and the shell's WebSocket."""

import asyncio
import logging
import time
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from typing import Final

import msgspec
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import HTTPConnection, Request
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from app.messages.control import ControlRequest
from app.nodes.console.camera.camera_socket import serve_camera
from app.nodes.console.link.commands import CommandError, Controller
from app.nodes.console.scene.state_feed import StateFeed
from app.nodes.console.web.access import Access
from app.nodes.console.web.assets import Assets
from app.nodes.console.web.browsers import Browser, set_acting_browser
from app.nodes.console.web.guard import Guard, Hosts
from app.nodes.console.web.login import LoginPages
from app.nodes.console.web.shell_socket import serve_shell
from app.nodes.console.web.viser_proxy import pass_through
from app.nodes.console.web.viser_server import LoopbackViserServer
from app.view.exports import FILES

logger = logging.getLogger(__name__)

MAX_SOCKETS: Final = 192
"""Maximum number of sockets, three per page."""
_TRY_LATER: Final = 1013
_VIEW: Final = "view/?darkMode"


class Gateway:
    """Builds the ASGI application of one console."""

    def __init__(
        self,
        viser_server: LoopbackViserServer,
        state_feed: StateFeed,
        controller: Controller,
        access: Access,
        hosts: Hosts,
        login: LoginPages | None = None,
        assets: Assets | None = None,
        base: str = "/",
    ) -> None:
        """Create the application's parts.

        Args:
            viser_server: The scene's server.
            state_feed: State for the pages.
            controller: Handles commands of the pages.
            access: Identifies the browser of a request.
            hosts: Host names that the console answers to.
            login: Serves the login page, if there is one.
            assets: Files of the page; None reads them.
            base: Path of the page.
        """
        self._viser_server = viser_server
        self._state_feed = state_feed
        self._controller = controller
        self._access = access
        self._hosts = hosts
        self._login = login
        self.open_sockets = 0
        """Number of sockets of pages."""
        self._assets = assets or Assets()
        self._base = base
        self._shell_page = self._assets.shell_at(base)

    def beside(
        self,
        viser_server: LoopbackViserServer,
        state_feed: StateFeed,
        controller: Controller,
        base: str,
    ) -> "Gateway":
        """Return the gateway of another robot's page, with the same access."""
        return Gateway(
            viser_server, state_feed, controller, self._access, self._hosts,
            assets=self._assets, base=base,
        )  # fmt: skip

    def app(self) -> Starlette:
        """Return the application."""
        return Starlette(
            routes=[
                *(self._login.routes() if self._login is not None else ()),
                Route("/assets/{name}", self._asset),
                *self.robot_routes(),
            ],
            middleware=[Middleware(Guard, access=self._access, hosts=self._hosts)],
        )

    def robot_routes(self) -> list[Route | WebSocketRoute]:
        """Return the routes of one robot's page."""
        return [
            Route("/", self._shell),
            Route("/view", self._view_page),
            Route("/view/", self._view_page),
            Route("/health", self._health),
            Route("/api/pictures/{name}", self._picture),
            Route("/api/export/{name}", self._export),
            Route("/api/goals", self._goals),
            Route("/api/calls", self._calls),
            Route("/api/things", self._things),
            Route("/api/things/{number:int}", self._thing_picture),
            Route("/api/stop", self._stop, methods=["POST"]),
            WebSocketRoute("/view", self._view_socket),
            WebSocketRoute("/view/", self._view_socket),
            WebSocketRoute("/api/ws", self._shell_socket),
            WebSocketRoute("/api/camera", self._camera_socket),
        ]

    async def _shell(self, request: Request) -> Response:
        return self._shell_page.response(request)

    async def _asset(self, request: Request) -> Response:
        asset = self._assets.files.get(request.path_params["name"])
        if asset is None:
            return _text("no such file\n", 404)
        return asset.response(request)

    async def _view_page(self, request: Request) -> Response:
        if "websocket" in request.query_params or request.url.path != "/view/":
            # viser's client would connect to a server named in the URL.
            return RedirectResponse(f"{self._base}{_VIEW}", status_code=303)
        return self._assets.view.response(request)

    async def _health(self, _: Request) -> Response:
        notice = self._state_feed.notice
        state = {} if notice is None else msgspec.json.decode(notice)
        return JSONResponse(
            {
                "console": "stalled" if self._state_feed.is_stalled else "up",
                "link": state.get("link"),
                "state": state,
            }
        )

    async def _picture(self, request: Request) -> Response:
        jpeg = self._state_feed.picture(request.path_params["name"])
        if jpeg is None:
            return _text("no such picture\n", 404)
        return Response(jpeg, media_type="image/jpeg", headers={"Cache-Control": "no-store"})

    async def _export(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name not in FILES:
            return _text(f"no such file; there are {', '.join(FILES)}\n", 404)
        try:
            content = await self._state_feed.exports.order(name)
        except TimeoutError:
            return _text("the console does not respond; restart it\n", 503)
        if content is None:
            return _text(f"there is nothing to write into {name} yet\n", 404)
        headers = {
            "Cache-Control": "no-store",
            "Content-Disposition": f'attachment; filename="ippon-{name}"',
        }
        return Response(content, media_type=FILES[name][0], headers=headers)

    async def _goals(self, _: Request) -> Response:
        """Answer with the goals and saved searches, a `GoalList`."""
        return _json(self._state_feed.goals)

    async def _calls(self, _: Request) -> Response:
        """Answer with the calls, a `CallsShown`."""
        return _json(self._state_feed.calls)

    async def _things(self, request: Request) -> Response:
        """Answer with everything that the robot remembers, a `MemoryReply` without pictures."""
        set_acting_browser(request.scope["browser"])
        try:
            reply = await asyncio.to_thread(self._controller.things)
        except CommandError as error:
            return JSONResponse({"problem": str(error)}, status_code=502)
        return _json(msgspec.json.encode(reply))

    async def _thing_picture(self, request: Request) -> Response:
        set_acting_browser(request.scope["browser"])
        number = request.path_params["number"]
        try:
            jpeg = await asyncio.to_thread(self._controller.thing_picture, number)
        except CommandError as error:
            return _text(f"{error}\n", 502)
        if not jpeg:
            return Response(status_code=204)
        return Response(
            jpeg, media_type="image/jpeg", headers={"Cache-Control": "private, max-age=600"}
        )

    async def _stop(self, request: Request) -> Response:
        """Stop the robot without a WebSocket; the shell's fallback."""
        _end_line_that_was_left(request)
        set_acting_browser(request.scope["browser"])
        try:
            state = await self._controller.control(
                ControlRequest(action="stop", requester="console")
            )
        except CommandError as error:
            return JSONResponse({"ok": False, "text": str(error)}, status_code=502)
        return JSONResponse({"ok": True, "text": state})

    async def _view_socket(self, socket: WebSocket) -> None:
        if await self._is_full(socket):
            return
        async with self._place(socket) as browser:
            await pass_through(socket, self._viser_server, browser, self._controller.may_use_panels)

    async def _shell_socket(self, socket: WebSocket) -> None:
        _end_line_that_was_left(socket)
        if await self._is_full(socket):
            return
        async with self._place(socket) as browser:
            edition = self._assets.edition
            await serve_shell(socket, self._state_feed, self._controller, browser, edition)

    async def _camera_socket(self, socket: WebSocket) -> None:
        if await self._is_full(socket):
            return
        async with self._place(socket):
            await serve_camera(socket, self._state_feed.camera)

    async def _is_full(self, socket: WebSocket) -> bool:
        if self.open_sockets < MAX_SOCKETS:
            return False
        logger.warning("refused a page: %d sockets are open", self.open_sockets)
        await socket.accept()
        await socket.close(_TRY_LATER, "too many pages are open")
        return True

    @asynccontextmanager
    async def _place(self, socket: WebSocket) -> AsyncGenerator[Browser]:
        self.open_sockets += 1
        try:
            async with _for_as_long_as_let_in(socket) as browser:
                yield browser
        finally:
            self.open_sockets -= 1


def _end_line_that_was_left(connection: HTTPConnection) -> None:
    """End the sockets of a browser from before `silent_s`, the time for which it heard nothing.

    The network may deliver later what was sent there: a Resume would undo the Stop that was sent on
    the next line.
    """
    try:
        silent_s = float(connection.query_params.get("silent_s", ""))
    except ValueError:
        return
    browser: Browser = connection.scope["browser"]
    browser.disconnect(began_before_s=time.monotonic() - silent_s)


def _json(content: bytes) -> Response:
    headers = {"Cache-Control": "no-store"}
    return Response(content, media_type="application/json", headers=headers)


def _text(text: str, status: int) -> Response:
    return Response(text, status_code=status, media_type="text/plain")


@asynccontextmanager
async def _for_as_long_as_let_in(socket: WebSocket) -> AsyncGenerator[Browser]:
    """End the enclosed task when the login expires or at a logout."""
    browser: Browser = socket.scope["browser"]
    left_s = None if browser.expires_s is None else browser.expires_s - time.monotonic()
    with browser.present():
        try:
            async with asyncio.timeout(left_s):
                yield browser
        except TimeoutError:
            await socket.close(1008, "the login has expired")
