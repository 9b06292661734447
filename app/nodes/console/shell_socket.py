"""The shell's own line to the console: state out, commands in, and a clock for the latency."""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import Final, Literal

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from app.messages.control import ControlRequest
from app.nodes.console.bulletin import Bulletin
from app.nodes.console.commands import CommandError, Controller

logger = logging.getLogger(__name__)

MAX_MESSAGE: Final = 4096
_BAD_MESSAGE: Final = 1007


class ShellPing(msgspec.Struct, tag="ping", forbid_unknown_fields=True):
    """Asks for a `ShellPong` with the same number."""

    t: float


class ShellCommand(msgspec.Struct, tag="control", forbid_unknown_fields=True):
    """A button of the shell."""

    id: int
    action: Literal["stop", "resume", "pause", "cancel"]


class ShellPong(msgspec.Struct, tag="pong"):
    """Answer to `ShellPing`."""

    t: float


class ShellReply(msgspec.Struct, tag="reply"):
    """How a command ended: the state that the navigator is in now, or what went wrong."""

    id: int
    ok: bool
    text: str


_decoder = msgspec.json.Decoder(ShellPing | ShellCommand)


async def serve_shell(socket: WebSocket, bulletin: Bulletin, controller: Controller) -> None:
    """Serve one shell until its browser leaves."""
    await socket.accept()
    outbox: asyncio.Queue[bytes] = asyncio.Queue(maxsize=64)
    tasks = [
        asyncio.create_task(_listen(socket, outbox.put, controller)),
        asyncio.create_task(_announce(bulletin, outbox.put)),
        asyncio.create_task(_send(socket, outbox)),
    ]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _send(socket: WebSocket, outbox: asyncio.Queue[bytes]) -> None:
    try:
        while True:
            await socket.send_text((await outbox.get()).decode())
    except (WebSocketDisconnect, RuntimeError):
        return


async def _announce(bulletin: Bulletin, put: Callable[[bytes], Awaitable[None]]) -> None:
    async for state in bulletin.follow():
        await put(state)


async def _listen(
    socket: WebSocket, put: Callable[[bytes], Awaitable[None]], controller: Controller
) -> None:
    commands: set[asyncio.Task[None]] = set()
    try:
        while True:
            received = await socket.receive()
            if received["type"] == "websocket.disconnect":
                break
            message = _read(received.get("text"))
            if message is None:
                await socket.close(_BAD_MESSAGE, "not a message of the shell")
                break
            if isinstance(message, ShellPing):
                await put(msgspec.json.encode(ShellPong(t=message.t)))
                continue
            task = asyncio.create_task(_command(message, put, controller))
            commands.add(task)
            task.add_done_callback(commands.discard)
    finally:
        # A command that is under way ends even when the browser has left: it may be a stop.
        if commands:
            _, late = await asyncio.wait(commands, timeout=5.0)
            for task in late:
                task.cancel()


def _read(text: str | None) -> ShellPing | ShellCommand | None:
    if text is None or len(text) > MAX_MESSAGE:
        return None
    try:
        return _decoder.decode(text)
    except msgspec.DecodeError as error:
        logger.warning("a shell sent what is no message: %s", error)
        return None


async def _command(
    command: ShellCommand, put: Callable[[bytes], Awaitable[None]], controller: Controller
) -> None:
    request = ControlRequest(action=command.action, requester="console")
    try:
        reply = ShellReply(id=command.id, ok=True, text=await controller.control(request))
    except CommandError as error:
        reply = ShellReply(id=command.id, ok=False, text=str(error))
    await put(msgspec.json.encode(reply))
