"""A robot's detector in the words of the map."""

import numpy as np
import pytest

from app.links.robot_streams.robot_detector import RobotDetector
from app.messages.perception.detection_masks import StampedMasks
from app.messages.perception.detections import StampedBoxes
from app.messages.perception.detector_info import LabelNames
from app.robot_file import DetectorTable
from ippon.observation_model import LEAST_SCORE, NOT_RECOGNISED, NOTHING_SAID

DEPTH = np.full((48, 64), 2.0, np.float32)
ASKED = ("wall", "sofa", "table")


def boxes(*rows):
    return StampedBoxes(
        stamp_ns=1,
        frame_id="cam",
        boxes_px=np.array([box for box, _, _ in rows], np.float64).reshape(-1, 4),
        scores=np.array([score for _, score, _ in rows], np.float64),
        names=tuple(name for _, _, name in rows),
        numbers=np.arange(1, len(rows) + 1),
        count=len(rows),
    )


BOX = (20.0, 15.0, 40.0, 35.0)


def detector(table=None, names=None, ooi="cup"):
    one = RobotDetector(table)
    one.ask(ASKED, ooi)
    if names is not None:
        one.name_labels(LabelNames(stamp_ns=0, names=dict(enumerate(names))))
    return one


def test_names_synonyms_numbers_and_the_table():
    table = DetectorTable(labels={"Coffee Mug": "cup", "meja": "table"})
    one = detector(table, names=["person", "couch", "Coffee Mug", "meja"])
    rows = [(BOX, 0.9, name) for name in ("couch", "coffee mug", "3", "person", "nonsense")]
    seen = one.detections(boxes(*rows), None, (48, 64))
    assert sorted(x.label for x in seen.instances) == ["cup", "sofa", "table"]
    assert seen.labels == ("sofa", "table", "cup")
    assert seen.ooi == "cup"
    assert seen.source == "detector"


def test_without_its_names_nothing_is_said_of_labels_without_a_box():
    seen = detector().detections(boxes((BOX, 0.9, "couch")), None, (48, 64))
    assert seen.labels == ("sofa",)
    assert seen.ooi is None
    heatmap = detector().heatmap(boxes((BOX, 0.9, "cup")), None, DEPTH)
    assert heatmap.ooi == "cup"
    assert heatmap.labels == ()


def test_with_its_names_what_has_no_box_was_not_recognised():
    heatmap = detector(names=["cup", "couch"]).heatmap(boxes((BOX, 0.9, "couch")), None, DEPTH)
    assert (heatmap.labels, heatmap.ooi, heatmap.kind) == (("sofa",), "cup", "scores")
    assert heatmap.probabilities[24, 30, 0] == 230
    assert heatmap.probabilities[24, 50, 1] == NOT_RECOGNISED
    assert heatmap.probabilities[0, 0, 1] == NOTHING_SAID, "at the border of the image"


def test_the_profile_names_the_network_before_the_detector_does():
    one = detector()
    one.name_network("yolo11n")
    assert one.detections(boxes(), None, (48, 64)).source == "yolo11n"
    one = detector(DetectorTable(source="mine"))
    one.name_network("yolo11n")
    assert one.detections(boxes(), None, (48, 64)).source == "mine"


def test_what_it_cannot_tell_is_said_with_what_it_can():
    assert detector(names=["cup", "couch"], ooi="mug").refusal() == ""
    assert detector(ooi="hat").refusal() == "", "its names are not known"
    text = detector(names=["cup", "couch"], ooi="hat").refusal()
    assert text.startswith("this detector knows 2 kinds of thing and 'hat' is none of them")
    one = detector(names=["cup", "couch"], ooi="mug")
    one.ask(ASKED, "mug", ("hat",))
    assert "'hat' is none of them" in one.refusal()


def test_further_objects_of_interest_come_before_common_ones():
    one = detector(names=["cup", "couch"], ooi="sofa")
    one.ask((*ASKED, "cup"), "sofa", ("mug",))
    seen = one.detections(boxes((BOX, 0.9, "couch"), (BOX, 0.8, "cup")), None, (48, 64))
    assert [x.label for x in seen.instances] == ["sofa", "mug"]
    assert seen.labels == ("sofa", "mug"), "no surface is said to be no cup for its boxes of mugs"


