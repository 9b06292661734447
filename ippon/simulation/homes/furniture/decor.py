"""Plants, mugs, lamps, televisions, pictures, curtains and carpets."""

import math

import numpy as np

from ippon.simulation.homes.furniture.mesh_builder import Color, MeshBuilder
from ippon.simulation.homes.furniture.model import Model, Surface, make_model
from ippon.simulation.homes.furniture.style import (
    Style,
    accent,
    chance,
    fabric,
    pick,
    shade,
    uniform,
    vary,
    wood,
)

_GREENS = ((62, 112, 58), (86, 136, 66), (48, 92, 66), (120, 150, 84))
_LIGHT = (250, 240, 214)


def plant(rng: np.random.Generator, *, height: float) -> Model:
    """Make a plant in a pot.

    Args:
        rng: Randomness.
        height: Height with leaves, metres; a plant below 0.5 m stands on tables.
    """
    pot_h = min(0.38, 0.32 * height) if height > 0.5 else 0.4 * height
    r = max(0.05, 0.5 * pot_h)
    green = vary(rng, pick(rng, _GREENS), 0.15)
    b = MeshBuilder()
    pot = vary(rng, pick(rng, ((186, 106, 72), (226, 222, 212), (74, 78, 82), (150, 134, 108))))
    b.frustum((0.0, r), (0.0, pot_h), (0.72 * r, r), pot, sides=10, top_color=(74, 56, 42))
    kind = int(rng.integers(3))
    if kind == 0:
        for k in range(int(rng.integers(12, 18))):
            a, reach = 2.4 * k, uniform(rng, 0.55, 1.0)
            out = (1.15 - 0.55 * reach) * min(0.45, 0.42 * height)
            tip = (out * math.cos(a), r + out * math.sin(a), pot_h + (height - pot_h) * reach)
            base = (0.3 * r * math.cos(a), r + 0.3 * r * math.sin(a), pot_h)
            b.leaf(base, tip, uniform(rng, 0.14, 0.24) * height**0.7, vary(rng, green, 0.2))
    elif kind == 1:
        top = pot_h + 0.5 * (height - pot_h)
        b.rod((0.0, r, pot_h - 0.02), (0.0, r, top), 0.035, (112, 84, 58))
        crown = min(0.34, 0.3 * height)
        for _ in range(5):
            x, y = uniform(rng, -0.5, 0.5) * crown, r + uniform(rng, -0.5, 0.5) * crown
            z = uniform(rng, top, height - 0.5 * crown)
            b.ball(
                (x, y, z),
                (0.6 * crown, 0.6 * crown, 0.5 * crown),
                vary(rng, green, 0.2),
                sides=7,
                rings=4,
            )
    else:
        for k in range(int(rng.integers(6, 10))):
            a, out = 2.4 * k, 0.55 * r
            base = (out * math.cos(a), r + out * math.sin(a), pot_h - 0.02)
            tip = (1.5 * base[0], r + 1.5 * (base[1] - r), height * uniform(rng, 0.7, 1.0))
            b.rod(base, tip, 0.02, vary(rng, green, 0.1))
            b.ball(
                tip,
                (0.13 * height**0.6, 0.1 * height**0.6, 0.05 + 0.05 * height),
                vary(rng, green, 0.2),
                sides=6,
                rings=4,
            )
    return make_model("plant", "plant", b)


def flowers(rng: np.random.Generator) -> Model:
    """Make a bunch of flowers in a vase."""
    b = MeshBuilder()
    b.frustum((0.0, 0.06), (0.0, 0.16), (0.05, 0.06), accent(rng), sides=8)
    color = accent(rng)
    for k in range(7):
        a, out = 2.4 * k, 0.03 + 0.012 * k
        tip = (out * math.cos(a), 0.06 + out * math.sin(a), uniform(rng, 0.28, 0.4))
        b.rod((0.0, 0.06, 0.15), tip, 0.008, (70, 120, 64))
        b.ball(tip, (0.03, 0.03, 0.025), vary(rng, color, 0.2), sides=5, rings=4)
    return make_model("plant", "flowers", b)


