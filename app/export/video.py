"""Videos of the camera and of the growing map, as H.264 in MP4."""

from collections.abc import Iterator
from fractions import Fraction
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.export.map_picture import MapFromAbove, draw_things, extent_of
from app.export.session_data import OnProgress, SessionData, need_map, no_progress
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.images import COLOR_DECODERS
from app.messages.scene import decode_voxels
from app.recording.camera_topics import mixed
from app.recording.errors import RecordingError
from app.recording.map_alignment import alignment_message
from app.recording.reading.recording import RecordedMessage
from app.view.model.scene_model import SceneModel
from app.view.model.scene_reader import SceneReader

CLOCK_HZ: Final = 1000
SCENE_HZ: Final = 4.0
SCENE_PICTURES: Final = 1200
POSE_NS: Final = 100_000_000
"""Time before a picture in which the robot's poses are read."""
SCENE_PX: Final = 720
QUALITY: Final = "23"
NEEDS: Final = 'videos need PyAV: pip install "ippon[video]" (100 MB)'

Pictures = Iterator[tuple[float, NDArray[np.uint8]]]


def can_write() -> bool:
    """Return whether the package that encodes videos is installed."""
    return find_spec("av") is not None


def write_camera_video(
    session: SessionData, path: Path, on_progress: OnProgress = no_progress
) -> None:
    """Write every camera image at its time.

    Raises:
        RecordingError: There is no image, those of two cameras, or no package that encodes them.
    """
    if not _write(path, _camera_pictures(session), session.recording.duration_s, on_progress):
        raise RecordingError(f"{session.recording.path} has no picture of a camera")


def write_scene_video(
    session: SessionData, path: Path, on_progress: OnProgress = no_progress
) -> None:
    """Write the growing map from above.

    Raises:
        RecordingError: There is no map, or no package that encodes it.
    """
    _write(path, _scene_pictures(session), session.recording.duration_s, on_progress)


def _scene_pictures(session: SessionData) -> Pictures:
    recording = session.recording
    indices, _, voxel_m = need_map(session)
    frame = extent_of(indices, voxel_m, SCENE_PX)
    above = MapFromAbove(indices, voxel_m, frame, floor_z_m=session.scene.floor_z_m)
    scene = SceneModel()
    reader = SceneReader(scene)
    aligned = alignment_message(recording, recording.start_ns)
    if aligned is not None:
        reader.feed(aligned.key, aligned.payload)
    for message in recording.all_messages((keys.TF_STATIC,)):
        reader.feed(message.key, message.payload)
    # The number of pictures is bounded, because drawing one costs more than storing it.
    every_ns = max(round(1e9 / SCENE_HZ), (recording.end_ns - recording.start_ns) // SCENE_PICTURES)
    before_ns, now_ns = recording.start_ns - 1, recording.start_ns
    while True:
        for message in recording.between(before_ns, now_ns, (keys.MAP_VOXELS, keys.MAP_KEYFRAME)):
            _grow(above, message, voxel_m)
        for message in recording.between(before_ns, now_ns, (keys.MAP_ALIGNMENT,)):
            reader.feed(message.key, message.payload)
        for message in recording.between(now_ns - POSE_NS, now_ns, (keys.TF,)):
            reader.feed(message.key, message.payload)
        for key in (keys.STATUS, keys.DETECTIONS):
            last = recording.latest(key, now_ns)
            if last is not None and last.time_ns > before_ns:
                reader.feed(key, last.payload)
        yield (now_ns - recording.start_ns) * 1e-9, draw_things(above.image(), scene, frame)
        if now_ns >= recording.end_ns:
            return
        before_ns, now_ns = now_ns, min(now_ns + every_ns, recording.end_ns)


def _grow(above: MapFromAbove, message: RecordedMessage, voxel_m: float) -> None:
    try:
        cloud = decode_voxels(message.payload)
    except MessageError:
        # Undecodable messages are skipped; the next keyframe repeats their content.
        return
    if message.key == keys.MAP_KEYFRAME:
        above.clear()
    others = (cloud.ooi, cloud.proximity, cloud.level, cloud.label, cloud.confidence)
    above.take(
        cloud.indices(voxel_m).astype(np.int64),
        np.column_stack([cloud.color, *others]),
        ~cloud.removed,
    )


def _camera_pictures(session: SessionData) -> Pictures:
    recording = session.recording
    key = keys.COLOR if keys.COLOR in recording.keys else keys.COLOR_RAW
    if several := mixed(recording, (key,)):
        raise RecordingError(f"{recording.path}: {several}")
    for message in recording.all_messages((key,)):
        try:
            image = COLOR_DECODERS[key](message.payload)
        except MessageError:
            # A damaged picture is skipped; the previous one stays.
            continue
        yield (message.time_ns - recording.start_ns) * 1e-9, image


def _write(path: Path, pictures: Pictures, duration_s: float, on_progress: OnProgress) -> int:
    """Encode pictures with their times; return their number."""
    try:
        import av  # noqa: PLC0415
    except ImportError as error:
        raise RecordingError(NEEDS) from error
    count, last = 0, -1
    container: Any = None
    stream: Any = None
    try:
        for at_s, image in pictures:
            height, width = (2 * (n // 2) for n in image.shape[:2])
            if stream is None:
                container = av.open(str(path), "w")
                stream = container.add_stream("libx264", rate=Fraction(30))
                stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
                stream.codec_context.time_base = Fraction(1, CLOCK_HZ)
                stream.options = {"crf": QUALITY, "preset": "veryfast"}
            if (width, height) != (stream.width, stream.height):
                # A video has one size; pictures of another camera are skipped.
                continue
            picture = av.VideoFrame.from_ndarray(
                np.ascontiguousarray(image[:height, :width]), format="rgb24"
            )
            picture.pts = last = max(round(at_s * CLOCK_HZ), last + 1)
            picture.time_base = Fraction(1, CLOCK_HZ)
            container.mux(stream.encode(picture))
            count += 1
            on_progress(at_s / max(duration_s, 1e-9))
        if stream is not None:
            container.mux(stream.encode())
    finally:
        if container is not None:
            container.close()
    return count
