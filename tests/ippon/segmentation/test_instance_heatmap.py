import numpy as np
import pytest

from ippon.observation import Detections, Instance
from ippon.observation_model import LEAST_SCORE, NOT_RECOGNISED, NOTHING_SAID
from ippon.segmentation.instance_heatmap import _paint_kernel, heatmap_of_instances
from tests.reference import instance_heatmap as reference


def detections(*instances, labels=("cup", "table"), ooi="cup", size=(120, 160)):
    return Detections(source="x", labels=labels, ooi=ooi, image_size=size, instances=instances)


def scene():
    """A table at 1.5 m before a wall at 3 m; a cup of the table's depth stands in it."""
    depth = np.full((120, 160), 2.9, np.float32)
    depth[40:100, 20:140] = 1.5
    return depth


def test_a_box_covers_pixels_at_the_depth_of_its_middle():
    heat = heatmap_of_instances(
        detections(Instance(label="table", score=0.8, box_px=(10, 30, 150, 110))), scene()
    )
    table = heat.probabilities[..., heat.labels.index("table")]
    assert (table[41:99, 21:139] == 204).all()
    assert table[32, 80] == NOT_RECOGNISED
    assert heat.kind == "scores"


def test_an_object_in_front_takes_the_pixels():
    table = Instance(label="table", score=0.8, box_px=(20, 40, 140, 100))
    cup = Instance(label="cup", score=0.6, box_px=(70, 60, 90, 80))
    heat = heatmap_of_instances(detections(table, cup), scene()).probabilities
    assert heat[70, 80].tolist() == [NOTHING_SAID, 153]
    weak = Instance(label="cup", score=0.2, box_px=(70, 60, 90, 80))
    heat = heatmap_of_instances(detections(table, weak), scene()).probabilities
    assert heat[70, 80].tolist() == [204, 51]


def test_objects_that_stand_apart_have_the_scores_that_they_have_alone():
    table = Instance(label="table", score=0.8, box_px=(20, 40, 140, 100))
    cup = Instance(label="cup", score=0.6, box_px=(70, 60, 90, 80))
    vase = Instance(label="vase", score=0.9, box_px=(72, 62, 88, 78))
    labels = ("cup", "table", "vase")
    heat = heatmap_of_instances(detections(table, cup, vase, labels=labels), scene())
    assert heat.probabilities[70, 80].tolist() == [NOTHING_SAID, 230, NOTHING_SAID], (
        "the vase alone"
    )
    heat = heatmap_of_instances(
        detections(table, cup, vase, labels=labels), scene(), apart=("cup", "vase")
    )
    assert heat.probabilities[70, 80].tolist() == [NOTHING_SAID, 230, 153]


def test_pixels_without_depth_far_away_or_at_edges_carry_no_evidence():
    depth = scene()
    depth[50:60, 50:60] = 0.0
    depth[70:80, 60:70] = 4.0
    heat = heatmap_of_instances(detections(), depth).probabilities
    for v, u in ((55, 55), (75, 65), (1, 80), (60, 1)):
        assert (heat[v, u] == NOTHING_SAID).all()
    assert (heat[90, 100] == NOT_RECOGNISED).all()


def test_a_mask_takes_the_place_of_the_box():
    mask = np.zeros((60, 80), np.bool_)
    mask[30:40, 30:60] = True
    one = Instance(label="cup", score=0.5, box_px=(20, 40, 140, 100), mask=mask)
    cup = heatmap_of_instances(detections(one), scene()).probabilities[..., -1]
    assert (cup[62:78, 62:118] > 100).all()
    assert (cup[42:58, 30:130] <= NOTHING_SAID).all()


@pytest.mark.parametrize("side", [24, 60, 160, 200, 480, 960])
def test_a_mask_of_any_size_keeps_its_place(side):
    """A mask and its mirror image are mirrored in the heatmap."""
    rows, columns = 3 * side // 4, side
    v, u = np.mgrid[:rows, :columns]
    mask = np.hypot((v + 0.5) / side - 0.31, (u + 0.5) / side - 0.42) < 0.21
    box = (0.0, 0.0, 160.0, 120.0)
    depth = np.full((120, 160), 2.0, np.float32)
    painted = [
        heatmap_of_instances(
            detections(Instance(label="cup", score=0.5, box_px=box, mask=one)), depth
        ).probabilities[..., -1]
        >= LEAST_SCORE
        for one in (mask, mask[::-1, ::-1])
    ]
    there, back = painted[0], painted[1][::-1, ::-1]
    for axis in (0, 1):
        middles = [np.argwhere(one)[:, axis].mean() for one in (there, back)]
        assert abs(middles[0] - middles[1]) < 0.2


def test_depth_that_is_infinite_is_no_return():
    wide = np.repeat(np.repeat(scene(), 3, axis=0), 3, axis=1)
    wide[::7, ::5] = 0.0
    wide[60:90] = 0.0
    one = Instance(label="table", score=0.8, box_px=(10, 30, 150, 110))
    expected = heatmap_of_instances(detections(one), wide).probabilities
    for value in (np.inf, np.nan, -np.inf):
        other = np.where(wide > 0.0, wide, np.float32(value))
        np.testing.assert_array_equal(
            heatmap_of_instances(detections(one), other).probabilities, expected
        )


def test_depth_of_another_shape_is_refused():
    with pytest.raises(ValueError, match="does not fit an image of 160x120"):
        heatmap_of_instances(detections(), np.ones((100, 100), np.float32))


@pytest.mark.parametrize("seed", range(6))
def test_painting_agrees_with_numpy(seed):
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 256, (12, 14, 5)).astype(np.uint8)
    image[rng.random(image.shape) < 0.5] = NOTHING_SAID
    image[rng.random(image.shape) < 0.3] = NOT_RECOGNISED
    inside = rng.random((6, 7)) < 0.7
    value, mine, is_apart = int(rng.integers(2, 256)), int(rng.integers(5)), rng.random(5) < 0.4
    expected = image.copy()
    expected[3:9, 2:9] = reference.painted(image[3:9, 2:9], inside, value, mine, is_apart)
    _paint_kernel(inside, value, mine, is_apart, image[3:9, 2:9])
    np.testing.assert_array_equal(image, expected)
