"""Line plots of long recordings."""

import re

import numpy as np
import pytest

from app.export.line_plot import HEIGHT, MOST_POINTS, TOP, WIDTH, line_plot


@pytest.mark.parametrize("count", [50, 601, 7200])
def test_peaks_and_both_ends_are_drawn_however_long_it_is(count):
    y = np.ones(count)
    y[count // 2 + 1], y[-1] = 80.0, 40.0
    svg = line_plot(np.arange(count) * 0.5, y, "step", "ms", "black")
    assert ">80</text>" in svg
    assert f">{0.5 * (count - 1):.0f} s</text>" in svg
    points = re.search(r'points="([^"]*)"', svg)[1].split(" ")
    assert len(points) <= MOST_POINTS + 2
    u, v = np.array([point.split(",") for point in points], np.float64).T
    assert (np.diff(u) >= 0.0).all()
    assert v.min() == TOP
    assert (u[-1], v[-1]) == (WIDTH - 8, v.min() + 0.5 * (HEIGHT - 22 - TOP))
