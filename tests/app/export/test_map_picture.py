"""The map from above, with the finds of a session."""

import numpy as np
import pytest

from app.export.map_picture import MapFromAbove, PictureExtent, draw_map
from app.view.colors import FOUND
from app.view.model.scene_model import SceneModel


@pytest.mark.parametrize("layers", [30, -13])
def test_what_is_high_above_another_floor_hides_no_table(layers):
    frame = PictureExtent(low=(0.0, 0.0), pixels_per_m=50.0, size=(182, 182))
    indices = np.array([(0, 0, -1), (19, 19, -1), (5, 5, 7), (5, 5, 20), (9, 9, 20)])
    attributes = np.zeros((5, 8), np.uint8)
    attributes[:, 0] = (90, 90, 150, 250, 250)
    flat, raised = (
        MapFromAbove(indices + np.array([0, 0, lift]), 0.1, frame, floor_z_m=0.1 * lift)
        for lift in (0, layers)
    )
    flat.take(indices, attributes)
    raised.take(indices + np.array([0, 0, layers]), attributes)
    np.testing.assert_array_equal(raised.image(), flat.image())
    u, v = frame.place(0.55, 0.55)
    assert 100 < flat.image().getpixel((round(u), round(v)))[0] < 151, "the table, not the lamp"


def test_finds_of_all_searches_are_marked():
    frame = PictureExtent(low=(0.0, 0.0), pixels_per_m=50.0, size=(332, 332))
    image = draw_map(SceneModel(), frame, "camera", [(1.0, 1.0, 0.5), (5.0, 4.0, 0.9)])
    rows, columns = np.nonzero((image == FOUND).all(axis=2))
    for x, y in ((1.0, 1.0), (5.0, 4.0)):
        u, v = frame.place(x, y)
        near = (np.abs(columns - u) < 25) & (np.abs(rows - v) < 25)
        assert columns[near].mean() == pytest.approx(u, abs=2)
        assert rows[near].mean() == pytest.approx(v, abs=2)
    assert not len(draw_map(SceneModel(), frame)[(draw_map(SceneModel(), frame) == FOUND).all(2)])
