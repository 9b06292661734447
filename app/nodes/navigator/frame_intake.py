"""Receives the robot's messages and assembles them into frames."""

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, Final

import zenoh

from app.links.network.subscription import subscribe
from app.links.robot_streams.assembler import AssemblerConfig, FrameAssembler, assemble
from app.links.robot_streams.clock_watch import ClockWatch
from app.links.robot_streams.depth_match import DepthMatch
from app.links.robot_streams.lateness import Lateness
from app.links.robot_streams.robot_detector import RobotDetector
from app.links.robot_streams.stream_monitor import StreamMonitor
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.images import decode_color
from app.messages.keys import WORLD_FRAME
from app.recording.frame_tree import image_stamp_ns
from ippon.errors import FrameRejectedError
from ippon.frame import Frame

MAX_WAITING: Final = 4
"""Messages of one topic that may wait for decoding; older ones are dropped and counted."""
MAX_POSES: Final = 500
"""The same of poses: those of a second, where a robot sends 500 in it."""
MAX_KEPT: Final = 100
"""The same of topics whose messages are sent once, and come together to who starts late."""
MAX_REASON: Final = 200
ARRIVALS: Final = 64
"""Number of colour images whose time of arrival is kept."""
_STREAM_OF: Final = {
    keys.TF: "pose",
    keys.TF_STATIC: "",
    keys.CAMERA_INFO: "",
    keys.CONTACT: "",
    keys.LABEL_NAMES: "",
    keys.DETECTOR_NAME: "",
    keys.HEATMAP: "heatmap",
    keys.MASKS: "",
    keys.MASKS_COMPRESSED: "",
    keys.BOXES: "heatmap",
    keys.DEPTH: "depth",
    keys.DEPTH_RAW: "depth",
    keys.COLOR: "colour",
}
"""Stream that counts the messages of each topic, "" for none; decoded in this order."""
_AT_FAULT: Final = {keys.TF_STATIC: "pose", keys.CONTACT: "pose", keys.CAMERA_INFO: "colour"}
"""Stream that counts the refused messages of topics without one; of the others the heatmap."""
UNMATCHED: Final = 10
"""Consecutive heatmaps and detections without a matching image after which the operator is told."""
MISFITS: Final = 10
"""Consecutive images with mostly invalid boxes after which the operator is told."""
REQUIRED: Final = ("colour", "depth", "pose")
"""Streams without which there is no frame."""


