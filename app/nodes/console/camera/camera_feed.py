"""The newest camera image with what is drawn over it, from the network's threads to the pages.

Images reach the pages without passing through the scene thread, which may draw for longer than an
image should be late.
"""

import asyncio
import contextlib
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import msgspec
from numpy.typing import NDArray

from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.images import CompressedColor, decode_color
from app.messages.motion import decode_twist
from app.messages.perception.detections import StampedBoxes, decode_detections
from app.messages.perception.heatmaps import StampedHeatmap, decode_heatmap
from app.view.camera.overlays import NO_SCENE, CameraScene, ImageLine, lines_of
from app.view.camera.picture_encoding import encoded_picture, quarter_turns
from app.view.camera.recognition import boxes_of, heat_of, labels_of
from app.view.camera.stream_budget import Rung
from ippon.vocabulary import in_words

RECOGNISED_NS: Final = 1_000_000_000
"""Output of the network for an image that is this much older is not drawn in: the camera moves."""
CAMERA_ONLY: Final = (keys.HEATMAP, keys.BOXES, keys.CMD_VEL)
"""Topics that nothing but the camera's pictures needs."""
COMMAND_S: Final = 0.5
_KEPT: Final = 16


class CameraHeader(msgspec.Struct, frozen=True, kw_only=True):
    """What comes with a picture."""

    number: int
    stamp_ns: str
    """Stamp of the image; text, because a page's numbers have 53 bits."""
    held_ms: float
    """Time that the console has held the image."""
    lines: list[ImageLine]
    labels: list[str]
    """Labels that can be drawn in."""
    label: str
    """What is drawn in; empty for nothing."""
    lag_ms: float
    """How much older the output of the network is than the picture."""
    width: int
    """Width of the camera's image in pixels; the picture may be smaller and turned."""
    height: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FeedImage:
    """An image as received."""

    number: int
    image: CompressedColor
    received_s: float
    """On the clock of `time.monotonic`."""


