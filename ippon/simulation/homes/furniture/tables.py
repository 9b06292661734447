"""Tables and desks."""

import numpy as np

from ippon.simulation.homes.furniture.mesh_builder import MeshBuilder
from ippon.simulation.homes.furniture.model import Model, Surface, make_model
from ippon.simulation.homes.furniture.style import Style, chance, shade, uniform, wood


def _top_surface(width: float, depth: float, z: float, kind: str) -> Surface:
    m = 0.06
    return Surface(x0=-width / 2 + m, y0=m, x1=width / 2 - m, y1=depth - m, z=z, kind=kind)


def _four_legs(
    b: MeshBuilder, w: float, d: float, h: float, t: float, color: tuple[int, int, int]
) -> None:
    for x in (-w / 2 + 0.02, w / 2 - 0.02 - t):
        for y in (0.02, d - 0.02 - t):
            b.box((x, y, 0.0), (x + t, y + t, h), color)


def dining_table(rng: np.random.Generator, style: Style, width: float, depth: float) -> Model:
    """Make a rectangular dining table with four legs."""
    h, t = uniform(rng, 0.72, 0.78), uniform(rng, 0.03, 0.06)
    color = wood(rng, style)
    legs = color if chance(rng, 0.6) else style.metal
    b = MeshBuilder()
    b.box((-width / 2, 0.0, h - t), (width / 2, depth, h), color)
    _four_legs(b, width, depth, h - t, uniform(rng, 0.05, 0.08), legs)
    b.box(
        (-width / 2 + 0.08, 0.08, h - t - 0.08),
        (width / 2 - 0.08, depth - 0.08, h - t),
        shade(legs, 0.9),
    )
    return make_model("table", "dining table", b, (_top_surface(width, depth, h, "table"),))


def round_table(rng: np.random.Generator, style: Style, radius: float) -> Model:
    """Make a round table on one foot."""
    h, color = uniform(rng, 0.72, 0.77), wood(rng, style)
    b = MeshBuilder()
    b.frustum((0.0, radius), (h - 0.04, h), (radius, radius), color, sides=16)
    b.frustum((0.0, radius), (0.04, h - 0.04), (0.07, 0.05), shade(color, 0.85), sides=8)
    b.frustum(
        (0.0, radius), (0.0, 0.05), (0.55 * radius, 0.4 * radius), shade(color, 0.85), sides=12
    )
    r = 0.6 * radius
    surface = Surface(x0=-r, y0=radius - r, x1=r, y1=radius + r, z=h, kind="table")
    return make_model("table", "round table", b, (surface,))


def coffee_table(rng: np.random.Generator, style: Style) -> Model:
    """Make a low table for in front of a sofa."""
    h, color = uniform(rng, 0.36, 0.47), wood(rng, style)
    b = MeshBuilder()
    if chance(rng, 0.3):
        r = uniform(rng, 0.35, 0.48)
        b.frustum((0.0, r), (h - 0.04, h), (r, r), color, sides=14)
        for k in range(3):
            a = 2.1 * k
            b.rod(
                (0.8 * r * np.cos(a), r + 0.8 * r * np.sin(a), 0.0),
                (0.4 * r * np.cos(a), r + 0.4 * r * np.sin(a), h - 0.03),
                0.04,
                style.metal,
            )
        surface = Surface(x0=-0.6 * r, y0=0.4 * r, x1=0.6 * r, y1=1.6 * r, z=h, kind="table")
        return make_model("table", "coffee table", b, (surface,))
    w, d = uniform(rng, 0.85, 1.2), uniform(rng, 0.5, 0.65)
    b.box((-w / 2, 0.0, h - 0.04), (w / 2, d, h), color)
    _four_legs(b, w, d, h - 0.04, 0.05, shade(color, 0.88) if chance(rng, 0.5) else style.metal)
    if chance(rng, 0.5):
        b.box((-w / 2 + 0.04, 0.04, 0.13), (w / 2 - 0.04, d - 0.04, 0.15), shade(color, 0.9))
    return make_model("table", "coffee table", b, (_top_surface(w, d, h, "table"),))


def side_table(rng: np.random.Generator, style: Style) -> Model:
    """Make a small round table for beside a seat."""
    r, h, color = uniform(rng, 0.2, 0.27), uniform(rng, 0.45, 0.6), wood(rng, style)
    b = MeshBuilder()
    b.frustum((0.0, r), (h - 0.03, h), (r, r), color, sides=12)
    b.frustum((0.0, r), (0.03, h - 0.03), (0.025, 0.025), style.metal, sides=6)
    b.frustum((0.0, r), (0.0, 0.03), (0.7 * r, 0.65 * r), style.metal, sides=10)
    surface = Surface(x0=-0.6 * r, y0=0.4 * r, x1=0.6 * r, y1=1.6 * r, z=h, kind="bedside")
    return make_model("table", "side table", b, (surface,))


def desk(rng: np.random.Generator, style: Style) -> Model:
    """Make a desk with drawers at one side; the seat is at its front."""
    w, d, h = uniform(rng, 1.05, 1.5), uniform(rng, 0.58, 0.75), uniform(rng, 0.72, 0.76)
    color = wood(rng, style)
    side = 1.0 if chance(rng, 0.5) else -1.0
    b = MeshBuilder()
    b.box((-w / 2, 0.0, h - 0.035), (w / 2, d, h), color)
    _four_legs(b, w, d, h - 0.03, 0.05, style.metal)
    b.block(side * (w / 2 - 0.24), 0.04, 0.08, (0.4, d - 0.1, h - 0.12), shade(color, 0.92))
    for k in range(3):
        b.block(
            side * (w / 2 - 0.24),
            d - 0.06,
            0.12 + 0.19 * k,
            (0.36, 0.015, 0.16),
            shade(color, 1.08),
        )
    return make_model("table", "desk", b, (_top_surface(w, d, h, "desk"),))


def work_table(rng: np.random.Generator, style: Style, width: float, depth: float) -> Model:
    """Make a desk on four legs, as they stand in rows in offices and schools."""
    h = uniform(rng, 0.72, 0.76)
    b = MeshBuilder()
    b.box((-width / 2, 0.0, h - 0.03), (width / 2, depth, h), wood(rng, style))
    _four_legs(b, width, depth, h - 0.03, 0.05, style.metal)
    return make_model("table", "desk", b, (_top_surface(width, depth, h, "desk"),))


def console_table(rng: np.random.Generator, style: Style) -> Model:
    """Make a narrow table for a hall."""
    w, d, h = uniform(rng, 0.8, 1.15), uniform(rng, 0.28, 0.34), uniform(rng, 0.76, 0.86)
    color = wood(rng, style)
    b = MeshBuilder()
    b.box((-w / 2, 0.0, h - 0.12), (w / 2, d, h), color)
    _four_legs(b, w, d, h - 0.1, 0.04, shade(color, 0.9))
    b.box((-w / 2 + 0.03, 0.03, 0.2), (w / 2 - 0.03, d - 0.03, 0.22), shade(color, 0.9))
    m = 0.04
    surface = Surface(x0=-w / 2 + m, y0=m, x1=w / 2 - m, y1=d - m, z=h, kind="table")
    return make_model("table", "console table", b, (surface,))
