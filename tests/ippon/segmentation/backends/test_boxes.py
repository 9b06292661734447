"""Which boxes are distinct things, and what each is."""

import pytest

from ippon.segmentation.errors import SegmentationError
from ippon.segmentation.instances import MAX_INSTANCES
from tests import later

# torch and transformers take seconds to load.
pytestmark = pytest.mark.slow

later.needs("torch", extra="segmentation")
torch = later.module("torch")
distinct_boxes, labelled_boxes = later.names(
    "ippon.segmentation.backends.boxes", "distinct_boxes", "labelled_boxes"
)


@pytest.fixture(scope="module")
def four():
    """Boxes of which the second lies within the first."""
    return torch.tensor([[0, 0, 10, 10], [0, 0, 10, 9], [20, 20, 30, 30], [5, 5, 15, 15.0]])


def test_a_box_that_a_better_one_covers_is_left_out(four):
    scores = torch.tensor([0.5, 0.9, 0.05, 0.3])
    assert distinct_boxes(four, scores).tolist() == [1, 3, 2]
    assert distinct_boxes(four[:0], scores[:0]).tolist() == []
    same = four[:1].expand(5, 4)
    assert distinct_boxes(same, torch.ones(5)).tolist() == [0]


def test_it_agrees_with_a_plain_loop():
    generator = torch.Generator().manual_seed(1)
    corner = torch.rand(60, 2, generator=generator) * 20
    boxes = torch.cat([corner, corner + 5 + torch.rand(60, 2, generator=generator) * 20], dim=1)
    scores = torch.rand(60, generator=generator)
    kept = []
    for k in scores.argsort(descending=True).tolist():
        a = boxes[k].tolist()
        for other in kept:
            b = boxes[other].tolist()
            wide = max(0.0, min(a[2], b[2]) - max(a[0], b[0]))
            high = max(0.0, min(a[3], b[3]) - max(a[1], b[1]))
            both = sum((c[2] - c[0]) * (c[3] - c[1]) for c in (a, b)) - wide * high
            if wide * high / both >= 0.7:
                break
        else:
            kept.append(k)
    assert 10 < len(kept) < 60
    assert distinct_boxes(boxes, scores).tolist() == kept


def test_only_the_best_are_considered():
    many = torch.arange(4.0 * (MAX_INSTANCES + 50)).reshape(-1, 4)
    many[:, 2:] = many[:, :2] + 1
    assert len(distinct_boxes(many, torch.ones(len(many)))) == MAX_INSTANCES


def test_nan_scores_are_rejected(four):
    with pytest.raises(SegmentationError) as caught:
        distinct_boxes(four, torch.tensor([0.1, float("nan"), 0.2, 0.3]))
    assert str(caught.value) == (
        "the network gave values that are not numbers; try --segmentation.precision float32"
    )


def test_each_thing_has_the_label_that_fits_best(four):
    fits = torch.tensor([[0.6, 0.2], [0.3, 0.5], [0.05, 0.04], [0.1, 0.4]])
    seen = labelled_boxes(
        four, fits, 0.1, source="s", channels=("cup", "tv"), ooi="tv", image_size=(12, 40)
    )
    assert [(one.label, round(one.score, 3)) for one in seen.instances] == [
        ("cup", 0.6),
        ("tv", 0.4),
    ]
    assert seen.instances[1].box_px == (5.0, 5.0, 15.0, 12.0)