class CameraFeed:
    """Safe from any thread; whoever follows it gets the newest image only."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._newest: FeedImage | None = None
        self._seen: tuple[str, bytes] | None = None
        """Key and payload of the network's last output, not decoded while nobody looks."""
        self._decoded: tuple[bytes, StampedHeatmap | StampedBoxes | None] | None = None
        self._command: tuple[float, float] | None = None
        self._commanded_s = 0.0
        self._scene = NO_SCENE
        self._readers: dict[asyncio.Event, asyncio.AbstractEventLoop] = {}
        self._jpegs: OrderedDict[tuple[int, Rung, str], bytes] = OrderedDict()

    @property
    def takers(self) -> dict[str, Callable[[bytes], None]]:
        """Handlers by topic, for the threads of the network; they return at once."""
        return {
            keys.COLOR: self.take_image,
            keys.HEATMAP: lambda payload: self._take_seen(keys.HEATMAP, payload),
            keys.BOXES: lambda payload: self._take_seen(keys.BOXES, payload),
            keys.CMD_VEL: self._take_command,
        }

    @property
    def newest(self) -> FeedImage | None:
        """The last image; None before the first."""
        return self._newest

    def take_image(self, payload: bytes) -> None:
        """Take a colour image; a damaged message is counted where the scene is read."""
        try:
            image = decode_color(payload)
        except MessageError:
            return
        with self._lock:
            number = 0 if self._newest is None else self._newest.number + 1
            self._newest = FeedImage(number=number, image=image, received_s=time.monotonic())
            readers = list(self._readers.items())
        for event, loop in readers:
            if not loop.is_closed():
                loop.call_soon_threadsafe(event.set)

    def show_scene(self, scene: CameraScene) -> None:
        """Replace what the lines are computed from."""
        self._scene = scene

    async def newer_than(self, number: int, timeout_s: float) -> FeedImage | None:
        """Return the newest image once its number is higher; None after the timeout."""
        event = asyncio.Event()
        with self._lock:
            self._readers[event] = asyncio.get_running_loop()
        try:
            newest = self._newest
            if newest is None or newest.number <= number:
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(timeout_s):
                        await event.wait()
            newest = self._newest
            return None if newest is None or newest.number <= number else newest
        finally:
            with self._lock:
                self._readers.pop(event, None)

    def compose(self, shown: FeedImage, rung: Rung, label: str | None) -> tuple[bytes, bytes]:
        """Return the JPEG and the header as JSON. Takes milliseconds; call in a thread.

        Args:
            shown: An image of this feed.
            rung: Size and quality.
            label: What is drawn in; empty for the object of interest, None for nothing.

        Raises:
            MessageError: The image is damaged.
        """
        scene, stamp_ns = self._scene, shown.image.stamp_ns
        pose = scene.pose_at(stamp_ns)
        turns = 0 if pose is None else quarter_turns(pose)
        command = self._command
        if time.monotonic() - self._commanded_s > COMMAND_S:
            command = None
        lines = lines_of(scene, stamp_ns, turns, command)
        seen = self._recognised(stamp_ns)
        heat, labels, drawn = None, [], ""
        if isinstance(seen, StampedHeatmap):
            labels = labels_of(seen.heatmap)
            heat = None if label is None else heat_of(seen.heatmap, label)
            if heat is not None:
                drawn = label or seen.heatmap.ooi or ""
        elif isinstance(seen, StampedBoxes) and scene.camera is not None:
            labels = sorted({in_words(name) for name in seen.names})
            if label is not None:
                drawn = label or scene.wanted
                lines += boxes_of(seen, scene.camera, label, turns, scene.say)
        jpeg = self._jpeg(shown, rung, turns, label, heat)
        camera = scene.camera
        header = CameraHeader(
            number=shown.number,
            stamp_ns=str(stamp_ns),
            held_ms=round(1e3 * (time.monotonic() - shown.received_s), 1),
            lines=lines,
            labels=labels,
            label=in_words(drawn),
            lag_ms=0.0 if seen is None else max(0.0, (stamp_ns - seen.stamp_ns) / 1e6),
            width=0 if camera is None else camera.width,
            height=0 if camera is None else camera.height,
        )
        return jpeg, msgspec.json.encode(header)

    def _jpeg(
        self,
        shown: FeedImage,
        rung: Rung,
        turns: int,
        label: str | None,
        heat: NDArray | None,
    ) -> bytes:
        """Encode once for all pages that show the same."""
        key = (shown.number, rung, "" if heat is None else f"+{label}")
        with self._lock:
            known = self._jpegs.get(key)
        if known is not None:
            return known
        jpeg = encoded_picture(shown.image.encoded, rung, turns, heat)
        with self._lock:
            self._jpegs[key] = jpeg
            while len(self._jpegs) > _KEPT:
                self._jpegs.popitem(last=False)
        return jpeg

    def _take_seen(self, key: str, payload: bytes) -> None:
        self._seen = (key, payload)

    def _take_command(self, payload: bytes) -> None:
        try:
            twist = decode_twist(payload)
        except MessageError:
            return
        self._command = (twist.linear_m_s, twist.yaw_rate_rad_s)
        self._commanded_s = time.monotonic()

    def _recognised(self, stamp_ns: int) -> StampedHeatmap | StampedBoxes | None:
        """Return the output of the network for an image; None if it is missing or too old."""
        seen, decoded = self._seen, self._decoded
        if seen is None:
            return None
        key, payload = seen
        if decoded is None or decoded[0] is not payload:
            try:
                output = (
                    decode_heatmap(payload) if key == keys.HEATMAP else decode_detections(payload)
                )
            except MessageError:
                output = None
            decoded = self._decoded = (payload, output)
        output = decoded[1]
        if output is None or abs(stamp_ns - output.stamp_ns) > RECOGNISED_NS:
            return None
        return output
