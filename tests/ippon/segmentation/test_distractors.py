"""What is in no vocabulary gets labels of its own, and these are not handed on."""

import numpy as np
import pytest

from ippon.observation import Heatmap
from ippon.segmentation.distractors import DISTRACTORS, DistractorSegmenter, folded

IMAGE = np.zeros((2, 2, 3), np.uint8)


class BestMatch:
    """Gives every pixel to the label that is most like one thing, as a softmax would."""

    def __init__(self, likeness):
        self.likeness = likeness
        self.asked = ()

    def segment(self, color, labels, ooi):
        self.asked = (*labels, ooi)
        channels = [*labels, *([ooi] if ooi and ooi not in labels else [])]
        scores = np.array([self.likeness.get(name, 0.0) for name in channels])
        row = np.zeros(len(channels), np.uint8)
        row[scores.argmax()] = 255
        p = np.broadcast_to(row, (*color.shape[:2], len(channels))).copy()
        return Heatmap(labels=tuple(labels), ooi=ooi, probabilities=p)


def test_a_button_is_no_screwdriver_where_it_may_be_a_button():
    network = BestMatch({"button": 0.9, "screwdriver": 0.5, "wall": 0.1})
    alone = network.segment(IMAGE, ("wall", "others"), "screwdriver")
    assert alone.probabilities[0, 0].tolist() == [0, 0, 255]
    heatmap = DistractorSegmenter(network).segment(IMAGE, ("wall", "others"), "screwdriver")
    assert heatmap.labels == ("wall", "others")
    assert heatmap.probabilities[0, 0].tolist() == [0, 255, 0]


def test_what_falls_to_distractors_is_shared_out_where_nothing_means_others():
    network = BestMatch({"button": 1.0})
    heatmap = DistractorSegmenter(network).segment(IMAGE, ("wall", "floor"), "hat")
    assert sorted(heatmap.probabilities[0, 0].tolist()) == [0, 127, 128]


@pytest.mark.parametrize("ooi", ["coffee_mug", "mug", "mugs", "yellow_cup"])
def test_what_is_looked_for_has_no_rival_of_its_own_kind(ooi):
    added = DistractorSegmenter(BestMatch({})).distractors(("wall",), ooi)
    assert not {"cup", "mug", "glass"} & set(added)
    assert "button" in added


def test_common_labels_are_not_added_again():
    labels = ("wall", "pillow", "toolbox")
    added = DistractorSegmenter(BestMatch({})).distractors(labels, None)
    assert "pillow" not in added
    assert len(set(added)) == len(added)


def test_the_object_of_interest_is_found_as_before():
    network = BestMatch({"hat": 1.0, "button": 0.9})
    heatmap = DistractorSegmenter(network).segment(IMAGE, ("wall", "objects"), "hat")
    assert heatmap.probabilities[0, 0].tolist() == [0, 0, 255]


def test_folding_keeps_the_sum_of_every_pixel():
    rng = np.random.default_rng(0)
    p = rng.multinomial(255, np.full(7, 1 / 7), size=(3, 4)).astype(np.uint8)
    heatmap = Heatmap(labels=("a", "b", "c", "x", "y", "z"), ooi="hat", probabilities=p)
    kept = folded(heatmap, 3)
    assert kept.labels == ("a", "b", "c")
    assert (kept.probabilities.sum(axis=2, dtype=int) == 255).all()
    np.testing.assert_array_equal(kept.probabilities[..., -1], p[..., -1])


def test_no_label_stands_in_two_groups():
    names = [name for group in DISTRACTORS for name in group]
    assert len(names) == len(set(names))


def test_scores_that_a_distractor_exceeds_say_nothing():
    """Channels: wall, others, two distractors, hat."""
    values = np.array([[[200, 30, 90, 100, 60], [10, 30, 5, 6, 60]]], np.uint8)
    seen = Heatmap(
        labels=("wall", "others", "button", "cable"),
        ooi="hat",
        probabilities=values,
        kind="scores",
        source="clipseg",
    )
    kept = folded(seen, 2)
    assert (kept.labels, kept.ooi, kept.kind, kept.source) == (
        ("wall", "others"),
        "hat",
        "scores",
        "clipseg",
    )
    assert kept.probabilities.tolist() == [[[200, 100, 1], [10, 30, 60]]]
