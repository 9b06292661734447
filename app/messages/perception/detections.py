"""Boxes of a detector as `vision_msgs/msg/Detection2DArray`, of ROS 2 Humble and later."""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.messages.cdr import decode, encode, header, make, stamp_ns_of
from ippon.observation import Detections, Instance

MAX_BOXES: Final = 1000
"""Maximum number of hypotheses read from a message, best score first; three times the limit of an
observation, so that unused labels do not displace the others."""
MAX_NAME: Final = 80
"""Maximum characters of a name; longer names are ignored."""
MAX_BYTES: Final = 8 * 2**20
"""About 19,000 detections, which take a third of a second to decode."""
_ARRAY: Final = "vision_msgs/msg/Detection2DArray"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StampedBoxes:
    """Output of a detector for an image, with its class names; only sizes are checked.

    One row per hypothesis: every hypothesis of a detection is evidence, and the object of interest
    is often the second.
    """

    stamp_ns: int
    frame_id: str
    boxes_px: NDArray[np.float64]
    """(N, 4) left, top, right, bottom in pixels; may be reversed, not finite or outside the
    image."""
    scores: NDArray[np.float64]
    """(N,) scores as received."""
    names: tuple[str, ...]
    """(N) class names as received."""
    numbers: NDArray[np.int64]
    """(N,) detection of each row, counted from 1: the value of its pixels in a mask image."""
    count: int
    """Detections in the message."""
    dropped: int = 0
    """Number of hypotheses beyond `MAX_BOXES`, or with a name that is empty or too long."""


def encode_detections(detections: Detections, stamp_ns: int, frame_id: str) -> bytes:
    """Write the instances of an image; each is a detection with one hypothesis."""
    top = header(stamp_ns, frame_id)
    boxes = [_detection(top, one, n) for n, one in enumerate(detections.instances, start=1)]
    return encode(_ARRAY, header=top, detections=boxes)


def decode_detections(payload: bytes) -> StampedBoxes:
    """Read the boxes of an image; a rotated one becomes the upright box around it.

    Raises:
        MessageError: Not such a message, or longer than `MAX_BYTES`.
    """
    message = decode(payload, _ARRAY, max_bytes=MAX_BYTES)
    rows = [
        (_upright(detection.bbox), result.hypothesis.score, result.hypothesis.class_id, number)
        for number, detection in enumerate(message.detections, start=1)
        for result in detection.results
    ]
    named = [row for row in rows if 0 < len(row[2].strip()) <= MAX_NAME]
    # Scores that are not a number are sorted last, and dropped later.
    named.sort(key=lambda row: row[1] if math.isfinite(row[1]) else -math.inf, reverse=True)
    kept = named[:MAX_BOXES]
    return StampedBoxes(
        stamp_ns=stamp_ns_of(message.header),
        frame_id=message.header.frame_id,
        boxes_px=np.array([row[0] for row in kept], np.float64).reshape(-1, 4),
        scores=np.array([row[1] for row in kept], np.float64),
        names=tuple(row[2].strip() for row in kept),
        numbers=np.array([row[3] for row in kept], np.int64),
        count=len(message.detections),
        dropped=len(rows) - len(kept),
    )


def _upright(box: Any) -> tuple[float, float, float, float]:
    """Return the smallest upright box around a rotated one; NaN for an invalid one."""
    x, y, theta = box.center.position.x, box.center.position.y, box.center.theta
    if not (box.size_x >= 0.0 and box.size_y >= 0.0 and math.isfinite(theta)):
        # Rotated by 45 degrees, a box with one negative side would appear valid.
        return math.nan, math.nan, math.nan, math.nan
    cos, sin = abs(math.cos(theta)), abs(math.sin(theta))
    half_x = 0.5 * (cos * box.size_x + sin * box.size_y)
    half_y = 0.5 * (sin * box.size_x + cos * box.size_y)
    return x - half_x, y - half_y, x + half_x, y + half_y


def _detection(top: Any, instance: Instance, number: int) -> Any:
    left, upper, right, lower = instance.box_px
    return make(
        "vision_msgs/msg/Detection2D",
        header=top,
        results=[
            make(
                "vision_msgs/msg/ObjectHypothesisWithPose",
                hypothesis=make(
                    "vision_msgs/msg/ObjectHypothesis",
                    class_id=instance.label,
                    score=float(instance.score),
                ),
                pose=_no_pose(),
            )
        ],
        bbox=make(
            "vision_msgs/msg/BoundingBox2D",
            center=make(
                "vision_msgs/msg/Pose2D",
                position=make(
                    "vision_msgs/msg/Point2D", x=0.5 * (left + right), y=0.5 * (upper + lower)
                ),
                theta=0.0,
            ),
            size_x=right - left,
            size_y=lower - upper,
        ),
        id=str(number),
    )


def _no_pose() -> Any:
    """Return the placeholder pose of a detection in an image."""
    return make(
        "geometry_msgs/msg/PoseWithCovariance",
        pose=make(
            "geometry_msgs/msg/Pose",
            position=make("geometry_msgs/msg/Point", x=0.0, y=0.0, z=0.0),
            orientation=make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
        ),
        covariance=np.zeros(36),
    )
