"""WebSocket of the camera: pictures out, acknowledgements in.

A picture is a binary message: the length of the header as four bytes, little endian, the header as
JSON, and a JPEG. The page acknowledges a picture when it has drawn it, so that a slow link or a
slow page gets fewer and smaller pictures, and never old ones.
"""

import asyncio
import logging
import struct
import time
from typing import Annotated, Final

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from app.messages.cdr import MessageError
from app.nodes.console.camera.camera_feed import CameraFeed, FeedImage
from app.nodes.console.web.page_messages import page_messages, until_one_ends
from app.view.camera.stream_budget import IN_FLIGHT, Rung, StreamBudget

logger = logging.getLogger(__name__)

MAX_MESSAGE: Final = 1024
_WAIT_S: Final = 1.0
_LOST_S: Final = 5.0
"""Time after which an acknowledgement is given up."""


class CameraDrawn(msgspec.Struct, tag="drawn", forbid_unknown_fields=True):
    """The page has drawn a picture."""

    number: int


class CameraWish(msgspec.Struct, tag="show", forbid_unknown_fields=True):
    """What the page shows."""

    longest_px: Annotated[int, msgspec.Meta(ge=0, le=8192)]
    """Longest side of the picture on the screen; 0 for none, when the camera is hidden."""
    label: Annotated[str, msgspec.Meta(max_length=80)] | None = None
    """What is drawn in; empty for the object of interest, None for nothing."""


class CameraLatency(msgspec.Struct, tag="latency", frozen=True):
    """Time from the arrival of a drawn picture at the console to its acknowledgement."""

    ms: float
    kbit_s: float
    """Bit rate that the link is given."""


_decoder = msgspec.json.Decoder(CameraDrawn | CameraWish)


async def serve_camera(socket: WebSocket, feed: CameraFeed) -> None:
    """Send pictures to one page until it disconnects."""
    await socket.accept()
    stream = _Stream(socket, feed)
    await until_one_ends(stream.listen(), stream.send())


class _Stream:
    def __init__(self, socket: WebSocket, feed: CameraFeed) -> None:
        self._socket = socket
        self._feed = feed
        self._budget = StreamBudget()
        self._wish = CameraWish(longest_px=0)
        self._in_flight: dict[int, tuple[float, float]] = {}
        """Time of sending and of arrival at the console, by number of the picture."""
        self._changed = asyncio.Event()

    async def listen(self) -> None:
        """Read what the page shows and has drawn."""
        messages = page_messages(self._socket, _decoder, "a camera view", MAX_MESSAGE)
        async for message in messages:
            if isinstance(message, CameraDrawn):
                await self._acknowledge(message.number)
            else:
                self._wish = message
            self._changed.set()

    async def _acknowledge(self, number: int) -> None:
        sent = self._in_flight.pop(number, None)
        if sent is None:
            return
        now = time.monotonic()
        self._budget.acknowledged(now - sent[0])
        latency = CameraLatency(
            ms=round(1e3 * (now - sent[1])), kbit_s=round(self._budget.allowed_bit_s / 1e3)
        )
        await self._socket.send_text(msgspec.json.encode(latency).decode())

    async def send(self) -> None:
        """Send the newest picture whenever page, link and budget are ready."""
        number = -1
        try:
            while True:
                await self._until_ready()
                shown = await self._feed.newer_than(number, _WAIT_S)
                if shown is None:
                    continue
                number = shown.number
                await self._send_one(shown)
        except (WebSocketDisconnect, RuntimeError):
            return

    async def _until_ready(self) -> None:
        while True:
            self._changed.clear()
            now = time.monotonic()
            for number, (sent_s, _) in list(self._in_flight.items()):
                if now - sent_s > _LOST_S:
                    del self._in_flight[number]
                    self._budget.acknowledged(_LOST_S)
            if self._wish.longest_px > 0 and len(self._in_flight) < IN_FLIGHT:
                wait_s = self._budget.wait_s(now)
                if wait_s <= 0.0:
                    return
                await asyncio.sleep(wait_s)
                continue
            try:
                async with asyncio.timeout(_WAIT_S):
                    await self._changed.wait()
            except TimeoutError:
                continue

    async def _send_one(self, shown: FeedImage) -> None:
        budget, label = self._budget, self._wish.label
        while True:
            rung = budget.rung
            rung = Rung(
                longest_px=min(rung.longest_px, self._wish.longest_px), quality=rung.quality
            )
            try:
                jpeg, header = await asyncio.to_thread(self._feed.compose, shown, rung, label)
            except MessageError as error:
                logger.debug("a camera image is not shown: %s", error)
                return
            size = 4 + len(header) + len(jpeg)
            if not budget.is_too_large(size):
                break
        now = time.monotonic()
        budget.sent(now, size)
        self._in_flight[shown.number] = (now, shown.received_s)
        await self._socket.send_bytes(struct.pack("<I", len(header)) + header + jpeg)
