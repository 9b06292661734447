"""The map from above, with the finds of a session."""

import numpy as np
import pytest

from app.export.map_picture import PictureExtent, draw_map
from app.view.colors import FOUND
from app.view.model.scene_model import SceneModel


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
