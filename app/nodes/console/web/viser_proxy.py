"""Forwards a browser's WebSocket to viser, and drops the messages that it may not send."""

import logging
import math
from collections.abc import Callable
from typing import Annotated, Final

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.typing import Subprotocol

from app.nodes.console.web.browsers import Browser
from app.nodes.console.web.page_messages import until_one_ends
from app.nodes.console.web.permissions import PANEL_MESSAGES, may_send
from app.nodes.console.web.viser_server import LoopbackViserServer

logger = logging.getLogger(__name__)

MAX_CLIENT_MESSAGE: Final = 8 * 2**20
MAX_SERVER_MESSAGE: Final = 256 * 2**20

_GOING_AWAY: Final = 1001
_UNREADABLE: Final = 1007
_TRY_LATER: Final = 1013


class _Kind(msgspec.Struct):
    type: str
    uuid: str = ""


_Pixels = Annotated[int, msgspec.Meta(ge=1, le=100_000)]
_Point = tuple[float, float, float]


class _Camera(msgspec.Struct):
    """A `ViewerCameraMessage`: the scene thread computes with it."""

    wxyz: tuple[float, float, float, float]
    position: _Point
    fov: Annotated[float, msgspec.Meta(gt=0.0, lt=math.pi)]
    look_at: _Point
    image_height: _Pixels
    """A hidden scene has 0."""
    image_width: _Pixels

    @property
    def is_sound(self) -> bool:
        """Whether all numbers are finite, and the rotation is one."""
        numbers = (*self.wxyz, *self.position, *self.look_at, self.fov)
        return all(map(math.isfinite, numbers)) and math.hypot(*self.wxyz) > 1e-6


_kind = msgspec.msgpack.Decoder(_Kind)
_camera = msgspec.msgpack.Decoder(_Camera)


async def pass_through(
    socket: WebSocket,
    viser_server: LoopbackViserServer,
    browser: Browser,
    may_use_panels: Callable[[Browser], bool],
) -> None:
    """Serve one browser until either side ends.

    Args:
        socket: A socket that is not accepted yet.
        viser_server: The scene's server.
        browser: The browser at the socket.
        may_use_panels: Returns whether a browser may use the panels now.
    """
    wanted = [Subprotocol(p) for p in socket.scope.get("subprotocols", [])]
    try:
        upstream = await connect(
            viser_server.url,
            additional_headers=viser_server.headers_of(browser),
            subprotocols=wanted or None,
            compression=None,
            max_size=MAX_SERVER_MESSAGE,
            open_timeout=5.0,
        )
    except (OSError, InvalidHandshake, TimeoutError) as error:
        logger.warning("viser cannot be reached: %s", error)
        await socket.accept()
        await socket.close(_TRY_LATER, "the scene is not ready")
        return
    async with upstream:
        await socket.accept(subprotocol=upstream.subprotocol)
        await until_one_ends(
            _to_viser(socket, upstream, browser, lambda: may_use_panels(browser)),
            _to_browser(socket, upstream),
        )


async def _to_viser(
    socket: WebSocket,
    upstream: ClientConnection,
    browser: Browser,
    may_use_panels: Callable[[], bool],
) -> None:
    try:
        while True:
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            data = message.get("bytes")
            if data is None or len(data) > MAX_CLIENT_MESSAGE:
                await socket.close(_UNREADABLE, "not a message of the scene's client")
                return
            if _allowed(data, browser, panels=may_use_panels()):
                await upstream.send(data)
    except (ConnectionClosed, WebSocketDisconnect):
        return


def _allowed(data: bytes, browser: Browser, *, panels: bool) -> bool:
    try:
        message = _kind.decode(data)
    except msgspec.DecodeError:
        logger.warning("a browser sent %d bytes that are not a message of viser", len(data))
        return False
    if may_send(browser, message.type, message.uuid, panels=panels):
        return message.type != "ViewerCameraMessage" or _is_camera(data)
    if message.type not in PANEL_MESSAGES:
        logger.warning("refused a message of type %.60r from a browser", message.type)
    return False


def _is_camera(data: bytes) -> bool:
    try:
        return _camera.decode(data).is_sound
    except msgspec.DecodeError:
        return False


async def _to_browser(socket: WebSocket, upstream: ClientConnection) -> None:
    try:
        async for message in upstream:
            if isinstance(message, bytes):
                await socket.send_bytes(message)
            else:
                await socket.send_text(message)
        await socket.close(_GOING_AWAY)
    except (ConnectionClosed, WebSocketDisconnect, RuntimeError):
        return
