"""Joins the streams of a camera and a pose into frames."""

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.links.robot_streams.mask_pairing import MaskPairing, StampedDetections
from app.links.robot_streams.robot_detector import RobotDetector
from app.links.robot_streams.transforms import TransformBuffer
from app.messages import keys
from app.messages.depth.depth_images import DepthImage, decode_depth, decode_depth_raw
from app.messages.images import (
    PAIRED_S,
    CompressedColor,
    StampedCamera,
    decode_camera,
    decode_color,
    decompress_color,
)
from app.messages.keys import BASE_FRAME, WORLD_FRAME
from app.messages.motion import StampedTransform, decode_flag, decode_transforms
from app.messages.perception.detection_masks import (
    StampedMasks,
    decode_masks,
    decode_masks_compressed,
)
from app.messages.perception.detections import StampedBoxes, decode_detections
from app.messages.perception.detector_info import decode_detector_name, decode_label_names
from app.messages.perception.heatmaps import StampedHeatmap, decode_heatmap
from ippon.frame import NANOSECONDS, Frame
from ippon.geometry import Float64Array, invert_transform
from ippon.observation import Heatmap

MAX_PENDING: Final = 16
"""Messages of each stream that wait for the others of their frame."""
MAX_WITHOUT_HEATMAP: Final = 100
"""Frames taken without heatmap that wait for a late one: 20 s at 5 Hz."""
MAX_BYTES_WITHOUT_HEATMAP: Final = 200_000_000
"""Largest memory of these frames."""
MAX_LATE: Final = 4
"""Frames with late heatmaps that wait for `take_late`."""
REMEMBERED_IMAGES: Final = 200
"""Stamps of colour images that detections are compared with."""

Seen = StampedHeatmap | StampedDetections
T = TypeVar("T", CompressedColor, DepthImage, Seen)


@dataclass(frozen=True, slots=True, kw_only=True)
class AssemblerConfig:
    """How far stamps may differ."""

    tolerance_s: float = PAIRED_S
    """Stamps of colour, depth and heatmap that differ by less belong together."""
    heatmap_wait_s: float = 0.3
    """Frames go without heatmap once the last one is this much older, in robot time. Longer keeps
    more frames and heatmaps together, and lets commands age while they wait."""
    camera_clock_offset_s: float = 0.0
    """How far the camera's clock is behind that of the poses."""
    backwards_s: float = 1.0
    """Step back of an image from which the robot's clock counts as restarted."""


