"""Recorded messages into frames, as the navigator joins them."""

from collections.abc import Iterator
from typing import Final

from app.links.assembler import FrameAssembler
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.images import (
    decode_camera,
    decode_color,
    decode_depth,
    decode_depth_raw,
    decode_heatmap,
)
from app.messages.motion import decode_flag, decode_transforms
from app.recording.recording import RecordedMessage, Recording
from ippon.errors import FrameRejectedError
from ippon.frame import Frame

GEOMETRY: Final = (
    keys.COLOR, keys.CAMERA_INFO, keys.TF, keys.TF_STATIC, keys.DEPTH, keys.DEPTH_RAW,
)  # fmt: skip
FUSED: Final = (*GEOMETRY, keys.HEATMAP, keys.CONTACT)


def assemble(assembler: FrameAssembler, message: RecordedMessage) -> None:
    """Hand one message of `FUSED` to the assembler; others are none of its business.

    Raises:
        MessageError: It cannot be read.
    """
    payload = message.payload
    match message.key:
        case keys.TF:
            assembler.add_transforms(decode_transforms(payload))
        case keys.TF_STATIC:
            assembler.add_transforms(decode_transforms(payload), fixed=True)
        case keys.CAMERA_INFO:
            assembler.add_camera(decode_camera(payload))
        case keys.HEATMAP:
            assembler.add_heatmap(decode_heatmap(payload))
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


def geometry_frames(recording: Recording) -> Iterator[tuple[int, Frame]]:
    """Yield when it was recorded, and each frame of colour, depth and pose, without heatmaps.

    What cannot be read, or contradicts itself, is left out.
    """
    assembler = FrameAssembler()
    for message in recording.all_messages(GEOMETRY):
        try:
            assemble(assembler, message)
            frame = assembler.take()
        except (MessageError, FrameRejectedError):
            continue
        if frame is not None:
            yield message.time_ns, frame
