"""Segmentation as a process: colour images and labels in, heatmaps out."""

import logging
import threading
import time
from dataclasses import dataclass
from typing import Final

import msgspec
import zenoh

from app.links.network.requests import last_message
from app.links.network.session import LinkError, open_client
from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.control import SegmentationLabels, decode
from app.messages.images import decode_color, decompress_color, encode_heatmap
from app.process.stop_signal import ProcessStopSignal, StopSignal
from ippon.segmentation.detectors.vocabulary import refusal_of
from ippon.segmentation.errors import SegmentationError
from ippon.segmentation.instance_heatmap import distribution_of
from ippon.segmentation.segmenter import Segmenter

logger = logging.getLogger(__name__)

ASK_EVERY_S: Final = 1.0
IDLE_S: Final = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentConfig:
    """Endpoint of the navigator, and size of the heatmaps."""

    connect: str
    robot: str
    keep: int = 4
    """Labels sent for each pixel, including the object of interest; more lose less information and
    take more bandwidth."""
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
        self._session = session
        self._segmenter = segmenter
        self._changed = threading.Condition()
        self._image: bytes | None = None
        self._labels: SegmentationLabels | None = None
        self._problem = ""
        self._refusal: str | None = None
        self._publisher = session.declare_publisher(
            f"{config.robot}/{keys.HEATMAP}", congestion_control=zenoh.CongestionControl.DROP
        )
        subscribe(session, f"{config.robot}/{keys.LABELS}", self._take_labels)
        subscribe(session, f"{config.robot}/{keys.COLOR}", self._take_image)

    def run(self, stop: StopSignal) -> None:
        """Segment until stopped."""
        asked_at = 0.0
        while not stop.is_set():
            if self._labels is None and time.monotonic() - asked_at > ASK_EVERY_S:
                asked_at = time.monotonic()
                self._ask_for_labels()
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
            seen = self._segmenter.segment(
                decompress_color(color.encoded), request.labels, request.ooi
            )
            # Messages carry probabilities alone.
            heatmap = distribution_of(seen, request.labels)
            message = encode_heatmap(
                heatmap, color.stamp_ns, color.frame_id, keep=self._config.keep
            )
        except (MessageError, SegmentationError, ValueError) as error:
            self._fail(str(error))
            return
        self._publisher.put(message)
        self.segmented += 1
        if self._problem:
            logger.info("segmentation works again")
            self._problem = ""

    def _fail(self, problem: str) -> None:
        self.failed += 1
        # The same error often repeats with every image: it is logged once.
        if problem != self._problem:
            logger.error("an image was not segmented: %s", problem)
            self._problem = problem

    def _ask_for_labels(self) -> None:
        last = last_message(self._session, f"{self._config.robot}/{keys.LABELS}", ASK_EVERY_S)
        if last is not None:
            self._take_labels(last)

    def _take_labels(self, payload: bytes) -> None:
        try:
            request = decode(payload, SegmentationLabels)
        except msgspec.DecodeError as error:
            self.failed += 1
            logger.warning("labels skipped: %s", error)
            return
        refusal = None if request.ooi is None else refusal_of(self._segmenter, request.ooi)
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


def run_segment(config: SegmentConfig, segmenter: Segmenter) -> None:
    """Segment a robot's images until SIGINT or SIGTERM.

    Raises:
        LinkError: No navigator answers.
    """
    stop = ProcessStopSignal()
    session = _connected(config, stop)
    if session is None:
        return
    try:
        node = SegmentNode(config, session, segmenter)
        logger.info("segmenting the images of %s", config.robot)
        node.run(stop)
        logger.info(
            "%d images segmented, %d skipped, %d failed", node.segmented, node.skipped, node.failed
        )
    finally:
        session.close()  # pyright: ignore[reportUnknownMemberType]


def _connected(config: SegmentConfig, stop: StopSignal) -> zenoh.Session | None:
    """Open a session, waiting for the navigator; None when stopped meanwhile."""
    deadline = time.monotonic() + config.wait_s
    while not stop.is_set():
        try:
            return open_client(config.connect, timeout_s=2.0)
        except LinkError:
            if time.monotonic() > deadline:
                raise
    return None