class FrameAssembler:
    """Accepts messages in any order; returns the newest complete frame."""

    def __init__(
        self, config: AssemblerConfig | None = None, detector: RobotDetector | None = None
    ) -> None:
        self._config = config or AssemblerConfig()
        self.detector = detector or RobotDetector()
        """Converts detections to heatmaps."""
        self._tolerance_ns = round(NANOSECONDS * self._config.tolerance_s)
        self._offset_ns = round(NANOSECONDS * self._config.camera_clock_offset_s)
        self._colors: dict[int, CompressedColor] = {}
        self._depths: dict[int, DepthImage] = {}
        self._heatmaps: dict[int, Seen] = {}
        self._pairing = MaskPairing(self._tolerance_ns)
        self._seen_ns: int | None = None
        self._image_stamps: deque[int] = deque(maxlen=REMEMBERED_IMAGES)
        self._camera: StampedCamera | None = None
        self._transforms = TransformBuffer()
        self._pressed = self._contact = False
        self._taken_ns = -1
        self._without: dict[int, Frame] = {}
        self._late: deque[Frame] = deque(maxlen=MAX_LATE)
        self.skipped = 0
        """Colour images that became no frame, because a newer one was complete first."""
        self.restarts = 0
        """Number of restarts of the robot's clock."""
        self.unmatched = 0
        """Heatmaps and detections in a row that carry the stamp of no image."""

    @property
    def camera_frame(self) -> str | None:
        """The camera's coordinate frame, as its camera info names it; None before the first."""
        return None if self._camera is None else self._camera.frame_id

    def missing(self) -> str:
        """Return what the newest colour image lacks to become a frame; empty for nothing."""
        if not self._colors:
            return "" if self._taken_ns >= 0 else "colour images"
        if self._camera is None:
            return "camera info"
        stamp = max(self._colors)
        if stamp <= self._taken_ns:
            return "colour images with a new stamp"
        if self._match(self._depths, stamp) is None:
            return "depth images with the stamp of the colour image"
        for frame in (self._camera.frame_id, BASE_FRAME):
            if self._pose(frame, stamp) is None:
                return f"tf from {WORLD_FRAME} to {frame[:60]} at the stamp of the images"
        return ""

    def add_color(self, color: CompressedColor) -> None:
        """Take a colour image."""
        self._check_clock(color.stamp_ns)
        self._image_stamps.append(color.stamp_ns)
        self._put(self._colors, color)

    def add_depth(self, depth: DepthImage) -> None:
        """Take a depth image."""
        self._check_clock(depth.stamp_ns)
        self._put(self._depths, depth)

    def add_heatmap(self, heatmap: StampedHeatmap) -> None:
        """Take a heatmap, also of a frame that was taken without it."""
        self._add_seen(heatmap)

    def add_boxes(self, boxes: StampedBoxes) -> None:
        """Take a detector's boxes."""
        for one in self._pairing.add_boxes(boxes):
            self._add_seen(one)

    def add_masks(self, masks: StampedMasks) -> None:
        """Take the pixels of a detector's boxes."""
        for one in self._pairing.add_masks(masks):
            self._add_seen(one)

    def _add_seen(self, seen: Seen) -> None:
        """Take a heatmap or detections, also for a frame that was taken without them."""
        if self._seen_ns is not None:
            # All images that the previous message may belong to have arrived now.
            near = any(abs(s - self._seen_ns) <= self._tolerance_ns for s in self._image_stamps)
            self.unmatched = 0 if near else self.unmatched + 1
        self._seen_ns = seen.stamp_ns
        self._put(self._heatmaps, seen)
        frame = self._frame_without(seen.stamp_ns)
        if frame is not None:
            self._late.append(replace(frame, heatmap=self._heatmap_of(seen, frame.depth)))

    def _heatmap_of(self, seen: Seen, depth: NDArray[np.float32]) -> Heatmap:
        if isinstance(seen, StampedHeatmap):
            return seen.heatmap
        return self.detector.heatmap(seen.boxes, seen.masks, depth)

    def add_camera(self, camera: StampedCamera) -> None:
        """Take intrinsics; the latest apply."""
        self._camera = camera

    def add_transforms(
        self, transforms: tuple[StampedTransform, ...], *, fixed: bool = False
    ) -> None:
        """Take transforms of `tf`, or of `tf_static` when fixed."""
        for transform in transforms:
            self._transforms.add(transform, fixed=fixed)

    def add_contact(self, pressed: bool) -> None:
        """Take the bumper's state, which holds until the next one; a press reaches a frame."""
        self._pressed = pressed
        self._contact = self._contact or pressed

    def take(self) -> Frame | None:
        """Return the newest complete frame that was not taken yet, None while there is none.

        Raises:
            FrameRejectedError: Its parts are inconsistent; it is discarded.
        """
        for stamp in sorted(self._colors, reverse=True):
            if stamp <= self._taken_ns:
                break
            color = self._colors[stamp]
            parts = self._parts(color)
            if parts is not None:
                self._taken_ns = stamp
                self._forget_up_to(stamp)
                frame = self._frame(color, *parts)
                if frame.heatmap is None and self._heatmaps:
                    self._await_heatmap(frame)
                return frame
        return None

    def take_late(self) -> Frame | None:
        """Return a frame that was taken before, with the heatmap that came after it; else None.

        It updates the map, and must not be used as the current observation.
        """
        return self._late.popleft() if self._late else None

    def forget(self, stamp_ns: int) -> None:
        """Discard a frame that the map refused, so that no late heatmap is joined to it."""
        self._without.pop(stamp_ns, None)

    def _await_heatmap(self, frame: Frame) -> None:
        self._without[frame.stamp_ns] = frame
        most = min(
            MAX_WITHOUT_HEATMAP,
            MAX_BYTES_WITHOUT_HEATMAP // (frame.color.nbytes + frame.depth.nbytes),
        )
        while len(self._without) > most:
            del self._without[next(iter(self._without))]

    def _frame_without(self, stamp_ns: int) -> Frame | None:
        near = min(self._without, key=lambda s: abs(s - stamp_ns), default=None)
        if near is None or abs(near - stamp_ns) > self._tolerance_ns:
            return None
        # Segmentations process images in order: heatmaps of older frames will not come.
        found = self._without[near]
        self._without = {s: f for s, f in self._without.items() if s > near}
        return found

    def _parts(self, color: CompressedColor) -> tuple[DepthImage, Seen | None] | None:
        depth = self._match(self._depths, color.stamp_ns)
        if depth is None or self._camera is None:
            return None
        frames = (self._camera.frame_id, BASE_FRAME)
        if any(self._pose(frame, color.stamp_ns) is None for frame in frames):
            return None
        heatmap = self._match(self._heatmaps, color.stamp_ns)
        if heatmap is None and self._heatmaps_come():
            return None
        return depth, heatmap

    def _heatmaps_come(self) -> bool:
        """Return whether heatmaps keep up, so that waiting for one is worthwhile."""
        newest = max(self._colors)
        # One that is further ahead is of the robot's clock before it was set back.
        ahead = newest + NANOSECONDS * self._config.backwards_s
        behind_ns = newest - max((s for s in self._heatmaps if s <= ahead), default=-(2**62))
        return behind_ns < NANOSECONDS * self._config.heatmap_wait_s

    def _frame(self, color: CompressedColor, depth: DepthImage, seen: Seen | None) -> Frame:
        assert self._camera is not None
        stamp = color.stamp_ns
        T_world_camera = self._pose(self._camera.frame_id, stamp)
        T_world_base = self._pose(BASE_FRAME, stamp)
        assert T_world_camera is not None
        assert T_world_base is not None
        T_base_camera = invert_transform(T_world_base) @ T_world_camera
        contact, self._contact = self._contact or self._pressed, False
        return Frame(
            stamp_ns=stamp,
            color=decompress_color(color.encoded),
            depth=depth.depth,
            camera=self._camera.camera,
            T_world_camera=T_world_camera,
            T_world_base=T_world_base,
            tilt_rad=math.asin(min(1.0, max(-1.0, float(T_base_camera[2, 2])))),
            heatmap=None if seen is None else self._heatmap_of(seen, depth.depth),
            contact=contact,
        )

    def _pose(self, frame: str, stamp_ns: int) -> Float64Array | None:
        return self._transforms.lookup(WORLD_FRAME, frame, stamp_ns + self._offset_ns)

    def _check_clock(self, stamp_ns: int) -> None:
        if self._taken_ns - stamp_ns > NANOSECONDS * self._config.backwards_s:
            self._colors.clear()
            self._depths.clear()
            self._heatmaps.clear()
            self._pairing.clear()
            self._image_stamps.clear()
            self._seen_ns = None
            self._pressed = self._contact = False
            self._without.clear()
            self._late.clear()
            self._taken_ns = -1
            self.restarts += 1

    def _put(self, store: dict[int, T], message: T) -> None:
        store.pop(message.stamp_ns, None)
        store[message.stamp_ns] = message
        while len(store) > MAX_PENDING:
            # The first to arrive, not the smallest stamp: stamps from the future must not stay.
            oldest = next(iter(store))
            if store is self._colors and oldest > self._taken_ns:
                self.skipped += 1
            del store[oldest]

    def _match(self, store: dict[int, T], stamp_ns: int) -> T | None:
        if stamp_ns in store:
            return store[stamp_ns]
        near = min(store, key=lambda s: abs(s - stamp_ns), default=None)
        if near is None or abs(near - stamp_ns) > self._tolerance_ns:
            return None
        return store[near]

    def _forget_up_to(self, stamp_ns: int) -> None:
        self.skipped += sum(1 for s in self._colors if s < stamp_ns)
        self._colors = {s: m for s, m in self._colors.items() if s > stamp_ns}
        self._depths = {s: m for s, m in self._depths.items() if s > stamp_ns}
        # The last heatmap stays: frames wait for a heatmap only while some arrive.
        newest = max(self._heatmaps, default=-1)
        self._heatmaps = {s: m for s, m in self._heatmaps.items() if s > stamp_ns or s == newest}