def floor_lamp(rng: np.random.Generator, style: Style) -> Model:
    """Make a floor lamp."""
    h, r = uniform(rng, 1.4, 1.75), uniform(rng, 0.15, 0.22)
    b = MeshBuilder()
    b.frustum((0.0, 0.2), (0.0, 0.03), (0.15, 0.14), style.metal)
    b.frustum((0.0, 0.2), (0.03, h - 0.2), (0.014, 0.014), style.metal, sides=5)
    b.frustum((0.0, 0.2), (h - 0.28, h), (r, 0.7 * r), _LIGHT, sides=12)
    return make_model("lighting", "floor lamp", b)


def table_lamp(rng: np.random.Generator) -> Model:
    """Make a lamp for a table or nightstand."""
    h, color = uniform(rng, 0.34, 0.48), accent(rng)
    b = MeshBuilder()
    b.frustum((0.0, 0.11), (0.0, 0.5 * h), (0.07, 0.03), color, sides=8)
    b.frustum((0.0, 0.11), (0.45 * h, h), (0.12, 0.08), _LIGHT, sides=10)
    return make_model("lighting", "lamp", b)


def ceiling_lamp(rng: np.random.Generator, ceiling: float) -> Model:
    """Make a lamp that hangs from the ceiling; z = 0 is the floor."""
    drop, r = uniform(rng, 0.12, 0.55), uniform(rng, 0.14, 0.26)
    color = accent(rng) if chance(rng, 0.4) else _LIGHT
    b = MeshBuilder()
    b.frustum((0.0, 0.0), (ceiling - drop, ceiling - 0.005), (0.01, 0.01), (60, 60, 62), sides=4)
    b.frustum((0.0, 0.0), (ceiling - drop - 0.16, ceiling - drop), (r, 0.3 * r), color, sides=12)
    return make_model("lighting", "ceiling lamp" if drop < 0.2 else "pendant lamp", b)


def television(rng: np.random.Generator, diagonal_m: float, *, on_stand: bool) -> Model:
    """Make a flat screen, on a stand or for the wall with its lower edge at z = 0."""
    w, h = 0.872 * diagonal_m, 0.49 * diagonal_m
    z = 0.07 if on_stand else 0.0
    y = 0.12 if on_stand else 0.02
    screen = pick(rng, ((22, 24, 30), (30, 36, 48), (16, 18, 20)))
    b = MeshBuilder()
    b.box((-w / 2, y, z), (w / 2, y + 0.05, z + h), (18, 18, 20))
    b.box((-w / 2 + 0.015, y + 0.05, z + 0.02), (w / 2 - 0.015, y + 0.054, z + h - 0.015), screen)
    if on_stand:
        b.box((-0.2 * w, 0.05, 0.0), (0.2 * w, 0.26, 0.015), (40, 40, 44))
        b.box((-0.05, y, 0.0), (0.05, y + 0.03, 0.1), (40, 40, 44))
    else:
        b.box((-0.15, 0.0, 0.3 * h), (0.15, 0.02, 0.7 * h), (40, 40, 44))
    return make_model("tv", "tv", b)


def picture(rng: np.random.Generator) -> Model:
    """Make a framed picture of coloured shapes; its lower edge is at z = 0."""
    w, h = uniform(rng, 0.3, 0.95), uniform(rng, 0.3, 0.75)
    b = MeshBuilder()
    b.box(
        (-w / 2, 0.0, 0.0),
        (w / 2, 0.025, h),
        pick(rng, ((40, 38, 36), (196, 160, 112), (236, 234, 230), (170, 140, 84))),
    )
    ground = vary(
        rng, pick(rng, ((226, 218, 200), (150, 180, 200), (210, 190, 160), (70, 90, 110)))
    )
    b.box((-w / 2 + 0.03, 0.025, 0.03), (w / 2 - 0.03, 0.028, h - 0.03), ground)
    for _ in range(int(rng.integers(2, 5))):
        pw, ph = uniform(rng, 0.15, 0.5) * w, uniform(rng, 0.15, 0.5) * h
        x, z = uniform(rng, -0.44 * w, 0.44 * w - pw), uniform(rng, 0.06 * h, 0.94 * h - ph)
        b.box((x, 0.028, z), (x + pw, 0.031, z + ph), accent(rng))
    return make_model("picture", pick(rng, ("picture", "painting", "poster")), b)


