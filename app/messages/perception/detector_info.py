"""Name and class names of a detector: `vision_msgs` VisionInfo and LabelInfo."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from app.messages.cdr import MessageError, decode, encode, header, make, stamp_ns_of
from app.messages.perception.detections import MAX_NAME

MAX_NAMES: Final = 5000
"""Four times the size of the largest common vocabularies."""
MAX_BYTES: Final = 2**20
_LABELS: Final = "vision_msgs/msg/LabelInfo"
_DETECTOR: Final = "vision_msgs/msg/VisionInfo"


@dataclass(frozen=True, slots=True, kw_only=True)
class LabelNames:
    """Class names of a detector."""

    stamp_ns: int
    """Stamp of the first image that they apply to."""
    names: dict[int, str]
    """Names by class number."""


def encode_label_names(names: Sequence[str], stamp_ns: int) -> bytes:
    """Write the class names of a detector, numbered from 0."""
    classes = [
        make("vision_msgs/msg/VisionClass", class_id=k, class_name=name)
        for k, name in enumerate(names)
    ]
    return encode(_LABELS, header=header(stamp_ns, ""), class_map=classes, threshold=0.0)


def decode_label_names(payload: bytes) -> LabelNames:
    """Read the class names of a detector.

    Raises:
        MessageError: Not such a message, a duplicate number, or an invalid name.
    """
    message = decode(payload, _LABELS, max_bytes=MAX_BYTES)
    if not 1 <= len(message.class_map) <= MAX_NAMES:
        raise MessageError(f"label info holds 1 to {MAX_NAMES} names; got {len(message.class_map)}")
    names: dict[int, str] = {}
    for one in message.class_map:
        name = one.class_name.strip()
        if not 1 <= len(name) <= MAX_NAME:
            raise MessageError(
                f"label info: a name has 1 to {MAX_NAME} characters; number {one.class_id} has "
                f"{len(name)}"
            )
        if names.setdefault(one.class_id, name) != name:
            raise MessageError(
                f"label info: number {one.class_id} is both {names[one.class_id]!r} and {name!r}"
            )
    return LabelNames(stamp_ns=stamp_ns_of(message.header), names=names)


def encode_detector_name(name: str, stamp_ns: int) -> bytes:
    """Write the name of a detector's network."""
    return encode(
        _DETECTOR,
        header=header(stamp_ns, ""),
        method=name,
        database_location="",
        database_version=0,
    )


def decode_detector_name(payload: bytes) -> str:
    """Return the name of a detector's network: `method`, stripped.

    Raises:
        MessageError: Not such a message, or `method` is empty or too long.
    """
    message = decode(payload, _DETECTOR, max_bytes=2**16)
    name = message.method.strip()
    if not 1 <= len(name) <= MAX_NAME:
        raise MessageError(
            f"vision info names the network in `method`, in 1 to {MAX_NAME} characters; got "
            f"{len(name)}"
        )
    return name
