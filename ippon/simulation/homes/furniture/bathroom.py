"""Bathroom furniture."""

import numpy as np

from ippon.simulation.homes.furniture.mesh_builder import MeshBuilder
from ippon.simulation.homes.furniture.model import Model, Surface, make_model
from ippon.simulation.homes.furniture.style import (
    Style,
    accent,
    chance,
    pick,
    shade,
    uniform,
    vary,
    wood,
)

_PORCELAIN = (242, 242, 240)
_GLASS = (186, 208, 214)


def toilet(rng: np.random.Generator) -> Model:
    """Make a toilet: foot, bowl, seat with lid, tank."""
    color = vary(rng, _PORCELAIN, 0.02)
    b = MeshBuilder()
    b.box((-0.11, 0.1, 0.0), (0.11, 0.5, 0.24), color, taper=0.0)
    _bowl(b, 0.24, 0.39, color)
    if chance(rng, 0.7):
        b.box((-0.19, 0.0, 0.36), (0.19, 0.18, 0.78), color, taper=0.01)
        b.box((-0.2, -0.0, 0.78), (0.2, 0.19, 0.81), shade(color, 0.95))
        b.box((-0.03, 0.07, 0.81), (0.03, 0.12, 0.825), (150, 152, 156))
    else:
        b.box((-0.24, 0.0, 0.0), (0.24, 0.14, 1.05), color)
        b.box((-0.1, 0.14, 0.88), (0.1, 0.15, 1.0), (170, 172, 176))
    if chance(rng, 0.35):
        b.box((-0.18, 0.19, 0.41), (0.18, 0.23, 0.84), shade(color, 0.93))
    return make_model("toilet", "toilet", b)


def _bowl(b: MeshBuilder, z0: float, z1: float, color: tuple[int, int, int]) -> None:
    """Add an oval bowl with a dark opening and a rim."""
    a = 2.0 * np.pi * np.arange(12) / 12
    center = 0.43
    low = np.stack([0.12 * np.cos(a), center + 0.16 * np.sin(a), np.full(12, z0 - 0.1)], axis=1)
    high = np.stack([0.19 * np.cos(a), center + 0.25 * np.sin(a), np.full(12, z1)], axis=1)
    rim = np.stack([0.12 * np.cos(a), center + 0.17 * np.sin(a), np.full(12, z1 + 0.02)], axis=1)
    lid = high + np.array([0.0, 0.0, 0.02])
    hole = np.array([[0.0, center, z1 - 0.06]])
    i = np.arange(12)
    j = (i + 1) % 12

    def band(p: int, q: int) -> np.ndarray:
        return np.concatenate(
            [np.stack([i + p, j + p, j + q], axis=1), np.stack([i + p, j + q, i + q], axis=1)]
        )

    b.add(
        np.concatenate([low, high, lid, rim]),
        np.concatenate([band(0, 12), band(12, 24), band(24, 36)]),
        color,
    )
    fan = np.stack([i, j, np.full(12, 12)], axis=1)
    b.add(np.concatenate([rim, hole]), fan, (120, 132, 140))


def washbasin(rng: np.random.Generator, style: Style) -> Model:
    """Make a basin on a cabinet or on a column."""
    w = uniform(rng, 0.5, 0.95)
    d, h = uniform(rng, 0.42, 0.5), uniform(rng, 0.82, 0.88)
    b = MeshBuilder()
    if chance(rng, 0.7):
        color = wood(rng, style)
        b.box((-w / 2, 0.0, 0.22 if chance(rng, 0.5) else 0.0), (w / 2, d - 0.03, h - 0.12), color)
        for x0, x1 in ((-w / 2, 0.0), (0.0, w / 2)):
            b.box((x0 + 0.01, d - 0.03, 0.25), (x1 - 0.01, d - 0.015, h - 0.14), shade(color, 1.08))
    else:
        b.frustum((0.0, d / 2), (0.0, h - 0.12), (0.11, 0.09), _PORCELAIN, sides=8)
    b.box((-w / 2, 0.0, h - 0.12), (w / 2, d, h), _PORCELAIN)
    b.box((-w / 2 + 0.07, 0.12, h), (w / 2 - 0.07, d - 0.05, h + 0.004), (196, 204, 208))
    b.box((-0.02, 0.03, h), (0.02, 0.07, h + 0.14), (170, 172, 176))
    b.box((-0.015, 0.04, h + 0.12), (0.015, 0.18, h + 0.14), (170, 172, 176))
    surface = Surface(
        x0=-w / 2 + 0.02, y0=0.01, x1=-0.06, y1=0.11, z=h, kind="sink", headroom_m=0.3
    )
    return make_model("sink", "washbasin", b, (surface,))


