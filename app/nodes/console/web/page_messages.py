"""Messages of a page over a WebSocket: those of its shell, and how shell and camera view read."""

import asyncio
import logging
from collections.abc import AsyncGenerator, Coroutine
from typing import Annotated, Any, Final, Literal, TypeVar

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from app.messages.control import QueueRequest, SavedSearchRequest
from app.messages.driving import DriveModeName
from app.messages.memory import MemoryNoteRequest
from app.nodes.console.web.browsers import Role, Standing

logger = logging.getLogger(__name__)

_BAD_MESSAGE: Final = 1007
_M = TypeVar("_M")


Share = Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)]
ViewShare = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Metres = Annotated[float, msgspec.Meta(ge=-1e4, le=1e4)]


class ShellPing(msgspec.Struct, tag="ping", forbid_unknown_fields=True):
    """Requests a `ShellPong` with the same time."""

    t: float
    """By the page's clock, ms."""
    trip: float | None = None
    """Round trip of the ping before, ms; None if it was not answered."""


class ShellCommand(msgspec.Struct, tag="control", forbid_unknown_fields=True):
    """Command of a button of the shell."""

    id: int
    action: Literal["stop", "resume", "pause", "cancel"]
    goal_id: int | None = None
    """The only goal that is cancelled."""


class ShellDrive(msgspec.Struct, tag="drive", forbid_unknown_fields=True):
    """New drive mode."""

    id: int
    mode: DriveModeName


class ShellInput(msgspec.Struct, tag="hand", forbid_unknown_fields=True):
    """Teleoperation keys held down on the page, each part in -1 to 1."""

    t: float
    """By the page's clock, ms."""
    forward: Share = 0.0
    turn: Share = 0.0
    tilt: Share = 0.0


class ShellAlive(msgspec.Struct, tag="alive", forbid_unknown_fields=True):
    """Sent every second by an active page, which renews its lease if it has one."""


class ShellLease(msgspec.Struct, tag="lease", forbid_unknown_fields=True):
    """Command of a button about the control lease."""

    id: int
    action: Literal["request", "release", "grant", "deny", "take"]
    requester: Annotated[str, msgspec.Meta(max_length=40)] = ""
    """Who is granted or denied control, as the page showed it."""


class ShellRoom(msgspec.Struct, tag="room", forbid_unknown_fields=True):
    """New name of the room at a point of the map; empty to remove it."""

    id: int
    x_m: float
    y_m: float
    name: Annotated[str, msgspec.Meta(max_length=200)]


class ShellSearch(msgspec.Struct, tag="search", forbid_unknown_fields=True):
    """Search for an object that the list of remembered things names."""

    id: int
    object: Annotated[str, msgspec.Meta(min_length=1, max_length=80)]


class ShellVerdict(msgspec.Struct, tag="verdict", forbid_unknown_fields=True):
    """Whether a find is what is searched for."""

    id: int
    verdict: Literal["confirm", "reject"]
    goal_id: int
    find: int | None = None
    """Number of the find that the page showed; None for the last one of the goal."""


class ShellNote(msgspec.Struct, tag="note", forbid_unknown_fields=True):
    """What a person says of a remembered thing."""

    id: int
    change: MemoryNoteRequest


class ShellLook(msgspec.Struct, tag="look", forbid_unknown_fields=True):
    """A thing to fly to and to explain."""

    position: tuple[Metres, Metres, Metres]
    size: tuple[Metres, Metres, Metres] = (0.5, 0.5, 0.5)
    thing: Annotated[str, msgspec.Meta(max_length=80)] = ""
    """What the page calls it."""
    share: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] | None = None
    """Probability that it is of its kind."""
    at_once: bool = False
    """Without a flight, for people who want less motion."""


class ShellFrame(msgspec.Struct, tag="frame", forbid_unknown_fields=True):
    """Show the whole map again in this browser."""


class ShellHover(msgspec.Struct, tag="hover", forbid_unknown_fields=True):
    """Point of the view under the pointer; the reply names what is there."""

    id: int
    u: ViewShare
    v: ViewShare


class ShellPoint(msgspec.Struct, tag="point", forbid_unknown_fields=True):
    """A click on the plan, which does there what a click on the map does.

    It is refused without a text if nothing is chosen that is done at a point of the floor.
    """

    id: int
    x_m: Metres
    y_m: Metres


class ShellTheme(msgspec.Struct, tag="theme", forbid_unknown_fields=True):
    """The theme of the page, which the floor of its scene follows."""

    light: bool


class ShellQueue(msgspec.Struct, tag="queue", forbid_unknown_fields=True):
    """Change of the queue of goals."""

    id: int
    change: QueueRequest


class ShellSaved(msgspec.Struct, tag="saved", forbid_unknown_fields=True):
    """Change of the saved searches, or a saved search to run."""

    id: int
    change: SavedSearchRequest


class ShellYou(msgspec.Struct, tag="you"):
    """Name and standing of this page."""

    name: str
    role: Role
    standing: Standing
    detail: str
    has_login: bool
    edition: str
    """See `Assets.edition`."""


class ShellPong(msgspec.Struct, tag="pong"):
    """Answer to `ShellPing`."""

    t: float


class ShellLate(msgspec.Struct, tag="late"):
    """Input arrived too late to move the robot."""


class ShellReply(msgspec.Struct, tag="reply"):
    """Result of a command: the present state of the navigator, or the error."""

    id: int
    ok: bool
    text: str


ShellMessage = (
    ShellPing | ShellCommand | ShellDrive | ShellInput | ShellAlive | ShellLease | ShellRoom
    | ShellLook | ShellFrame | ShellHover | ShellSearch | ShellNote | ShellTheme | ShellQueue
    | ShellSaved | ShellVerdict | ShellPoint
)  # fmt: skip


async def page_messages(
    socket: WebSocket, decoder: msgspec.json.Decoder[_M], sender: str, max_chars: int
) -> AsyncGenerator[_M]:
    """Yield the messages of a page until it disconnects or sends what is none of them.

    Args:
        socket: The accepted WebSocket; closed after a message that is not valid.
        decoder: Decoder of the messages.
        sender: Part of the page, for the log and the reason of the close.
        max_chars: Longer messages are not valid.
    """
    while True:
        received = await socket.receive()
        if received["type"] == "websocket.disconnect":
            return
        message = _decode(received.get("text"), decoder, sender, max_chars)
        if message is None:
            await socket.close(_BAD_MESSAGE, f"not a message of {sender}")
            return
        yield message


def _decode(
    text: str | None, decoder: msgspec.json.Decoder[_M], sender: str, max_chars: int
) -> _M | None:
    if text is None or len(text) > max_chars:
        return None
    try:
        return decoder.decode(text)
    except msgspec.DecodeError as error:
        logger.warning("invalid message of %s: %s", sender, error)
        return None


async def until_one_ends(*coroutines: Coroutine[Any, Any, None]) -> None:
    """Run coroutines side by side until one of them ends, and cancel the others.

    Raises:
        Exception: One of them has failed, other than by a browser that is gone.
    """
    tasks = [asyncio.create_task(one) for one in coroutines]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        results = await asyncio.gather(*tasks, return_exceptions=True)
    for result in results:
        if isinstance(result, Exception) and not isinstance(result, WebSocketDisconnect):
            raise result
