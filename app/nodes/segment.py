"""Segmentation as a process: colour images and labels in, heatmaps or detections out."""

import logging
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import msgspec
import zenoh

from app.links.network.last_messages import request_when_seen
from app.links.network.latched_topic import LatchedReceiver
from app.links.network.session import LinkError, open_client
from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.control import decode
from app.messages.images import CompressedColor, decode_color, decompress_color
from app.messages.perception.detection_masks import encode_masks
from app.messages.perception.detections import MAX_NAME, encode_detections
from app.messages.perception.detector_info import encode_detector_name, encode_label_names
from app.messages.perception.heatmaps import encode_heatmap
from app.messages.status import SegmentationLabels
from app.process.stop_signal import ProcessStopSignal, StopSignal
from ippon.observation import Detections, Heatmap
from ippon.segmentation.detectors.vocabulary import (
    ClosedVocabulary,
    closed_vocabulary,
    unsupported_reason,
)
from ippon.segmentation.errors import SegmentationError
from ippon.segmentation.segmenter import Segmenter, segment_tour

logger = logging.getLogger(__name__)

IDLE_S: Final = 0.2
RETRY_S: Final = 0.5
"""Pause between two attempts to reach the navigator."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentConfig:
    """Endpoint of the navigator, and size of the heatmaps."""

    connect: str
    robot: str
    keep: int = 4
    """Labels sent for each pixel, including the object of interest and besides further ones of a
    tour; more lose less information and take more bandwidth."""
    wait_s: float = 300.0
    """Time to wait for the navigator, which compiles its kernels before it answers."""

    def __post_init__(self) -> None:
        """Refuse an invalid prefix or number of labels."""
        keys.check_prefix(self.robot)
        if not 1 <= self.keep <= 512:
            raise ValueError(f"1 to 512 labels of each pixel are sent; got {self.keep}")


class SegmentNode:
    """Segments the newest image; images that arrive during a segmentation are skipped."""

    def __init__(self, config: SegmentConfig, session: zenoh.Session, segmenter: Segmenter) -> None:
        self.segmented = 0
        self.skipped = 0
        """Images replaced by a newer one before they were segmented."""
        self.failed = 0
        """Images and messages that could not be used."""
        self._config = config
        self._segmenter = segmenter
        self._changed = threading.Condition()
        self._image: bytes | None = None
        self._labels: SegmentationLabels | None = None
        self._problem = ""
        self._refusal: str | None = None
        self._publishers = {
            key: session.declare_publisher(
                f"{config.robot}/{key}", congestion_control=zenoh.CongestionControl.DROP
            )
            for key in (keys.HEATMAP, keys.BOXES, keys.MASKS_COMPRESSED)
        }
        self._kept = {
            key: zenoh.ext.declare_advanced_publisher(
                session, f"{config.robot}/{key}", cache=zenoh.ext.CacheConfig(max_samples=1),
                publisher_detection=True,
                # A lost name is not sent again.
                congestion_control=zenoh.CongestionControl.BLOCK,
            )
            for key in (keys.LABEL_NAMES, keys.DETECTOR_NAME)
        }  # fmt: skip
        self._told: tuple[str, tuple[str, ...]] = ("", ())
        latched = LatchedReceiver(self._take_labels)
        subscribe(session, f"{config.robot}/{keys.COLOR}", self._take_image)
        subscribe(session, f"{config.robot}/{keys.LABELS}", latched.receive)
        request_when_seen(session, config.robot, {keys.LABELS: latched})

    def run(self, stop: StopSignal) -> None:
        """Segment until stopped."""
        while not stop.is_set():
            with self._changed:
                if self._image is None or self._labels is None:
                    self._changed.wait(IDLE_S)
                request = self._labels
                image = self._image if request is not None else None
                if image is not None:
                    self._image = None
            if request is not None and image is not None:
                self._segment(image, request)

    def _segment(self, payload: bytes, request: SegmentationLabels) -> None:
        try:
            color = decode_color(payload)
            seen = segment_tour(
                self._segmenter,
                decompress_color(color.encoded),
                [*request.labels, *request.also],
                _goals(request),
            )
            if isinstance(seen, Detections):
                self._publish_detections(seen, color)
            else:
                self._publish_heatmap(seen, color, request.also)
        except (MessageError, SegmentationError, ValueError) as error:
            self._fail(str(error))
            return
        self.segmented += 1
        if self._problem:
            logger.info("segmentation works again")
            self._problem = ""

    def _publish_heatmap(
        self, heatmap: Heatmap, color: CompressedColor, also: Sequence[str]
    ) -> None:
        message = encode_heatmap(
            heatmap, color.stamp_ns, color.frame_id, keep=self._config.keep, also=also
        )
        self._publishers[keys.HEATMAP].put(message)

    def _publish_detections(self, seen: Detections, color: CompressedColor) -> None:
        vocabulary = closed_vocabulary(self._segmenter)
        told = seen.source, seen.labels if vocabulary is None else _names_of(vocabulary)
        if told != self._told:
            self._told = told
            self._kept[keys.DETECTOR_NAME].put(encode_detector_name(told[0], color.stamp_ns))
            # A detector that was asked for nothing it knows has no names to tell.
            if told[1]:
                self._kept[keys.LABEL_NAMES].put(encode_label_names(told[1], color.stamp_ns))
        masks = encode_masks(seen, color.stamp_ns, color.frame_id)
        if masks is not None:
            self._publishers[keys.MASKS_COMPRESSED].put(masks)
        boxes = encode_detections(seen, color.stamp_ns, color.frame_id)
        self._publishers[keys.BOXES].put(boxes)

    def _fail(self, problem: str) -> None:
        self.failed += 1
        # The same error often repeats with every image: it is logged once.
        if problem != self._problem:
            logger.error("an image was not segmented: %s", problem)
            self._problem = problem

    def _take_labels(self, payload: bytes) -> None:
        try:
            request = decode(payload, SegmentationLabels)
        except msgspec.DecodeError as error:
            self.failed += 1
            logger.warning("labels skipped: %s", error)
            return
        refusals = (unsupported_reason(self._segmenter, label) for label in _goals(request))
        refusal = next(filter(None, refusals), None)
        if refusal is not None and refusal != self._refusal:
            logger.warning("%s", refusal)
        self._refusal = refusal
        with self._changed:
            self._labels = request
            self._changed.notify()

    def _take_image(self, payload: bytes) -> None:
        with self._changed:
            self.skipped += self._image is not None
            self._image = payload
            self._changed.notify()


def _goals(request: SegmentationLabels) -> list[str]:
    """Return the objects of interest, the first one first."""
    return [label for label in (request.ooi, *request.also) if label is not None]


def _names_of(vocabulary: ClosedVocabulary) -> tuple[str, ...]:
    """Return the names for label info; several in one that is too long for it are split."""
    names = (
        (name,) if len(name) <= MAX_NAME else name.split("/") for name in vocabulary.told_names
    )
    return tuple(dict.fromkeys(one for some in names for one in some))


def run_segment(config: SegmentConfig, segmenter: Segmenter) -> None:
    """Segment a robot's images until SIGINT or SIGTERM.

    Raises:
        LinkError: No navigator answers.
    """
    stop = ProcessStopSignal()
    session = _connected(config, stop)
    if session is None:
        return
    with session:
        node = SegmentNode(config, session, segmenter)
        logger.info("segmenting the images of %s", config.robot)
        node.run(stop)
        logger.info(
            "%d images segmented, %d skipped, %d failed", node.segmented, node.skipped, node.failed
        )


def _connected(config: SegmentConfig, stop: StopSignal) -> zenoh.Session | None:
    """Open a session, waiting for the navigator; None when stopped meanwhile."""
    deadline = time.monotonic() + config.wait_s
    waits = False
    while not stop.is_set():
        try:
            return open_client(config.connect, timeout_s=2.0)
        except LinkError as error:
            if time.monotonic() > deadline:
                raise
            if not waits:
                logger.info("waiting up to %.0f s for the navigator: %s", config.wait_s, error)
            waits = True
            stop.wait(RETRY_S)
    return None
