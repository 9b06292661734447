import numpy as np
import pytest

from ippon.simulation.segmentation.instance_boxes import instance_boxes
from tests.reference import instance_boxes as reference


@pytest.mark.parametrize("seed", range(5))
def test_boxes_agree_with_numpy(seed):
    rng = np.random.default_rng(seed)
    instance = rng.integers(-1, 9, (13, 17)).astype(np.int32)
    instance[:, :6] = 3
    depth = rng.uniform(-1.0, 4.0, (13, 17)).astype(np.float32).clip(0.0)
    seen = instance_boxes(instance, depth, 12)
    expected = reference.boxes(instance, depth)
    assert seen.instance.tolist() == sorted(expected)
    for k, box, z in zip(*seen, strict=True):
        assert tuple(box) == expected[k][0]
        assert z == pytest.approx(expected[k][1])


def test_an_empty_image_has_no_boxes():
    empty = np.full((4, 5), -1, np.int32), np.zeros((4, 5), np.float32)
    assert [len(column) for column in instance_boxes(*empty, 3)] == [0, 0, 0]
