"""Scores and instances as probabilities."""

import numpy as np

from ippon.observation import Detections, Heatmap, Instance
from ippon.segmentation.instance_heatmap import distribution_of

LABELS = ("cup", "tv", "wall")


def seen(*instances, ooi=None, labels=LABELS):
    return Detections(
        source="some", labels=labels, ooi=ooi, image_size=(60, 80), instances=instances
    )


def cup(score, mask=None, label="cup"):
    return Instance(label=label, score=score, box_px=(20.0, 30.0, 40.0, 60.0), mask=mask)


def test_pixels_sum_to_255_and_without_an_instance_all_labels_are_alike():
    heatmap = distribution_of(seen(cup(0.7), cup(0.4, label="tv")), LABELS, 40)
    assert (heatmap.kind, heatmap.source, heatmap.labels) == ("distribution", "some", LABELS)
    p = heatmap.probabilities
    assert p.shape == (30, 40, 3)
    assert (p.sum(axis=2, dtype=int) == 255).all()
    assert (p[0, 0] == 85).all()


def test_a_box_covers_its_pixels_and_a_mask_its_own():
    inside = distribution_of(seen(cup(0.9)), LABELS, 40).probabilities[..., 0] > 85
    assert np.argwhere(inside).min(axis=0).tolist() == [15, 10]
    assert np.argwhere(inside).max(axis=0).tolist() == [29, 19]
    mask = np.zeros((6, 8), np.bool_)
    mask[2, 5] = True
    inside = distribution_of(seen(cup(0.9, mask)), LABELS, 40).probabilities[..., 0] > 85
    assert np.argwhere(inside).min(axis=0).tolist() == [10, 25]
    assert np.argwhere(inside).max(axis=0).tolist() == [14, 29]


def test_more_evidence_is_never_less():
    def at(*scores):
        return distribution_of(seen(*map(cup, scores)), LABELS).probabilities[45, 30, 0]

    values = [at(), at(0.3), at(0.3, 0.3), at(0.3, 0.9), at(1.0)]
    assert values == sorted(values)
    assert values[0] == 85
    assert values[-1] == 255


def test_channels_are_those_asked_for():
    heatmap = distribution_of(seen(cup(0.9), ooi="cup"), LABELS)
    assert (heatmap.labels, heatmap.ooi_channel) == (LABELS, 0)
    heatmap = distribution_of(seen(cup(0.9), ooi="cup", labels=("tv", "cup")), ("wall", "tv"))
    assert (heatmap.labels, heatmap.ooi_channel) == (("wall", "tv"), 2)
    assert heatmap.probabilities[45, 30].argmax() == 2
    # A label that is not asked for is left out.
    heatmap = distribution_of(seen(cup(0.9)), ("wall", "tv"))
    assert np.ptp(heatmap.probabilities.astype(int), axis=2).max() <= 1


def test_scores_become_probabilities_and_probabilities_stay():
    values = np.array([[[204, 0, 1], [255, 255, 2]]], np.uint8)
    scores = Heatmap(labels=LABELS, ooi=None, probabilities=values, kind="scores", source="c")
    heatmap = distribution_of(scores, LABELS)
    assert (heatmap.kind, heatmap.source) == ("distribution", "c")
    assert heatmap.probabilities[0, 0].tolist() == [221, 17, 17]
    assert heatmap.probabilities[0, 1].argmin() == 2
    assert (heatmap.probabilities.sum(axis=2, dtype=int) == 255).all()
    assert distribution_of(heatmap, LABELS) is heatmap
