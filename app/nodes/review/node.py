"""The console on a recording, as a process."""

import asyncio
import logging
import math
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Final
from urllib.parse import quote

import msgspec
import uvicorn
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from app.links.network.inbox import Inbox
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.scene import decode_voxels
from app.nodes.console.config import ConsoleConfig, ConsoleError
from app.nodes.console.node import listen_on, server_settings
from app.nodes.console.scene.scene_thread import SceneThread
from app.nodes.console.scene.state_feed import StateFeed
from app.nodes.console.web.access import OpenAccess
from app.nodes.console.web.assets import Assets
from app.nodes.console.web.browsers import Browsers
from app.nodes.console.web.gateway import Gateway
from app.nodes.console.web.guard import Hosts
from app.nodes.console.web.viser_server import start_viser
from app.nodes.review.link import RecordedLink
from app.nodes.review.playback import Playback, ReviewCommand
from app.nodes.review.side_by_side import SideBySideScene
from app.recording.catalogue import SessionEntry, list_sessions, path_of, picture_of
from app.recording.errors import RecordingError
from app.recording.reading.recording import Recording
from app.recording.writing.session import thumbnail
from app.view.model.scene_model import SceneModel
from app.view.model.scene_reader import SceneReader
from app.view.model.seek_history import SEEK_HISTORY
from app.view.spoken import spoken
from app.view.words import ENGLISH, Words

logger = logging.getLogger(__name__)

MAX_COMMAND: Final = 4096
MAX_MOMENT_S: Final = 1e7
GAP_M: Final = 1.5
_TYPES: Final = {"css": "text/css", "js": "text/javascript"}
_ASSETS: Final = ("review.css", "review.js", "sessions.js", "outcomes.js")
_HEAD: Final = (
    b'<link rel="stylesheet" href="/review/review.css">'
    b'<script type="module" src="/review/review.js"></script>'
)
_SHELL_SCRIPT: Final = b'<script type="module" src="/assets/shell.js">'


@dataclass(frozen=True, slots=True, kw_only=True)
class ReviewConfig:
    """Recordings or sessions to show, and port of the page."""

    paths: tuple[Path, ...] = ()
    """One recording, or two to compare."""
    folder: Path | None = None
    """Folder of the sessions to choose from."""
    port: int = 8080
    """Port of the page, on 127.0.0.1; 0 takes any free one."""
    language: str = "en"
    """Language of page and panels."""


class SessionList(msgspec.Struct, frozen=True, kw_only=True):
    """Content of the page of sessions."""

    folder: str
    sessions: list[SessionEntry]