def assemble(assembler: FrameAssembler, key: str, payload: bytes) -> None:
    """Decode a message of a robot and add it; other messages are ignored.

    Args:
        assembler: Receives the message.
        key: Its key, without the robot's prefix.
        payload: Encoded message, live or recorded.

    Raises:
        MessageError: It cannot be decoded.
    """
    match key:
        case keys.TF:
            assembler.add_transforms(decode_transforms(payload))
        case keys.TF_STATIC:
            assembler.add_transforms(decode_transforms(payload), fixed=True)
        case keys.CAMERA_INFO:
            assembler.add_camera(decode_camera(payload))
        case keys.HEATMAP:
            assembler.add_heatmap(decode_heatmap(payload))
        case keys.BOXES:
            assembler.add_boxes(decode_detections(payload))
        case keys.MASKS:
            assembler.add_masks(decode_masks(payload))
        case keys.MASKS_COMPRESSED:
            assembler.add_masks(decode_masks_compressed(payload))
        case keys.LABEL_NAMES:
            assembler.detector.name_labels(decode_label_names(payload))
        case keys.DETECTOR_NAME:
            assembler.detector.name_network(decode_detector_name(payload))
        case keys.CONTACT:
            assembler.add_contact(decode_flag(payload))
        case keys.DEPTH:
            assembler.add_depth(decode_depth(payload))
        case keys.DEPTH_RAW:
            assembler.add_depth(decode_depth_raw(payload))
        case keys.COLOR:
            assembler.add_color(decode_color(payload))
        case _:
            return
