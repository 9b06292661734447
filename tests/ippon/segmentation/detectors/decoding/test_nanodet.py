import numpy as np
import pytest

from ippon.segmentation.detectors.decoding.nanodet import decode_nanodet
from ippon.segmentation.detectors.errors import OutputError


def naive_boxes(output, classes, size):
    """Go through the cells one by one."""
    boxes = []
    row = 0
    for stride in (8, 16, 32, 64):
        for v in range(-(-size[0] // stride)):
            for u in range(-(-size[1] // stride)):
                away = []
                for side in range(4):
                    bins = output[row, classes + 8 * side : classes + 8 * side + 8]
                    shares = np.exp(bins) / np.exp(bins).sum()
                    away.append(stride * sum(n * share for n, share in enumerate(shares)))
                x, y = u * stride, v * stride
                boxes.append((x - away[0], y - away[1], x + away[2], y + away[3]))
                row += 1
    return np.array(boxes)


def test_boxes_are_those_of_the_cells_one_by_one():
    rng = np.random.default_rng(0)
    output = rng.normal(size=(8 * 12 + 4 * 6 + 2 * 3 + 2, 3 + 32)).astype(np.float32)
    found = decode_nanodet(output, 3, (64, 96))
    np.testing.assert_allclose(found.boxes, naive_boxes(output, 3, (64, 96)), atol=1e-5)
    np.testing.assert_allclose(found.scores, output[:, :3])


def test_outputs_of_another_shape_are_refused():
    with pytest.raises(OutputError) as caught:
        decode_nanodet(np.zeros((85, 112), np.float32), 79, (64, 64))
    assert str(caught.value) == (
        "NanoDet-Plus with 79 classes gives (85, 79 + 4 x bins) for an input of 64x64; this "
        "network gives (85, 112). Another number of classes needs --segmentation.labels-file"
    )