def wall_mirror(rng: np.random.Generator, style: Style) -> Model:
    """Make a tall framed mirror that stands on z = 0, for a hall or bedroom."""
    w, h = uniform(rng, 0.4, 0.6), uniform(rng, 1.3, 1.7)
    b = MeshBuilder()
    b.box((-w / 2, 0.0, 0.0), (w / 2, 0.03, h), wood(rng, style))
    b.box((-w / 2 + 0.035, 0.03, 0.035), (w / 2 - 0.035, 0.034, h - 0.035), (206, 218, 224))
    return make_model("mirror", "mirror", b)


def curtain(rng: np.random.Generator, style: Style, width: float, top: float) -> Model:
    """Make one side of a pair of curtains, from near the floor up to `top` metres."""
    color = fabric(rng, style)
    folds = max(3, round(width / 0.07))
    b = MeshBuilder()
    for k in range(folds):
        x = -width / 2 + k * width / folds
        b.box(
            (x, 0.02 + 0.04 * (k % 2), 0.04),
            (x + width / folds, 0.07 + 0.04 * (k % 2), top),
            shade(color, 1.0 + 0.08 * (k % 2)),
        )
    return make_model("curtain", "curtain", b)


def rug(rng: np.random.Generator, style: Style, width: float, depth: float) -> Model:
    """Make a carpet with a border, thin enough to drive over."""
    color = fabric(rng, style)
    b = MeshBuilder()
    b.box((-width / 2, 0.0, 0.001), (width / 2, depth, 0.012), shade(color, 0.8))
    m = uniform(rng, 0.08, 0.2)
    b.box((-width / 2 + m, m, 0.012), (width / 2 - m, depth - m, 0.014), vary(rng, color, 0.1))
    if chance(rng, 0.5):
        m = 2.2 * m
        b.box((-width / 2 + m, m, 0.014), (width / 2 - m, depth - m, 0.016), accent(rng))
    return make_model("floor", "carpet", b)


def radiator(rng: np.random.Generator) -> Model:
    """Make a ribbed radiator for below a window; z = 0 is the floor."""
    w = uniform(rng, 0.6, 1.2)
    b = MeshBuilder()
    b.box((-w / 2, 0.03, 0.12), (w / 2, 0.09, 0.66), (232, 232, 230))
    for x in np.linspace(-w / 2, w / 2 - 0.03, max(4, round(w / 0.1))).tolist():
        b.box((x, 0.09, 0.14), (x + 0.03, 0.1, 0.64), (216, 216, 214))
    return make_model("objects", "radiator", b)


def fireplace(rng: np.random.Generator) -> Model:
    """Make a fireplace with a mantel."""
    w, color = (
        uniform(rng, 1.2, 1.5),
        vary(rng, pick(rng, ((206, 200, 190), (150, 84, 66), (110, 108, 106)))),
    )
    b = MeshBuilder()
    for x in (-w / 2, w / 2 - 0.25):
        b.box((x, 0.0, 0.0), (x + 0.25, 0.36, 1.0), color)
    b.box((-w / 2, 0.0, 0.72), (w / 2, 0.36, 1.0), color)
    b.box((-w / 2 + 0.25, 0.0, 0.0), (w / 2 - 0.25, 0.05, 0.72), (30, 28, 28))
    b.box((-w / 2 - 0.06, 0.0, 1.0), (w / 2 + 0.06, 0.42, 1.06), shade(color, 0.8))
    for k in range(3):
        b.rod(
            (-0.2 + 0.05 * k, 0.16 + 0.05 * k, 0.06 + 0.05 * k),
            (0.22 - 0.04 * k, 0.2, 0.06 + 0.05 * k),
            0.08,
            (92, 66, 46),
        )
    surface = Surface(x0=-w / 2 + 0.05, y0=0.08, x1=w / 2 - 0.05, y1=0.36, z=1.06, kind="shelf")
    return make_model("fireplace", "fireplace", b, (surface,))


def add_mug(b: MeshBuilder, color: Color) -> None:
    """Add a mug of coffee around the origin."""
    b.frustum((0.0, 0.0), (0.0, 0.1), (0.038, 0.042), color, top_color=(70, 46, 34))
    b.box((0.04, -0.008, 0.02), (0.07, 0.008, 0.08), color)


def mug(color: Color) -> Model:
    """Make a mug of a colour."""
    b = MeshBuilder()
    add_mug(b, color)
    return make_model("objects", "mug", b)
