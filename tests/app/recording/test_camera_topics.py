"""Topics of a camera that are missing, or those of two cameras."""

import numpy as np
import pytest
from mcap.writer import Writer

from app.messages import keys
from app.messages.depth.depth_images import encode_depth
from app.messages.images import encode_camera, encode_color
from app.recording.camera_topics import image_problems, topic_problem
from app.recording.reading.recording import Recording
from ippon.camera import PinholeCamera


@pytest.fixture
def bag_of(tmp_path):
    opened = []

    def bag_of(messages):
        path = tmp_path / f"bag{len(opened)}.mcap"
        with path.open("wb") as file:
            writer = Writer(file)
            writer.start(profile="ros2")
            for name, kind, payload in messages:
                schema = writer.register_schema(kind, "ros2msg", b"")
                channel = writer.register_channel(name, "cdr", schema)
                writer.add_message(channel, 1, payload, 1)
            writer.finish()
        opened.append(Recording(path))
        return opened[-1]

    yield bag_of
    for recording in opened:
        recording.close()


@pytest.fixture
def problem_of(bag_of):
    def problem_of(topics, *, poses=True):
        return topic_problem(bag_of([(*one, b"\0\1\0\0") for one in topics]), poses=poses)

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


@pytest.mark.parametrize("key", [keys.TF, keys.TF_STATIC])
def test_the_transforms_of_two_robots_are_not_mixed(problem_of, key):
    topics = [*_camera("/x"), TF, *((f"{prefix}/{key}", keys.ROS_TYPES[key]) for prefix in "ab")]
    problem = problem_of(topics)
    assert f"several topics that end in {key}: " in problem
    assert "a/tf" in problem
    assert "--profile FILE with a section `ros2` that names one of them" in problem
    assert not problem_of(topics, poses=False)


def test_a_topic_of_another_type_is_none_of_a_camera(problem_of):
    other = "theora_image_transport/msg/Packet"
    problem = problem_of([(f"/x/{keys.COLOR}", other), *_camera("/x")[1:], TF])
    assert f"no topic that ends in {keys.COLOR}" in problem


def test_missing_poses_are_named_with_what_to_do(problem_of):
    assert "ippon replay --no-poses" in problem_of(_camera("/x"))


CAMERA = encode_camera(PinholeCamera.from_horizontal_fov(8, 6, 1.0), 1, "optical")
IMAGES = {
    keys.COLOR: encode_color(np.zeros((6, 8, 3), np.uint8), 1, "optical"),
    keys.DEPTH: encode_depth(np.ones((6, 8), np.float32), 1, "optical"),
    keys.CAMERA_INFO: CAMERA,
}


@pytest.mark.parametrize(
    ("key", "payload", "problem"),
    [
        (keys.CAMERA_INFO, CAMERA, ""),
        (keys.DEPTH, encode_depth(np.ones((3, 4), np.float32), 1, "o"), "depth is 4 x 3, the cam"),
        (keys.DEPTH, IMAGES[keys.COLOR], "compressed depth is 16UC1 or 32FC1; got format"),
        (keys.COLOR, IMAGES[keys.DEPTH], "a colour image is JPEG or PNG"),
    ],
)
def test_images_that_cannot_be_mapped_are_said(bag_of, key, payload, problem):
    bag = IMAGES | {key: payload}
    found = image_problems(bag_of([(f"/x/{k}", keys.ROS_TYPES[k], p) for k, p in bag.items()]))
    assert [problem in one for one in found] == [True] * bool(problem)
