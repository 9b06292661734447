import numpy as np

from ippon.segmentation.detectors.decoding.yolo import decode_rows, decode_yolox, one_hot

SIZE = (64, 96)
CELLS = [
    (u, v, stride)
    for stride in (8, 16, 32)
    for v in range(SIZE[0] // stride)
    for u in range(SIZE[1] // stride)
]


def test_yolox_is_the_same_with_and_without_its_grid_applied():
    rng = np.random.default_rng(0)
    raw = rng.normal(0, 0.4, (len(CELLS), 5 + 4)).astype(np.float32)
    raw[:, 4:] = rng.uniform(size=(len(CELLS), 5))
    applied = raw.copy()
    for row, (u, v, stride) in enumerate(CELLS):
        applied[row, 0] = (raw[row, 0] + u) * stride
        applied[row, 1] = (raw[row, 1] + v) * stride
        applied[row, 2:4] = np.exp(raw[row, 2:4]) * stride
    x, y, w, h = applied[:, :4].T
    expected = np.stack([x - w / 2, y - h / 2, x + w / 2, y + h / 2], axis=1)
    for output in (raw, applied):
        found = decode_yolox(output, SIZE)
        np.testing.assert_allclose(found.boxes, expected, rtol=1e-5, atol=1e-4)
        np.testing.assert_allclose(found.scores, raw[:, 4:5] * raw[:, 5:], rtol=1e-6)


def test_noise_does_not_overflow():
    found = decode_yolox(np.full((len(CELLS), 9), 1e4, np.float32), SIZE)
    assert np.isfinite(found.boxes).all()


def test_rows_have_a_score_in_the_column_of_their_class():
    rows = np.array([[1, 2, 3, 4, 0.5, 1], [0, 0, 9, 9, 0.7, 7]], np.float32)
    found = decode_rows(rows, 3)
    assert found.scores.tolist() == [[0, 0.5, 0], [0, 0, 0]]
    assert found.distinct
    numbers = np.array([np.nan, -1.0, 2.0])
    assert one_hot(np.ones(3), numbers, 3).tolist() == [[0, 0, 0], [0, 0, 0], [0, 0, 1]]
