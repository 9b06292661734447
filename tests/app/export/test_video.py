"""Videos of the camera."""

import av
import numpy as np
import pytest
from mcap.writer import Writer

from app.export.session_data import read_session_data
from app.export.video import write_camera_video
from app.messages import keys
from app.messages.images import encode_color
from app.recording.errors import RecordingError
from app.recording.writing.limits import RecordingLimits
from app.recording.writing.session import Session
from tests.app.messages.robot_messages import raw_color
from tests.app.recording.conftest import START_NS


@pytest.fixture
def film(tmp_path):
    """Write a recording of colour images, and its video; return the brightness of its pictures."""

    def write(*kinds):
        session = Session(tmp_path, "spot", RecordingLimits(min_free_gb=0.0), START_NS)
        for k in range(5):
            pixels = np.full((32, 48, 3), 40 * k, np.uint8)
            bright = np.full((32, 48, 3), 250, np.uint8)
            payloads = {
                keys.COLOR: encode_color(pixels, k, "optical"),
                keys.COLOR_RAW: raw_color(bright if keys.COLOR in kinds else pixels, k),
                keys.CONTACT: b"no picture",
            }
            for kind in kinds:
                session.add(kind, payloads[kind], START_NS + k * 10**9, float(k))
        session.close()
        data = read_session_data(session.writer.folder)
        try:
            write_camera_video(data, tmp_path / "camera.mp4")
        finally:
            data.recording.close()
        with av.open(str(tmp_path / "camera.mp4")) as video:
            return [frame.to_ndarray(format="gray").mean() for frame in video.decode(video=0)]

    return write


@pytest.mark.parametrize("kinds", [(keys.COLOR,), (keys.COLOR_RAW,), (keys.COLOR_RAW, keys.COLOR)])
def test_the_video_shows_raw_colour_where_no_compressed_one_is(film, kinds):
    np.testing.assert_allclose(film(*kinds), [40 * k for k in range(5)], atol=6)


def test_the_pictures_of_two_cameras_are_not_mixed(tmp_path):
    kind = keys.ROS_TYPES[keys.COLOR]
    with (tmp_path / "bag.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema(kind, "ros2msg", b"")
        for n, camera in enumerate(("front", "rear")):
            channel = writer.register_channel(f"/{camera}/{keys.COLOR}", "cdr", schema)
            image = encode_color(np.full((32, 48, 3), 100 * n, np.uint8), n, camera)
            writer.add_message(channel, n, image, n)
        writer.finish()
    data = read_session_data(tmp_path / "bag.mcap")
    with pytest.raises(RecordingError, match=r"several topics.*/front/.*/rear/"):
        write_camera_video(data, tmp_path / "camera.mp4")
    data.recording.close()
    assert not (tmp_path / "camera.mp4").exists()


def test_a_recording_without_pictures_says_so(film):
    with pytest.raises(RecordingError, match="has no picture of a camera"):
        film(keys.CONTACT)
