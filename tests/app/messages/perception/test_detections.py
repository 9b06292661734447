"""`vision_msgs/Detection2DArray` as any detector may send it."""

import math
import time

import numpy as np
import pytest

from app.messages.cdr import MessageError, encode, header, make
from app.messages.perception.detections import (
    MAX_BOXES,
    MAX_NAME,
    decode_detections,
    encode_detections,
)
from ippon.observation import Detections, Instance


def detections(*instances):
    return Detections(
        source="x", labels=("cup", "tv"), ooi=None, image_size=(48, 64), instances=instances
    )


def point(x, y):
    return make("vision_msgs/msg/Point2D", x=float(x), y=float(y))


def result(name, score):
    hypothesis = make("vision_msgs/msg/ObjectHypothesis", class_id=name, score=float(score))
    pose = make(
        "geometry_msgs/msg/PoseWithCovariance",
        pose=make(
            "geometry_msgs/msg/Pose",
            position=make("geometry_msgs/msg/Point", x=0.0, y=0.0, z=0.0),
            orientation=make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
        ),
        covariance=np.zeros(36),
    )
    return make("vision_msgs/msg/ObjectHypothesisWithPose", hypothesis=hypothesis, pose=pose)


def box(x, y, w, h, *results, theta=0.0):
    return make(
        "vision_msgs/msg/Detection2D",
        header=header(7, "cam"),
        results=list(results),
        bbox=make(
            "vision_msgs/msg/BoundingBox2D",
            center=make("vision_msgs/msg/Pose2D", position=point(x, y), theta=theta),
            size_x=float(w),
            size_y=float(h),
        ),
        id="",
    )


def array(*boxes):
    return encode(
        "vision_msgs/msg/Detection2DArray", header=header(7, "cam"), detections=list(boxes)
    )


def test_what_is_sent_comes_back():
    rng = np.random.default_rng(3)
    instances = []
    for _ in range(50):
        left, top = rng.uniform(0, 30, 2)
        w, h = rng.uniform(1, 30, 2)
        instances.append(
            Instance(
                label=str(rng.choice(["cup", "tv"])),
                score=float(rng.uniform()),
                box_px=(left, top, left + w, top + h),
            )
        )
    read = decode_detections(encode_detections(detections(*instances), 7, "cam"))
    assert (read.stamp_ns, read.frame_id, read.count, read.dropped) == (7, "cam", 50, 0)
    order = [n - 1 for n in read.numbers]
    assert sorted(order) == list(range(50))
    assert list(read.scores) == sorted((one.score for one in instances), reverse=True)
    for row, n in enumerate(order):
        assert read.names[row] == instances[n].label
        assert read.boxes_px[row] == pytest.approx(instances[n].box_px, abs=1e-6)


def test_every_hypothesis_of_a_box_counts_for_itself():
    read = decode_detections(
        array(box(10, 10, 4, 4, result("tv", 0.6), result(" cup ", 0.3)), box(30, 30, 4, 4))
    )
    assert read.names == ("tv", "cup")
    assert list(read.numbers) == [1, 1]
    assert read.count == 2


def test_a_turned_box_becomes_the_upright_box_around_it():
    read = decode_detections(array(box(20, 20, 10, 2, result("cup", 1), theta=math.pi / 2)))
    assert read.boxes_px[0] == pytest.approx((19, 15, 21, 25))


@pytest.mark.parametrize(
    "bad",
    [
        box(10, 10, -4, 4, result("cup", 1), theta=0.8),
        box(10, 10, math.nan, 4, result("cup", 1)),
        box(math.inf, 10, 4, 4, result("cup", 1)),
        box(10, 10, 4, 4, result("cup", 1), theta=math.nan),
    ],
)
def test_a_box_that_is_none_is_not_finite(bad):
    assert not np.isfinite(decode_detections(array(bad)).boxes_px).all()


def test_names_that_are_none_are_dropped_and_counted():
    read = decode_detections(
        array(box(9, 9, 4, 4, result("", 1), result("x" * (MAX_NAME + 1), 1), result("cup", 0.2)))
    )
    assert read.names == ("cup",)
    assert read.dropped == 2


@pytest.mark.slow
def test_ten_thousand_boxes_are_read_in_time_and_the_best_kept():
    rng = np.random.default_rng(0)
    scores = rng.uniform(size=10_000)
    scores[5] = math.nan
    payload = array(*(box(9, 9, 4, 4, result("cup", s)) for s in scores))
    begun = time.thread_time()
    read = decode_detections(payload)
    assert time.thread_time() - begun < 5.0
    assert len(read.names) == MAX_BOXES
    assert read.dropped == 10_000 - MAX_BOXES
    assert read.scores[0] == np.nanmax(scores)
    with pytest.raises(MessageError):
        decode_detections(payload * 6)


def test_damaged_bytes_never_do_more_than_a_message_error(survives_damage):
    payload = array(*(box(9 + n, 9, 4, 4, result("cup", 0.5)) for n in range(5)))
    survives_damage(decode_detections, payload)
