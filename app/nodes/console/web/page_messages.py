"""Messages of a page over a WebSocket, for its shell and for its camera view."""

import asyncio
import logging
from collections.abc import AsyncGenerator, Coroutine
from typing import Any, Final, TypeVar

import msgspec
from starlette.websockets import WebSocket

logger = logging.getLogger(__name__)

_BAD_MESSAGE: Final = 1007
_M = TypeVar("_M")


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
    """Run coroutines side by side until one of them ends, and cancel the others."""
    tasks = [asyncio.create_task(one) for one in coroutines]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
