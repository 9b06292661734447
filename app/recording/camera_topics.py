"""Whether a recording has the topics of a camera that a map is made of."""

from collections.abc import Sequence
from typing import Final

from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.depth.depth_images import DEPTH_DECODERS
from app.messages.images import COLOR_DECODERS, decode_camera
from app.recording.reading.recording import Recording

COLORS: Final = tuple(COLOR_DECODERS)
DEPTHS: Final = tuple(DEPTH_DECODERS)
POSES: Final = (keys.TF, keys.ODOM)
TRANSFORMS: Final = (keys.TF, keys.TF_STATIC)
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
    if missing:
        return _missing(recording, missing)
    images = mixed(recording, (*COLORS, *DEPTHS, keys.CAMERA_INFO))
    return images or (mixed(recording, TRANSFORMS) if poses else "")


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


def mixed(recording: Recording, used: Sequence[str]) -> str:
    """Return which topics of two cameras or robots would be taken for one; empty where none would.

    Args:
        recording: The recording.
        used: Keys of images, of camera info, or of poses.
    """
    for key in used:
        topics = recording.topics(key)
        if len(topics) > 1 and not (key == keys.COLOR_RAW and keys.COLOR in recording.keys):
            several = f"it has several topics that end in {key}: {', '.join(topics[:MOST_NAMED])}. "
            if key in (*TRANSFORMS, keys.ODOM):
                return f"{several}Poses of two sources are not mixed: {_NAMING} one of them"
            return (
                f"{several}The images of two cameras are not mixed: {_NAMING} those of one, or "
                "their `namespace`"
            )
    return ""


def image_problems(recording: Recording) -> list[str]:
    """Return why the first images of a recording, or what is said of its camera, are not usable."""
    problems: list[str] = []
    sizes: dict[str, tuple[int, int]] = {}
    for key in (*COLORS, *DEPTHS, keys.CAMERA_INFO):
        message = recording.first(key)
        if message is None or (key == keys.COLOR_RAW and keys.COLOR in recording.keys):
            continue
        try:
            sizes[key] = _size_of(key, message.payload)
        except MessageError as error:
            problems.append(f"{recording.topics(key)[0]}: {error}")
    depths = {sizes[key] for key in DEPTHS if key in sizes}
    camera = sizes.get(keys.CAMERA_INFO)
    if camera is not None:
        problems += [
            f"depth is {width} x {height}, the camera of {camera[0]} x {camera[1]}: depth must be "
            "registered to colour and of its size (align_depth, depth_registered)"
            for width, height in sorted(depths - {camera})
        ]
    return problems


def _size_of(key: str, payload: bytes) -> tuple[int, int]:
    """Return width and height that a message says."""
    if key == keys.CAMERA_INFO:
        camera = decode_camera(payload).camera
        return camera.width, camera.height
    is_depth = key in DEPTH_DECODERS
    image = DEPTH_DECODERS[key](payload).depth if is_depth else COLOR_DECODERS[key](payload)
    return image.shape[1], image.shape[0]