class ReviewPages:
    """Routes of a review in addition to the console's."""

    def __init__(
        self,
        config: ReviewConfig,
        playback: Playback,
        state_feed: StateFeed,
        second: SideBySideScene,
        say: Words = ENGLISH,
    ) -> None:
        self._config = config
        self._playback = playback
        self._state_feed = state_feed
        self._second = second
        self._entries: list[SessionEntry] = []
        self._link, self._say = "/", say
        root = resources.files("web_assets")
        shell = say.page((root / "index.html").read_text("utf-8")).encode()
        assert _SHELL_SCRIPT in shell, "the page must load the shell"
        self._shell = shell.replace(_SHELL_SCRIPT, _HEAD + _SHELL_SCRIPT)
        self._list = say.page((root / "sessions.html").read_text("utf-8")).encode()
        self._assets = {name: (root / name).read_bytes() for name in _ASSETS}

    def routes(self) -> list[BaseRoute]:
        """Return the routes; they come before the console's."""
        return [
            Route("/", self._start),
            Route("/sessions", self._start),
            Route("/session/{name:path}", self._open),
            Route("/review/session", self._session),
            Route("/review/sessions", self._sessions),
            Route("/review/picture/{name:path}", self._picture),
            Route("/review/moment", self._moment),
            Route("/review/{name}", self._asset),
            WebSocketRoute("/review/ws", self._socket),
        ]

    def show(self, paths: list[Path], link: str = "/") -> None:
        """Show one recording, or two side by side.

        Args:
            paths: The recordings.
            link: Path of the page that shows them.

        Raises:
            RecordingError: A recording cannot be shown.
        """
        self._playback.show(paths)
        if len(paths) > 1:
            widths = [_extent_x(path) for path in paths]
            self._second.stand_at(widths[0][1] - widths[1][0] + GAP_M)
        self._second.show(len(paths) > 1)
        self._link = link

    async def _start(self, request: Request) -> Response:
        listed = self._config.folder is not None
        if listed and (request.url.path == "/sessions" or not self._playback.session.sessions):
            return _page(self._list)
        return _page(self._shell)

    async def _open(self, request: Request) -> Response:
        folder = self._config.folder
        if folder is None:
            return RedirectResponse("/", status_code=303)
        names = [request.path_params["name"], *request.query_params.getlist("beside")[:1]]
        paths = [path_of(folder, name, self._entries) for name in names]
        if None in paths:  # It may have been recorded since the list was read.
            self._entries = await run_in_threadpool(list_sessions, folder)
            paths = [path_of(folder, name, self._entries) for name in names]
        known = [path for path in paths if path is not None]
        if len(known) < len(paths):
            return PlainTextResponse("there is no such session here\n", status_code=404)
        try:
            await run_in_threadpool(self.show, known, _link(names))
        except RecordingError as error:
            return PlainTextResponse(f"{error}\n", status_code=422)
        return RedirectResponse("/", status_code=303)

    async def _session(self, _: Request) -> Response:
        session = msgspec.structs.replace(
            self._playback.session, has_list=self._config.folder is not None, link=self._link
        )
        return Response(msgspec.json.encode(session), media_type="application/json")

    async def _sessions(self, _: Request) -> Response:
        folder = self._config.folder
        if folder is not None:
            self._entries = await run_in_threadpool(list_sessions, folder)
        entries = [spoken(entry, self._say) for entry in self._entries]
        listed = SessionList(folder=str(folder or ""), sessions=entries)
        return Response(msgspec.json.encode(listed), media_type="application/json")

    async def _picture(self, request: Request) -> Response:
        folder = self._config.folder
        name = request.path_params["name"]
        found = folder is not None and await run_in_threadpool(
            picture_of, folder, name, self._entries
        )
        picture = found or None
        if picture is None:
            return PlainTextResponse("no picture\n", status_code=404)
        return Response(picture, media_type="image/jpeg", headers={"Cache-Control": "max-age=60"})

    async def _moment(self, request: Request) -> Response:
        """Answer with a small camera image of the moment `at` (seconds) in the session `lane`.

        204 where there is no image yet.
        """
        asked = request.query_params
        try:
            at_s, lane = float(asked.get("at", "nan")), int(asked.get("lane", 0))
        except ValueError:
            at_s, lane = math.nan, 0
        if not 0.0 <= at_s < MAX_MOMENT_S:
            return PlainTextResponse("at=SECONDS and lane=0 or 1, please\n", status_code=400)
        image = await run_in_threadpool(self._playback.image_at, at_s, lane)
        picture = await run_in_threadpool(thumbnail, image)
        if picture is None:
            return Response(status_code=204)
        return Response(
            picture, media_type="image/jpeg", headers={"Cache-Control": "private, max-age=600"}
        )

    async def _asset(self, request: Request) -> Response:
        name = request.path_params["name"]
        content = self._assets.get(name)
        if content is None:
            return PlainTextResponse("no such file\n", status_code=404)
        return Response(
            content,
            media_type=_TYPES[name.rpartition(".")[2]],
            headers={"Cache-Control": "no-cache"},
        )

    async def _socket(self, socket: WebSocket) -> None:
        await socket.accept()
        await serve_timeline(socket, self._playback, self._state_feed)


