"""Frames of a recording, assembled as in the navigator."""

from collections.abc import Iterator
from typing import Final

from app.links.robot_streams.assembler import FrameAssembler, assemble
from app.messages import keys
from app.messages.cdr import MessageError
from app.recording.reading.recording import Recording
from ippon.errors import FrameRejectedError
from ippon.frame import Frame

GEOMETRY: Final = (
    keys.COLOR, keys.CAMERA_INFO, keys.TF, keys.TF_STATIC, keys.DEPTH, keys.DEPTH_RAW,
)  # fmt: skip
FUSED: Final = (*GEOMETRY, *keys.SEEN, keys.CONTACT)


def geometry_frames(recording: Recording) -> Iterator[tuple[int, Frame]]:
    """Yield each frame of colour, depth and pose, without heatmap, with its time of recording.

    Undecodable messages and inconsistent frames are skipped.
    """
    assembler = FrameAssembler()
    for message in recording.all_messages(GEOMETRY):
        try:
            assemble(assembler, message.key, message.payload)
            frame = assembler.take()
        except (MessageError, FrameRejectedError):
            continue
        if frame is not None:
            yield message.time_ns, frame
