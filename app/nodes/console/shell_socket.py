"""The shell's own line to the console: state out, commands in, and a clock for the latency."""

import asyncio
import logging
import secrets
from collections.abc import Awaitable, Callable
from typing import Annotated, Final, Literal

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from app.messages.control import ControlRequest, DriveModeName
from app.nodes.console.bulletin import Bulletin
from app.nodes.console.commands import CommandError, Controller
from ippon.control.drive import RESTING, Hand

logger = logging.getLogger(__name__)

MAX_MESSAGE: Final = 4096
_BAD_MESSAGE: Final = 1007

Share = Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)]


class ShellPing(msgspec.Struct, tag="ping", forbid_unknown_fields=True):
    """Asks for a `ShellPong` with the same number."""

    t: float


class ShellCommand(msgspec.Struct, tag="control", forbid_unknown_fields=True):
    """A button of the shell."""

    id: int
    action: Literal["stop", "resume", "pause", "cancel"]


class ShellDrive(msgspec.Struct, tag="drive", forbid_unknown_fields=True):
    """Who drives from now on."""

    id: int
    mode: DriveModeName


class ShellHand(msgspec.Struct, tag="hand", forbid_unknown_fields=True):
    """What is held down on this page now, each part in -1 to 1."""

    forward: Share = 0.0
    turn: Share = 0.0
    tilt: Share = 0.0


class ShellPong(msgspec.Struct, tag="pong"):
    """Answer to `ShellPing`."""

    t: float


class ShellReply(msgspec.Struct, tag="reply"):
    """How a command ended: the state that the navigator is in now, or what went wrong."""

    id: int
    ok: bool
    text: str


_Message = ShellPing | ShellCommand | ShellDrive | ShellHand
_decoder = msgspec.json.Decoder(_Message)


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
    sender, held = secrets.token_hex(8), RESTING
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
            if isinstance(message, ShellHand):
                held = Hand(forward=message.forward, turn=message.turn, tilt=message.tilt)
                controller.hand(held, sender)
                continue
            task = asyncio.create_task(_command(message, put, controller))
            commands.add(task)
            task.add_done_callback(commands.discard)
    finally:
        if held != RESTING:
            # The browser has left with a key held down.
            controller.hand(RESTING, sender)
        # A command that is under way ends even when the browser has left: it may be a stop.
        if commands:
            _, late = await asyncio.wait(commands, timeout=5.0)
            for task in late:
                task.cancel()


def _read(text: str | None) -> _Message | None:
    if text is None or len(text) > MAX_MESSAGE:
        return None
    try:
        return _decoder.decode(text)
    except msgspec.DecodeError as error:
        logger.warning("a shell sent what is no message: %s", error)
        return None


async def _command(
    command: ShellCommand | ShellDrive,
    put: Callable[[bytes], Awaitable[None]],
    controller: Controller,
) -> None:
    try:
        if isinstance(command, ShellDrive):
            text = await controller.drive(command.mode)
        else:
            request = ControlRequest(action=command.action, requester="console")
            text = await controller.control(request)
        reply = ShellReply(id=command.id, ok=True, text=text)
    except CommandError as error:
        reply = ShellReply(id=command.id, ok=False, text=str(error))
    await put(msgspec.json.encode(reply))
