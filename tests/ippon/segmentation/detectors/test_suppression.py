import numpy as np
import pytest

from ippon.segmentation.detectors.suppression import non_maximum_suppression


def area(box):
    return max(0.0, box[2] - box[0]) * max(0.0, box[3] - box[1])


def naive(boxes, scores, classes, overlap, most):
    """Compare each box with all that were kept before it."""
    kept = []
    for row in sorted(range(len(boxes)), key=lambda k: (-scores[k], k)):
        for other in kept:
            a, b = boxes[row], boxes[other]
            low, high = np.maximum(a[:2], b[:2]), np.minimum(a[2:], b[2:])
            shared = area((*low, *high))
            if classes[row] == classes[other] and shared > overlap * (area(a) + area(b) - shared):
                break
        else:
            kept.append(row)
    return kept[:most]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("overlap", [0.0, 0.3, 0.6])
def test_it_keeps_the_boxes_of_a_pairwise_comparison(seed, overlap):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-20, 100, (120, 2))
    boxes = np.concatenate([corners, corners + rng.uniform(-3, 60, (120, 2))], axis=1)
    scores = rng.integers(0, 20, 120) / 20.0
    classes = rng.integers(0, 4, 120)
    for most in (5, 300):
        got = non_maximum_suppression(boxes, scores, classes, overlap, most)
        assert got.tolist() == naive(boxes, scores, classes, overlap, most)


def test_the_best_of_boxes_that_cover_each_other_stays():
    boxes = np.array([[0, 0, 10, 10], [1, 1, 11, 11], [40, 40, 50, 50]], float)
    kinds = np.zeros(3, np.int64)
    assert non_maximum_suppression(boxes, np.array([0.5, 0.9, 0.3]), kinds, 0.6, 9).tolist() == [
        1,
        2,
    ]
    assert non_maximum_suppression(boxes[:0], np.zeros(0), kinds[:0], 0.6, 9).tolist() == []


def test_absurd_boxes_hide_no_others():
    boxes = np.array([[-1e300, 0, 1e300, 9], [0, 0, 9, 9], [50, 50, 60, 60]], float)
    kept = non_maximum_suppression(boxes, np.array([0.9, 0.8, 0.7]), np.zeros(3, np.int64), 0.6, 9)
    assert kept.tolist() == [0, 1, 2]
