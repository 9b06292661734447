"""Whether a recording has the topics of a camera that a map is made of."""

from collections.abc import Sequence
from typing import Final

from app.messages import keys
from app.recording.reading.recording import Recording

COLORS: Final = (keys.COLOR, keys.COLOR_RAW)
DEPTHS: Final = (keys.DEPTH, keys.DEPTH_RAW)
POSES: Final = (keys.TF, keys.ODOM)
MOST_NAMED: Final = 12
"""Topics that a text names."""
_NAMING: Final = "--profile FILE with a section `ros2` that names"


def topic_problem(recording: Recording, *, poses: bool) -> str:
    """Return which topics of a map are missing or ambiguous; empty where none are.

    Args:
        recording: The recording.
        poses: Whether tf or odometry is needed.
    """
    needed = [COLORS, DEPTHS, (keys.CAMERA_INFO,), *((POSES,) if poses else ())]
    missing = [several for several in needed if not set(several) & set(recording.keys)]
    return _missing(recording, missing) if missing else _ambiguous(recording)


def _missing(recording: Recording, missing: Sequence[tuple[str, ...]]) -> str:
    kinds = {keys.ROS_TYPES[key] for several in missing for key in several}
    channels = recording.index.channels.values()
    there = sorted({f"{one.topic} ({one.type})" for one in channels if one.type in kinds})
    text = (
        f"it has no topic that ends in {', '.join(' or '.join(some) for some in missing)}: without "
        "colour, depth, camera info and tf or odometry there is nothing to map. It has "
        f"{', '.join(there[:MOST_NAMED]) or 'no other topic'} of such types; topics with other "
        f"names: {_NAMING} them (`ippon profile`)"
    )
    if missing == [POSES]:
        text += (
            ". A recording without poses is replayed with `ippon replay --no-poses`, for "
            "`ippon navigate --profile hand-held`, which finds them by the images"
        )
    return text


def _ambiguous(recording: Recording) -> str:
    """Return which topics of two cameras would be taken for one; empty where none would."""
    for key in (*COLORS, *DEPTHS, keys.CAMERA_INFO):
        topics = recording.topics(key)
        if len(topics) > 1 and not (key == keys.COLOR_RAW and keys.COLOR in recording.keys):
            return (
                f"it has several topics that end in {key}: {', '.join(topics[:MOST_NAMED])}. The "
                f"images of two cameras are not mixed: {_NAMING} those of one, or their `namespace`"
            )
    return ""
