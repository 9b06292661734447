import numpy as np

from app.messages.perception.detections import StampedBoxes
from app.view.camera.recognition import BOXES, boxes_of, heat_of, labels_of
from app.view.words import ENGLISH
from ippon.camera import PinholeCamera
from ippon.observation import Heatmap

CAMERA = PinholeCamera.from_horizontal_fov(400, 200, 1.2)


def _heatmap(ooi="hat"):
    channels = 2 + (ooi == "hat")
    probabilities = np.arange(4 * 6 * channels, dtype=np.uint8).reshape(4, 6, channels)
    return Heatmap(labels=("tv_stand", "sofa"), ooi=ooi, probabilities=probabilities)


def _boxes(names, scores, box=(40.0, 20.0, 200.0, 100.0)):
    count = len(names)
    return StampedBoxes(
        stamp_ns=0,
        frame_id="camera",
        boxes_px=np.tile(np.array(box), (count, 1)),
        scores=np.array(scores),
        names=tuple(names),
        numbers=np.arange(1, count + 1),
        count=count,
    )


def test_the_object_of_interest_or_a_chosen_label_is_shown():
    heatmap = _heatmap()
    np.testing.assert_array_equal(heat_of(heatmap, ""), heatmap.probabilities[:, :, 2])
    np.testing.assert_array_equal(heat_of(heatmap, "hat"), heatmap.probabilities[:, :, 2])
    np.testing.assert_array_equal(heat_of(heatmap, "TV stand"), heatmap.probabilities[:, :, 0])


def test_a_label_that_the_network_does_not_know_has_no_heat():
    assert heat_of(_heatmap(), "piano") is None
    assert heat_of(_heatmap(ooi=None), "") is None


def test_labels_are_listed_as_words():
    assert labels_of(_heatmap()) == ["sofa", "tv stand"]


def test_boxes_are_shares_of_the_image():
    (line,) = boxes_of(_boxes(["coffee_table"], [0.8]), CAMERA, "", 0, ENGLISH)
    assert line.text == "coffee table 80%"
    assert line.points[:3] == [(0.1, 0.1), (0.5, 0.1), (0.5, 0.5)]


def test_only_sure_boxes_of_the_label_are_drawn_and_not_too_many():
    boxes = _boxes(["sofa", "hat", "hat"], [0.9, 0.8, 0.1])
    assert len(boxes_of(boxes, CAMERA, "hat", 0, ENGLISH)) == 1
    assert len(boxes_of(_boxes(["sofa"] * 40, [0.9] * 40), CAMERA, "", 0, ENGLISH)) == BOXES


def test_a_box_that_is_not_finite_is_left_out():
    boxes = _boxes(["hat", "hat"], [0.9, np.nan], box=(np.nan, 0.0, 1.0, 1.0))
    assert boxes_of(boxes, CAMERA, "", 0, ENGLISH) == []
