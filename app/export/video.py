"""Video of what the camera saw, and of the map as it grew, as H.264 in MP4."""

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

import av
import numpy as np
from numpy.typing import NDArray

from app.export.picture import draw_map, frame_of
from app.export.story import Story, need_map
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.images import decode_color, decompress_color
from app.nodes.review.player import Player
from app.recording.errors import RecordingError
from app.view.reader import SceneReader
from app.view.scene_model import SceneModel

CLOCK_HZ: Final = 1000
SCENE_HZ: Final = 4.0
SCENE_PX: Final = 720
QUALITY: Final = "23"

Pictures = Iterator[tuple[float, NDArray[np.uint8]]]


def write_camera_video(story: Story, path: Path) -> None:
    """Write every picture of the camera at its time.

    Raises:
        RecordingError: There is none.
    """
    if not _write(path, _camera_pictures(story)):
        raise RecordingError(f"{story.recording.path} has no picture of a camera")


def write_scene_video(story: Story, path: Path) -> None:
    """Write the map from above as it grew.

    Raises:
        RecordingError: There is no map.
    """
    indices, _, voxel_m = need_map(story)
    frame = frame_of(indices, voxel_m, SCENE_PX)

    def pictures() -> Pictures:
        scene = SceneModel()
        player = Player(story.recording, SceneReader(scene).feed, story.digest)
        while True:
            yield player.position_s, draw_map(scene, frame)
            if player.ended:
                return
            player.advance(1.0 / SCENE_HZ)

    _write(path, pictures())


def _camera_pictures(story: Story) -> Pictures:
    start_ns = story.recording.start_ns
    for message in story.recording.all_messages((keys.COLOR,)):
        try:
            image = decompress_color(decode_color(message.payload).encoded)
        except MessageError:
            # A damaged picture is left out; the one before it stays in view.
            continue
        yield (message.time_ns - start_ns) * 1e-9, image


def _write(path: Path, pictures: Pictures) -> int:
    """Encode pictures of any spacing in time; return how many."""
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
                # The camera was changed: a video has one size.
                continue
            picture = av.VideoFrame.from_ndarray(
                np.ascontiguousarray(image[:height, :width]), format="rgb24"
            )
            picture.pts = last = max(round(at_s * CLOCK_HZ), last + 1)
            picture.time_base = Fraction(1, CLOCK_HZ)
            container.mux(stream.encode(picture))
            count += 1
        if stream is not None:
            container.mux(stream.encode())
    finally:
        if container is not None:
            container.close()
    return count
