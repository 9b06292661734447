import numpy as np
import pytest

from ippon.segmentation.detectors.image_input import ImageInput


@pytest.mark.parametrize("fit", ["corner", "centre", "stretch"])
@pytest.mark.parametrize("shape", [(48, 64), (64, 48), (5, 200), (416, 416), (1, 1)])
def test_the_image_fills_its_part_and_boxes_come_back(fit, shape):
    wanted = ImageInput(size=(96, 128), fit=fit, padding=0)
    values, place = wanted.prepare(np.full((*shape, 3), 255, np.uint8))
    assert (values.shape, values.dtype) == ((3, 96, 128), np.float32)
    rows, columns = np.nonzero(values[0])
    filled = np.array([[columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]], float)
    back = place.boxes_in_image(filled)
    np.testing.assert_allclose(back, [[0, 0, shape[1], shape[0]]], atol=1e-9)
    down, across = place.share_of_input(96, 128)
    assert values[0, down, across].min() == 1.0
    assert values[0].sum() == values[0, down, across].sum()


def test_values_are_scaled_in_the_order_of_the_channels():
    color = np.zeros((2, 4, 3), np.uint8)
    color[..., 0], color[..., 2] = 200, 50
    wanted = ImageInput(
        size=(4, 4), fit="corner", channels="BGR", mean=(10.0, 20.0, 30.0), factor=(1.0, 2.0, 3.0)
    )
    values, _ = wanted.prepare(color)
    assert values[:, 0, 0].tolist() == [40.0, -40.0, 510.0]
    assert values[:, 3, 0].tolist() == [104.0, 188.0, 252.0]


def test_the_border_may_be_the_mean():
    wanted = ImageInput(size=(4, 4), fit="corner", mean=(10.0, 20.0, 30.0), padding=None)
    values, _ = wanted.prepare(np.full((2, 4, 3), 99, np.uint8))
    assert (values[:, 2:] == 0).all()
    assert (values[:, :2] > 0).all()