async def serve_timeline(socket: WebSocket, playback: Playback, state_feed: StateFeed) -> None:
    """Send the state of the playback and run the page's commands, until it disconnects."""

    async def announce() -> None:
        async for state in state_feed.follow():
            await socket.send_text(state.decode())

    announcing = asyncio.create_task(announce())
    try:
        while True:
            text = await socket.receive_text()
            if len(text) > MAX_COMMAND:
                break
            playback.command(msgspec.json.decode(text, type=ReviewCommand))
    except WebSocketDisconnect:
        return
    except msgspec.DecodeError as error:
        logger.warning("invalid command of a timeline: %s", error)
        await socket.close(1007, "not a command of the timeline")
    finally:
        announcing.cancel()
        await asyncio.gather(announcing, return_exceptions=True)


def run_review(config: ReviewConfig) -> None:
    """Serve the pages until SIGINT or SIGTERM.

    Raises:
        ConsoleError: The port is taken, or a part has failed.
        RecordingError: The recording cannot be shown.
        LanguageError: There are no words in the language.
    """
    say = Words(config.language)
    listener = listen_on(ConsoleConfig(port=config.port))
    topics = (SEEK_HISTORY, *SceneReader(SceneModel()).keys)
    shell, timeline = StateFeed(), StateFeed()
    # A jump resets the scene: nothing of what waits is drawn any more.
    anew = (SEEK_HISTORY,)
    inboxes = (
        Inbox(topics, {keys.COLOR: shell.camera.take_image}, anew=anew), Inbox(topics, anew=anew),
    )  # fmt: skip
    failures: list[Exception] = []

    def fail(error: Exception) -> None:
        failures.append(error)
        server.should_exit = True

    link = RecordedLink(inboxes[0], fail, say)
    browsers = Browsers()
    viser_server = start_viser(browsers)
    gateway = Gateway(
        viser_server, shell, link, OpenAccess(browsers), Hosts("127.0.0.1"), assets=Assets(say)
    )
    playback = Playback(
        tuple(inbox.put for inbox in inboxes), timeline, fail, say,
        has_room=lambda: all(inbox.has_room() for inbox in inboxes),
    )  # fmt: skip
    scene_thread = SceneThread(viser_server, link, inboxes[0], shell, fail)
    second = SideBySideScene(viser_server, inboxes[1], scene_thread.follow, fail, say)
    pages = ReviewPages(config, playback, timeline, second, say)
    app = gateway.app()
    app.router.routes[:0] = pages.routes()
    server = uvicorn.Server(server_settings(app))
    parts = (playback, scene_thread, second)
    try:
        for part in parts:
            part.start()
        if config.paths:
            pages.show(list(config.paths))
        logger.info("review at http://%s:%d", *listener.getsockname()[:2])
        server.run(sockets=[listener])
    finally:
        playback.close()
        scene_thread.stop()
        second.stop()
        viser_server.close()
        listener.close()
    if failures:
        raise ConsoleError(
            f"the review has ended because a part of it failed ({failures[0]!r}); see its log"
        ) from failures[0]


def _link(names: list[str]) -> str:
    first, *beside = (quote(name) for name in names)
    return "?beside=".join((f"/session/{first}", *beside))


def _page(content: bytes) -> Response:
    return Response(content, media_type="text/html", headers={"Cache-Control": "no-store"})


def _extent_x(path: Path) -> tuple[float, float]:
    """Return the least and greatest x of the last whole map of a recording, in metres."""
    recording = Recording(path)
    try:
        message = recording.latest(keys.MAP_KEYFRAME, recording.end_ns)
        if message is None:
            return 0.0, 0.0
        x = decode_voxels(message.payload).centers_world[:, 0]
        return (float(x.min()), float(x.max())) if len(x) else (0.0, 0.0)
    except MessageError:
        return 0.0, 0.0
    finally:
        recording.close()