class FrameIntake:
    """Callbacks only store the bytes; `take` decodes them in the caller's thread."""

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        report: Callable[[str], None],
        detector: RobotDetector | None = None,
        camera_clock_offset_s: float = 0.0,
    ) -> None:
        config = AssemblerConfig(camera_clock_offset_s=camera_clock_offset_s)
        self.assembler = FrameAssembler(config, detector)
        self.monitors = {
            name: StreamMonitor(name) for name in ("colour", "depth", "pose", "heatmap")
        }
        self.frames = 0
        """Frames taken so far."""
        self.arrived_at = 0.0
        """`time.perf_counter` when the colour image of the last frame arrived."""
        self.refused = ""
        """Why the last frame was refused; empty after one was accepted."""
        self.camera_refused = ""
        """Why the last camera info was refused; empty after one was accepted."""
        self.ended = ""
        """Why no more images come, as the robot says; empty while they may."""
        self.has_tf = False
        """The robot publishes tf."""
        self.compressed_at = {"colour": 0.0, "depth": 0.0}
        """`time.monotonic` of the last compressed image of the robot itself: when a colour image
        came, and when a depth image was read."""
        self._framed_at = self._came_at = 0.0
        self._lateness = Lateness()
        self._match = DepthMatch(config.tolerance_s)
        self._clocks = ClockWatch(WORLD_FRAME, camera_clock_offset_s)
        self._report = report
        self._arrived = threading.Condition()
        self._waiting: dict[str, deque[tuple[float, bytes]]] = {}
        self._arrivals: dict[int, float] = {}
        self._receivers: dict[str, Callable[[bytes], None]] = {}
        self._listeners: dict[str, Callable[[bytes], None]] = {}
        for topic, stream in _STREAM_OF.items():
            kept = topic in keys.KEPT
            # Poses arrive faster than images, and interpolation needs each of them.
            often = MAX_POSES if topic in (keys.TF, keys.CONTACT) else MAX_WAITING
            self._waiting[topic] = deque(maxlen=MAX_KEPT if kept else often)
            self._receivers[topic] = self._receiver(topic, stream)
            own = {keys.TF: self._take_tf, keys.COLOR: self._take_color}
            take = own.get(topic, self._receivers[topic])
            if topic != keys.DEPTH_RAW:  # `StreamConverter` asks for it, and injects it.
                subscribe(session, f"{robot}/{topic}", take, kept=kept)
        subscribe(session, f"{robot}/{keys.ENDED}", self._note_end)

    def inject(self, topic: str, payload: bytes) -> None:
        """Take a message that the navigator converted from another topic of the robot."""
        self._receivers[topic](payload)

    def _take_tf(self, payload: bytes) -> None:
        """Take a message of the robot itself: one that was converted does not come this way."""
        self.has_tf = True
        self._receivers[keys.TF](payload)

    def _take_color(self, payload: bytes) -> None:
        self.compressed_at["colour"] = time.monotonic()
        self._receivers[keys.COLOR](payload)

    def listen(self, topic: str, take: Callable[[bytes], None]) -> None:
        """Pass every message of a topic on, too; `take` must return at once."""
        self._listeners[topic] = take

    def _note_end(self, payload: bytes) -> None:
        text = payload[:MAX_REASON].decode("utf-8", "replace")
        self.ended = "".join(c for c in text if c.isprintable()) or "no more images come"

    def _receiver(self, topic: str, stream: str) -> Callable[[bytes], None]:
        waiting = self._waiting[topic]
        monitor = self.monitors.get(stream)

        def receive(payload: bytes) -> None:
            with self._arrived:
                if monitor is not None:
                    monitor.arrived()
                    if len(waiting) == waiting.maxlen:
                        monitor.dropped()
                waiting.append((time.perf_counter(), payload))
                self._note_times(topic, payload)
                if topic == keys.COLOR:
                    self.ended = ""
                    self._arrived.notify()
            listener = self._listeners.get(topic)
            if listener is not None:
                listener(payload)

        return receive

    def _note_times(self, topic: str, payload: bytes) -> None:
        # Here and not where messages are decoded: some are dropped before.
        if topic in (keys.COLOR, keys.DEPTH, keys.DEPTH_RAW):
            stamp_ns = image_stamp_ns(payload)
            if stamp_ns is not None:
                add = self._match.add_color if topic == keys.COLOR else self._match.add_depth
                add(stamp_ns)
        elif topic in (keys.TF, keys.TF_STATIC):
            self._clocks.add_transforms(payload, fixed=topic == keys.TF_STATIC)

    def wake(self) -> None:
        """End a wait for a frame early."""
        with self._arrived:
            self._arrived.notify()

    def take(self, timeout_s: float) -> Frame | None:
        """Return the newest complete frame, None when none came within the time."""
        with self._arrived:
            if not self._waiting[keys.COLOR]:
                self._arrived.wait(timeout_s)
            batches = {topic: list(waiting) for topic, waiting in self._waiting.items()}
            for waiting in self._waiting.values():
                waiting.clear()
        for topic, arrivals in batches.items():
            for arrived_at, payload in arrivals:
                self._came_at = arrived_at
                self._decode(topic, payload)
        try:
            frame = self.assembler.take()
        except (FrameRejectedError, MessageError, ValueError) as error:
            self.refuse_frame(str(error))
            return None
        if self.assembler.detector.problem:
            self.refuse("heatmap", self.assembler.detector.problem)
        if frame is not None:
            self.frames += 1
            self._framed_at = time.monotonic()
            self.arrived_at = self._arrivals.get(frame.stamp_ns, self._came_at)
            self._lateness.add(frame.stamp_ns, self.arrived_at)
            self._clocks.add(frame, self.assembler.camera_frame or "")
        return frame

    def notes(self) -> tuple[str, ...]:
        """Return notes for the operator about images, detections, clocks and delays."""
        with self._arrived:
            notes = [self.assembler.detector.refusal(), self._match.problem()]
        notes.append(self._clocks.problem())
        late_s = self._lateness.late_s()
        if late_s > 0.0:
            notes.append(
                f"images arrive {late_s:.1f} s later than they did: the network is too slow, and "
                "the robot refuses commands that answer old images"
            )
        if self.assembler.unmatched >= UNMATCHED:
            notes.append(
                "no image has the stamp of the detections: a detector must copy the header of "
                "its colour image"
            )
        if self.assembler.detector.misfits >= MISFITS:
            notes.append(
                "most boxes of the detector are outside the image or empty, or their scores are "
                "not 0 to 1: boxes are in pixels of the colour image"
            )
        return tuple(note for note in notes if note)

    def take_late(self) -> Frame | None:
        """Return an earlier frame whose heatmap arrived late, None while there is none."""
        return self.assembler.take_late()

    def accept(self) -> None:
        """Clear `refused` after a frame was used."""
        self.refused = ""

    def refuse_frame(self, problem: str, stamp_ns: int | None = None) -> None:
        """Count a refused frame under the stream that caused it.

        Args:
            problem: What is wrong with it.
            stamp_ns: Its stamp if it was assembled, so that no late heatmap is joined to it.
        """
        if stamp_ns is not None:
            self.assembler.forget(stamp_ns)
        self.refused = problem
        word = problem.split(" ", 1)[0]
        stream = {"depth": "depth", "heatmap": "heatmap"}.get(word, "colour")
        if "camera jumped" in problem or "rigid transform" in problem or "camera at" in problem:
            stream = "pose"
        self.refuse(stream, problem)

    def refuse(self, stream: str, problem: str) -> None:
        """Count a message or frame that could not be used, and report the first one."""
        if self.monitors[stream].rejected(problem) == 1:
            self._report(f"{stream}: {problem}")

    def lost(self, after_s: float) -> list[tuple[str, float | None]]:
        """Return the required streams that are silent, each with its age.

        If all arrive and no frame results, the part that the frame lacks counts as silent.
        """
        ages = [(name, self.monitors[name].age_s()) for name in REQUIRED]
        silent = [(name, age) for name, age in ages if age is None or age > after_s]
        unframed_s = time.monotonic() - self._framed_at
        if not silent and self.frames and unframed_s > after_s and self.assembler.missing():
            return [(self.assembler.missing(), unframed_s)]
        return silent

    def _add_color(self, payload: bytes) -> None:
        color = decode_color(payload)
        self._arrivals[color.stamp_ns] = self._came_at
        while len(self._arrivals) > ARRIVALS:
            del self._arrivals[next(iter(self._arrivals))]
        self.assembler.add_color(color)

    def _decode(self, topic: str, payload: bytes) -> None:
        try:
            if topic == keys.COLOR:
                self._add_color(payload)
            else:
                assemble(self.assembler, topic, payload)
        except (MessageError, FrameRejectedError, ValueError) as error:
            problem = str(error)
            stream = _STREAM_OF[topic] or _AT_FAULT.get(topic, "heatmap")
            self.refuse(stream, f"{topic}: {problem}")
        else:
            problem = ""
            if topic == keys.DEPTH:
                self.compressed_at["depth"] = time.monotonic()
        if topic == keys.CAMERA_INFO:
            self.camera_refused = problem


class Stopwatch:
    """Rolling medians of durations."""

    def __init__(self, size: int = 50) -> None:
        self._size = size
        self._durations: dict[str, deque[float]] = {}

    def add(self, name: str, seconds: float) -> None:
        """Take one duration."""
        self._durations.setdefault(name, deque(maxlen=self._size)).append(seconds)

    def lap(self, name: str, since: float) -> float:
        """Take the time since `since` as one duration, and return the present time."""
        now = time.perf_counter()
        self.add(name, now - since)
        return now

    def median_ms(self, name: str) -> float:
        """Return the median in milliseconds, 0 before the first."""
        values: Any = sorted(self._durations.get(name, ()))
        return 1e3 * values[len(values) // 2] if values else 0.0
