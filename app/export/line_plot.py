"""Line plots over time as SVG, for self-contained pages."""

from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

WIDTH: Final = 420
HEIGHT: Final = 150
LEFT: Final = 48
BOTTOM: Final = 22
TOP: Final = 26
MOST_POINTS: Final = 600


def line_plot(
    x_s: NDArray[np.float64],
    y: NDArray[np.float64],
    name: str,
    unit: str,
    color: str,
    *,
    decimal: str = ".",
) -> str:
    """Return an SVG of y over seconds, with the limits of the axes.

    Args:
        x_s: (N,) seconds, increasing.
        y: (N,) values.
        name: Name of the quantity.
        unit: Unit of the quantity, empty for none.
        color: CSS colour of the line.
        decimal: Decimal mark of the language.
    """
    drawn = _drawn(y)
    x_s, y = x_s[drawn], y[drawn]
    low, high = min(0.0, float(y.min())), max(float(y.max()), 1e-9)
    first, last = float(x_s[0]), max(float(x_s[-1]), float(x_s[0]) + 1e-9)
    u = LEFT + (x_s - first) / (last - first) * (WIDTH - LEFT - 8)
    v = HEIGHT - BOTTOM - (y - low) / (high - low) * (HEIGHT - BOTTOM - TOP)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(u.tolist(), v.tolist(), strict=True))
    floor = HEIGHT - BOTTOM
    top, base = (f"{limit:.3g}".replace(".", decimal) for limit in (high, low))
    title = escape(f"{name}, {unit}" if unit else name)
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{title}">'
        f'<text x="{LEFT}" y="16" class="title">{title}</text>'
        f'<path d="M{LEFT} {TOP}V{floor}H{WIDTH - 8}" class="axis"/>'
        f'<text x="{LEFT - 6}" y="{TOP + 6}" text-anchor="end">{top}</text>'
        f'<text x="{LEFT - 6}" y="{floor}" text-anchor="end">{base}</text>'
        f'<text x="{LEFT}" y="{HEIGHT - 6}">{first:.0f} s</text>'
        f'<text x="{WIDTH - 8}" y="{HEIGHT - 6}" text-anchor="end">{last:.0f} s</text>'
        f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="2"/></svg>'
    )


def _drawn(y: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return which values to draw: of many, the lowest and highest of each of some groups."""
    every = np.arange(len(y))
    if len(y) <= MOST_POINTS:
        return every
    groups = np.array_split(every, MOST_POINTS // 2)
    extremes = [group[pick(y[group])] for group in groups for pick in (np.argmin, np.argmax)]
    return np.unique([0, *extremes, len(y) - 1])
