"""The second look: where it goes, and that it lands in the right place."""

import numpy as np
import pytest

from ippon.observation import Heatmap
from ippon.segmentation.crop_segmenter import CropConfig, CropSegmenter, Window, paste_heatmap
from ippon.segmentation.segmenter import segment_tour

LABELS = ("wall",)


class Coarse:
    """Sees red pixels as the hat, but only where they fill enough of the image it is given."""

    def __init__(self, least_share, hint=0):
        self.least_share = least_share
        self.hint = hint
        self.shapes = []

    def segment(self, color, labels, ooi):
        self.shapes.append(color.shape)
        red = color[..., 0] > 128
        p = np.zeros((*red.shape, 2), np.uint8)
        p[..., 1] = np.where(red, 255 if red.mean() >= self.least_share else self.hint, 0)
        p[..., 0] = 255 - p[..., 1]
        return Heatmap(labels=tuple(labels), ooi=ooi, probabilities=p)


def image(rows, columns):
    color = np.zeros((40, 60, 3), np.uint8)
    color[rows, columns] = (255, 0, 0)
    return color


@pytest.mark.parametrize(
    "place",
    [(slice(3, 6), slice(4, 8)), (slice(18, 21), slice(28, 32)), (slice(36, 39), slice(55, 59))],
)
def test_a_hint_draws_the_crop_and_the_crop_sees_the_thing(place):
    color = image(*place)
    share = (color[..., 0] > 0).mean()
    network = Coarse(2.0 * share, hint=40)
    heatmap = CropSegmenter(network).segment(color, LABELS, "hat")
    assert network.shapes == [(40, 60, 3), (20, 30, 3)]
    np.testing.assert_array_equal(heatmap.probabilities[..., 1] > 128, color[..., 0] > 128)


def test_without_a_hint_the_tiles_take_turns_and_cover_the_image():
    color = image(slice(30, 33), slice(45, 49))
    share = (color[..., 0] > 0).mean()
    segmenter = CropSegmenter(Coarse(2.0 * share))
    seen = [segmenter.segment(color, LABELS, "hat").probabilities[..., 1].max() for _ in range(9)]
    assert 1 <= sum(p == 255 for p in seen) < 9


def test_the_objects_of_a_tour_take_turns():
    corners = {"hat": (slice(3, 6), slice(4, 8)), "mug": (slice(36, 39), slice(55, 59))}

    seen = []

    class Both:
        def segment(self, color, labels, ooi):
            seen.append(color)
            p = np.zeros((40, 60, 3), np.uint8)
            p[corners["mug"]][..., 1] = p[corners["hat"]][..., 2] = 40
            return Heatmap(labels=tuple(labels), ooi=ooi, probabilities=p)

    color = np.zeros((40, 60, 3), np.uint8)
    color[corners["hat"]], color[corners["mug"]] = (1, 0, 0), (2, 0, 0)
    segmenter = CropSegmenter(Both())
    for _ in range(4):
        segment_tour(segmenter, color, ("wall", "mug"), ("hat", "mug"))
    assert [int(crop.max()) for crop in seen[1::2]] == [1, 2, 1, 2]


def test_a_thing_that_is_large_is_looked_at_once():
    network = Coarse(0.0)
    CropSegmenter(network).segment(image(slice(5, 35), slice(5, 50)), LABELS, "hat")
    assert len(network.shapes) == 1


def test_without_object_of_interest_there_is_one_look():
    network = Coarse(0.0)
    wall = np.zeros((40, 60, 3), np.uint8)

    class CommonOnly:
        def segment(self, color, labels, ooi):
            network.shapes.append(color.shape)
            p = np.full((*color.shape[:2], 1), 255, np.uint8)
            return Heatmap(labels=tuple(labels), ooi=None, probabilities=p)

    CropSegmenter(CommonOnly()).segment(wall, LABELS, None)
    assert len(network.shapes) == 1


def test_the_rim_of_the_crop_stays_except_at_the_images_border():
    whole = Heatmap(labels=LABELS, ooi=None, probabilities=np.zeros((20, 20, 1), np.uint8))
    part = Heatmap(labels=LABELS, ooi=None, probabilities=np.full((20, 20, 1), 9, np.uint8))
    inner = paste_heatmap(whole, part, Window(0.25, 0.0, 0.5, 0.5), 0.1).probabilities[..., 0]
    rows, columns = np.flatnonzero(inner.any(axis=1)), np.flatnonzero(inner.any(axis=0))
    assert (rows[0], rows[-1]) == (6, 13)
    assert (columns[0], columns[-1]) == (0, 8)


def test_invalid_crops_are_rejected():
    with pytest.raises(ValueError, match="crop_share must be in"):
        CropConfig(crop_share=1.0)
