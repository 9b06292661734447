"""Topics of a camera that are missing, or those of two cameras."""

import pytest
from mcap.writer import Writer

from app.messages import keys
from app.recording.camera_topics import topic_problem
from app.recording.reading.recording import Recording


@pytest.fixture
def problem_of(tmp_path):
    def problem_of(topics, *, poses=True):
        path = tmp_path / "bag.mcap"
        with path.open("wb") as file:
            writer = Writer(file)
            writer.start(profile="ros2")
            for name, kind in topics:
                schema = writer.register_schema(kind, "ros2msg", b"")
                channel = writer.register_channel(name, "cdr", schema)
                writer.add_message(channel, 1, b"\0\1\0\0", 1)
            writer.finish()
        recording = Recording(path)
        try:
            return topic_problem(recording, poses=poses)
        finally:
            recording.close()

    return problem_of


def _camera(prefix, *more):
    known = (keys.COLOR, keys.DEPTH, keys.CAMERA_INFO, *more)
    return [(f"{prefix}/{key}", keys.ROS_TYPES[key]) for key in known]


TF = ("/tf", keys.ROS_TYPES[keys.TF])


def test_one_camera_has_no_problem(problem_of):
    assert not problem_of([*_camera("/x", keys.COLOR_RAW), TF])
    assert not problem_of(_camera(""), poses=False)


def test_the_images_of_two_cameras_are_not_mixed(problem_of):
    problem = problem_of([*_camera("/front"), *_camera("/rear"), TF])
    assert f"several topics that end in {keys.COLOR}" in problem
    assert f"/front/{keys.COLOR}, /rear/{keys.COLOR}" in problem
    assert "--profile" in problem


def test_a_topic_of_another_type_is_none_of_a_camera(problem_of):
    other = "theora_image_transport/msg/Packet"
    problem = problem_of([(f"/x/{keys.COLOR}", other), *_camera("/x")[1:], TF])
    assert f"no topic that ends in {keys.COLOR}" in problem


def test_missing_poses_are_named_with_what_to_do(problem_of):
    assert "ippon replay --no-poses" in problem_of(_camera("/x"))
