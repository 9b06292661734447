import numpy as np
import pytest

from ippon.segmentation.instances import MAX_INSTANCES, make_detections


def found(boxes, scores, names=None, **more):
    return make_detections(
        np.array(boxes, np.float64).reshape(-1, 4), np.array(scores, np.float64),
        names or ["cup"] * len(scores), source="x", labels=("cup",), ooi="cup",
        image_size=(100, 200), **more,
    )  # fmt: skip


def test_best_score_first_and_cut_off_at_the_border():
    out = found([(10, 10, 30, 30), (-50, -50, 20, 20)], [0.2, 0.9])
    assert [one.score for one in out.instances] == [0.9, 0.2]
    assert out.instances[0].box_px == (0.0, 0.0, 20.0, 20.0)


@pytest.mark.parametrize(
    ("box", "score"),
    [
        ((300, 10, 320, 30), 0.5),
        ((30, 10, 10, 30), 0.5),
        ((np.nan, 10, 30, 30), 0.5),
        ((10, 10, np.inf, 30), 0.5),
        ((10, 10, 10.2, 30), 0.5),
        ((10, 10, 30, 30), np.nan),
        ((10, 10, 30, 30), 1.5),
    ],
)
def test_invalid_instances_are_dropped_and_counted(box, score):
    out = found([box, (10, 10, 30, 30)], [score, 0.5])
    assert len(out.instances) == 1
    assert out.dropped == 1


def test_ten_thousand_boxes_are_cut_to_the_best():
    out = found(np.tile([10, 10, 30, 30], (10_000, 1)), np.linspace(0, 1, 10_000))
    assert len(out.instances) == MAX_INSTANCES
    assert out.dropped == 10_000 - MAX_INSTANCES
    assert out.instances[-1].score > 0.96


def test_labels_that_were_not_asked_for_are_no_error():
    out = found([(10, 10, 30, 30)], [0.5], ["dog"])
    assert out.instances == ()
    assert out.dropped == 0


def test_lengths_must_agree():
    with pytest.raises(ValueError, match="differ"):
        found([(10, 10, 30, 30)], [0.5, 0.6])