def bathtub(rng: np.random.Generator) -> Model:
    """Make a bathtub with its long side against the wall."""
    w, d, h = uniform(rng, 1.5, 1.75), uniform(rng, 0.7, 0.8), uniform(rng, 0.54, 0.6)
    b = MeshBuilder()
    b.box((-w / 2, 0.0, 0.0), (w / 2, 0.08, h), _PORCELAIN)
    b.box((-w / 2, d - 0.08, 0.0), (w / 2, d, h), _PORCELAIN)
    b.box((-w / 2, 0.08, 0.0), (-w / 2 + 0.1, d - 0.08, h), _PORCELAIN)
    b.box((w / 2 - 0.1, 0.08, 0.0), (w / 2, d - 0.08, h), _PORCELAIN)
    b.box((-w / 2 + 0.1, 0.08, 0.0), (w / 2 - 0.1, d - 0.08, 0.14), (226, 232, 234))
    b.box(
        (-w / 2 + 0.02, d / 2 - 0.02, h), (-w / 2 + 0.05, d / 2 + 0.02, h + 0.12), (170, 172, 176)
    )
    b.box(
        (-w / 2 + 0.02, d / 2 - 0.015, h + 0.1),
        (-w / 2 + 0.2, d / 2 + 0.015, h + 0.12),
        (170, 172, 176),
    )
    return make_model("bathtub", "bathtub", b)


def shower(rng: np.random.Generator, *, glass_left: bool) -> Model:
    """Make a shower tray with a head at the back wall and a glass pane at one side.

    Args:
        rng: Randomness.
        glass_left: Whether the pane stands at -x.
    """
    w, d = uniform(rng, 0.85, 1.1), uniform(rng, 0.8, 0.95)
    b = MeshBuilder()
    b.box((-w / 2, 0.0, 0.0), (w / 2, d, 0.1), (232, 234, 234))
    b.box((-w / 2 + 0.06, 0.06, 0.1), (w / 2 - 0.06, d - 0.06, 0.104), (206, 212, 214))
    x = -w / 2 if glass_left else w / 2 - 0.02
    b.box((x, 0.0, 0.1), (x + 0.02, d, 1.95), _GLASS)
    b.box((x - 0.005, d - 0.03, 0.1), (x + 0.025, d, 1.98), (150, 152, 156))
    metal = (164, 166, 170)
    b.box((-0.015, 0.0, 0.9), (0.015, 0.03, 2.05), metal)
    b.box((-0.015, 0.0, 2.03), (0.015, 0.3, 2.06), metal)
    b.frustum((0.0, 0.3), (1.99, 2.03), (0.11, 0.04), metal, sides=10)
    b.box((-0.1, 0.0, 1.0), (0.1, 0.05, 1.06), metal)
    return make_model("shower", "shower", b)


def bathroom_mirror(rng: np.random.Generator, style: Style) -> Model:
    """Make a framed mirror as wide as a basin; its lower edge is at z = 0."""
    w, h = uniform(rng, 0.45, 0.8), uniform(rng, 0.6, 0.85)
    b = MeshBuilder()
    b.box((-w / 2, 0.0, 0.0), (w / 2, 0.03, h), style.metal)
    b.box((-w / 2 + 0.02, 0.03, 0.02), (w / 2 - 0.02, 0.034, h - 0.02), (206, 218, 224))
    return make_model("mirror", "mirror", b)


def towel_rail(rng: np.random.Generator) -> Model:
    """Make a rail with a towel over it; its lower edge is at z = 0."""
    w = uniform(rng, 0.45, 0.6)
    color = accent(rng)
    b = MeshBuilder()
    b.box((-w / 2, 0.05, 0.66), (w / 2, 0.07, 0.68), (160, 162, 166))
    for x in (-w / 2, w / 2 - 0.02):
        b.box((x, 0.0, 0.66), (x + 0.02, 0.07, 0.68), (160, 162, 166))
    tw, drop = uniform(rng, 0.3, 0.42), uniform(rng, 0.0, 0.25)
    b.box((-tw / 2, 0.035, drop), (tw / 2, 0.05, 0.69), color)
    b.box((-tw / 2, 0.07, drop + 0.06), (tw / 2, 0.09, 0.69), shade(color, 0.92))
    b.box((-tw / 2, 0.071, drop + 0.12), (tw / 2, 0.093, drop + 0.17), shade(color, 1.3))
    return make_model("towel", "towel", b)


def laundry_basket(rng: np.random.Generator) -> Model:
    """Make a round basket with clothes in it."""
    color = vary(rng, pick(rng, ((196, 168, 124), (230, 226, 218), (96, 104, 110))), 0.1)
    r = uniform(rng, 0.19, 0.24)
    b = MeshBuilder()
    b.frustum((0.0, r), (0.0, 0.5), (0.82 * r, r), color, sides=12)
    b.ball((0.02, r, 0.5), (0.8 * r, 0.75 * r, 0.1), accent(rng))
    return make_model("objects", "laundry basket", b)


def bath_mat(rng: np.random.Generator) -> Model:
    """Make a mat for the floor."""
    w, d = uniform(rng, 0.6, 0.8), uniform(rng, 0.42, 0.52)
    b = MeshBuilder()
    b.box((-w / 2, 0.0, 0.001), (w / 2, d, 0.015), accent(rng))
    return make_model("floor", "bath mat", b)