def test_a_common_label_whose_boxes_are_the_objects_is_not_said_to_be_missing():
    one = detector(names=["cup", "dining table"], ooi="desk")
    heatmap = one.heatmap(boxes((BOX, 0.9, "dining table")), None, DEPTH)
    assert (heatmap.labels, heatmap.ooi) == ((), "desk")


def test_a_class_that_answers_to_several_labels_is_named_by_all_of_them():
    """As `ippon segment` names a class with labels of its own."""
    one = detector(names=["mug/jar", "cup"], ooi="jar")
    one.ask((*ASKED, "mug"), "jar")
    assert one.refusal() == ""
    seen = one.detections(boxes(), None, (48, 64))
    assert (seen.labels, seen.ooi) == (("jar",), "jar"), "its misses count, and mugs are not asked"


def test_boxes_of_a_detector_that_tells_two_kinds_apart_keep_their_names():
    """Such as an open-vocabulary network, which names the labels that it was asked for."""
    one = detector(names=["plant", "flower pot", "tv"], ooi="flower_pot")
    one.ask(("wall", "plant", "tv"), "flower_pot", ("monitor",))
    rows = [(BOX, 0.9, name) for name in ("plant", "flower pot", "tv")]
    seen = one.detections(boxes(*rows), None, (48, 64))
    assert [x.label for x in seen.instances] == ["plant", "flower_pot", "monitor"]
    one = detector(DetectorTable(labels={"krug": "mug"}), names=["krug", "cup"], ooi="mug")
    seen = one.detections(boxes((BOX, 0.9, "krug"), (BOX, 0.8, "cup")), None, (48, 64))
    assert [(x.label, x.score) for x in seen.instances] == [("mug", 0.9)]


def test_masks_are_used_where_they_fit_and_boxes_where_not():
    numbers = np.zeros((48, 64), np.uint16)
    numbers[20:30, 25:35] = 1
    one = detector(names=["cup"])
    masks = StampedMasks(stamp_ns=1, frame_id="cam", numbers=numbers)
    inside = one.heatmap(boxes((BOX, 0.9, "cup")), masks, DEPTH).probabilities >= LEAST_SCORE
    assert inside.sum() == 100
    assert one.problem == ""
    wrong = StampedMasks(stamp_ns=1, frame_id="cam", numbers=numbers[:, :40])
    inside = one.heatmap(boxes((BOX, 0.9, "cup")), wrong, DEPTH).probabilities >= LEAST_SCORE
    assert inside.sum() == pytest.approx(400, abs=50)
    assert "not in proportion" in one.problem


@pytest.mark.parametrize(
    "row",
    [((0.3, 0.3, 0.6, 0.7), 0.9, "cup"), (BOX, 90.0, "cup")],
    ids=["shares of the image", "percent"],
)
def test_images_of_a_detector_in_other_units_are_counted(row):
    one = detector(names=["cup"])
    for _ in range(3):
        one.heatmap(boxes(row), None, DEPTH)
        one.heatmap(boxes(), None, DEPTH)
    assert one.misfits == 3
    one.heatmap(boxes((BOX, 0.9, "cup"), row), None, DEPTH)
    assert one.misfits == 0


def test_boxes_that_are_none_change_nothing():
    bad = [
        ((np.nan, 0.0, 9.0, 9.0), 0.9, "cup"),
        ((40.0, 15.0, 20.0, 35.0), 0.9, "cup"),
        ((100.0, 0.0, 200.0, 9.0), 0.9, "cup"),
        (BOX, 1.5, "cup"),
        (BOX, np.nan, "cup"),
    ]
    heatmap = detector(names=["cup"]).heatmap(boxes(*bad), None, DEPTH)
    assert (heatmap.probabilities < LEAST_SCORE).all()


def test_a_new_request_is_read_with_the_new_words():
    one = detector(names=["cup", "couch"])
    assert one.detections(boxes((BOX, 0.9, "couch")), None, (48, 64)).instances[0].label == "sofa"
    one.ask(("couch",), "mug")
    seen = one.detections(boxes((BOX, 0.9, "couch"), (BOX, 0.8, "cup")), None, (48, 64))
    assert [x.label for x in seen.instances] == ["couch", "mug"]
    assert seen.ooi == "mug"
