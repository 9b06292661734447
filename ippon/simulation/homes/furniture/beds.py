"""Beds and bedside tables."""

import numpy as np

from ippon.simulation.homes.furniture.mesh_builder import MeshBuilder
from ippon.simulation.homes.furniture.model import Model, Surface, make_model
from ippon.simulation.homes.furniture.style import (
    Style,
    chance,
    fabric,
    pick,
    shade,
    uniform,
    vary,
    wood,
)


def bed(rng: np.random.Generator, style: Style, width: float) -> Model:
    """Make a bed with its headboard at the back, y = 0.

    Args:
        rng: Randomness.
        style: The home's colours.
        width: Width of the mattress in metres; the length is drawn.
    """
    length, height = uniform(rng, 1.95, 2.1), uniform(rng, 0.42, 0.56)
    frame = wood(rng, style) if chance(rng, 0.6) else fabric(rng, style)
    linen = vary(rng, pick(rng, ((240, 238, 232), (224, 228, 232), (232, 222, 208))), 0.05)
    cover = fabric(rng, style)
    w = width + 0.06
    head = uniform(rng, 0.85, 1.2)
    b = MeshBuilder()
    b.box((-w / 2, 0.0, 0.0), (w / 2, 0.07, head), frame)
    b.box((-w / 2, 0.05, 0.12), (w / 2, length + 0.08, height - 0.18), frame)
    for x in (-w / 2, w / 2 - 0.06):
        for y in (0.08, length):
            b.box((x, y, 0.0), (x + 0.06, y + 0.06, 0.14), shade(frame, 0.8))
    top = height
    b.box((-width / 2, 0.07, height - 0.2), (width / 2, length + 0.05, top), linen, taper=0.015)
    fold = uniform(rng, 0.55, 0.95)
    b.box(
        (-width / 2 - 0.03, fold, height - 0.2),
        (width / 2 + 0.03, length + 0.09, top + 0.05),
        cover,
        taper=0.02,
    )
    b.box(
        (-width / 2 - 0.03, fold - 0.12, top - 0.02),
        (width / 2 + 0.03, fold + 0.1, top + 0.065),
        linen,
        taper=0.02,
    )
    if chance(rng, 0.4):
        b.box(
            (-width / 2 - 0.04, length - 0.55, height - 0.16),
            (width / 2 + 0.04, length - 0.1, top + 0.075),
            style.accent,
            taper=0.02,
        )
    surface = Surface(
        x0=-width / 2 + 0.15,
        y0=fold + 0.2,
        x1=width / 2 - 0.15,
        y1=length - 0.1,
        z=top + 0.05,
        kind="bed",
    )
    return make_model("bed", "bed" if width > 1.1 else "single bed", b, (surface,))


def bunk_bed(rng: np.random.Generator, style: Style) -> Model:
    """Make two beds one above the other, with a ladder."""
    # Models stand on the middle of their width: 0.96 m and the ladder.
    left, right, length, frame = -0.495, 0.465, 2.02, wood(rng, style)
    b = MeshBuilder()
    for x in (left, right - 0.07):
        for y in (0.0, length - 0.07):
            b.box((x, y, 0.0), (x + 0.07, y + 0.07, 1.62), frame)
    for z in (0.28, 1.12):
        cover = fabric(rng, style)
        b.box((left, 0.0, z - 0.06), (right, length, z + 0.04), frame)
        b.box(
            (left + 0.05, 0.06, z + 0.04),
            (right - 0.05, length - 0.06, z + 0.17),
            (236, 234, 228),
            taper=0.01,
        )
        b.box(
            (left + 0.03, 0.6, z + 0.08),
            (right - 0.03, length - 0.05, z + 0.2),
            cover,
            taper=0.01,
        )
        b.box((-0.3, 0.1, z + 0.17), (0.3, 0.45, z + 0.27), (244, 242, 238), taper=0.04)
    for z in (1.34, 1.46):
        b.box((right - 0.03, 0.45, z), (right, length, z + 0.05), frame)
        b.box((left, 0.0, z), (left + 0.03, length, z + 0.05), frame)
    for z in np.arange(0.3, 1.15, 0.28).tolist():
        b.box((right, 0.1, z), (right + 0.03, 0.42, z + 0.04), frame)
    surface = Surface(x0=-0.3, y0=0.7, x1=0.3, y1=1.8, z=0.48, kind="bed", headroom_m=0.5)
    return make_model("bed", "bunk bed", b, (surface,))


def nightstand(rng: np.random.Generator, style: Style) -> Model:
    """Make a bedside table: a small cabinet or a stand on legs."""
    w, d, h = uniform(rng, 0.38, 0.52), uniform(rng, 0.34, 0.42), uniform(rng, 0.42, 0.58)
    color = wood(rng, style)
    surface = Surface(x0=-w / 2 + 0.03, y0=0.03, x1=w / 2 - 0.03, y1=d - 0.03, z=h, kind="bedside")
    b = MeshBuilder()
    if chance(rng, 0.6):
        b.box((-w / 2, 0.0, 0.06), (w / 2, d, h), color)
        for k in range(2):
            z = 0.1 + k * (h - 0.12) / 2
            b.box(
                (-w / 2 + 0.02, d, z),
                (w / 2 - 0.02, d + 0.012, z + (h - 0.2) / 2),
                shade(color, 1.1),
            )
            b.box((-0.05, d + 0.012, z + 0.08), (0.05, d + 0.03, z + 0.1), style.metal)
        return make_model("cabinet", "nightstand", b, (surface,))
    b.box((-w / 2, 0.0, h - 0.04), (w / 2, d, h), shade(color, 1.1))
    b.box((-w / 2 + 0.02, 0.02, 0.14), (w / 2 - 0.02, d - 0.02, 0.17), color)
    for x in (-w / 2, w / 2 - 0.035):
        for y in (0.0, d - 0.035):
            b.box((x, y, 0.0), (x + 0.035, y + 0.035, h), color)
    return make_model("table", "side table", b, (surface,))


def crib(rng: np.random.Generator, style: Style) -> Model:
    """Make a child's bed with bars."""
    w, length, frame = 0.7, 1.3, wood(rng, style)
    b = MeshBuilder()
    b.box((-w / 2 + 0.03, 0.03, 0.3), (w / 2 - 0.03, length - 0.03, 0.44), (238, 236, 230))
    for z in (0.24, 0.82):
        b.box((-w / 2, 0.0, z), (-w / 2 + 0.04, length, z + 0.05), frame)
        b.box((w / 2 - 0.04, 0.0, z), (w / 2, length, z + 0.05), frame)
    for x in (-w / 2, w / 2 - 0.04):
        for y in np.linspace(0.1, length - 0.1, 8).tolist():
            b.box((x + 0.01, y, 0.24), (x + 0.03, y + 0.02, 0.84), frame)
    for y in (0.0, length - 0.05):
        b.box((-w / 2, y, 0.0), (w / 2, y + 0.05, 0.9), frame, taper=0.0)
    surface = Surface(x0=-0.2, y0=0.2, x1=0.2, y1=1.0, z=0.44, kind="bed")
    return make_model("bed", "crib", b, (surface,))
