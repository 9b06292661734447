"""Exercise machines, a piano, coat stands and other pieces that only some homes have."""

import math

import numpy as np

from ippon.simulation.homes.furniture.mesh_builder import MeshBuilder
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

_DARK = (44, 46, 50)


def exercise_bike(rng: np.random.Generator) -> Model:
    """Make an exercise bike."""
    color = accent(rng)
    b = MeshBuilder()
    for y in (0.05, 0.95):
        b.box((-0.25, y, 0.0), (0.25, y + 0.07, 0.06), _DARK)
    b.rod((0.0, 0.08, 0.05), (0.0, 0.98, 0.05), 0.06, _DARK)
    b.box((-0.05, 0.6, 0.08), (0.05, 1.0, 0.5), color, taper=0.01)
    b.rod((0.0, 0.35, 0.05), (0.0, 0.25, 0.82), 0.06, color)
    b.box((-0.12, 0.1, 0.82), (0.12, 0.38, 0.9), _DARK, taper=0.03)
    b.rod((0.0, 0.75, 0.3), (0.0, 0.85, 1.1), 0.06, color)
    b.rod((-0.25, 0.8, 1.1), (0.25, 0.8, 1.1), 0.04, _DARK)
    return make_model("gym_equipment", "exercise bike", b)


def treadmill(rng: np.random.Generator) -> Model:
    """Make a treadmill, accessed from its back."""
    b = MeshBuilder()
    b.box((-0.36, 0.0, 0.0), (0.36, 1.5, 0.18), _DARK)
    b.box((-0.26, 0.05, 0.18), (0.26, 1.45, 0.185), (88, 88, 92))
    for x in (-0.34, 0.3):
        b.rod((x + 0.02, 0.15, 0.15), (x + 0.02, 0.05, 1.2), 0.06, shade(_DARK, 1.6))
        b.box((x, 0.1, 0.85), (x + 0.04, 0.7, 0.89), _DARK)
    b.box((-0.34, 0.0, 1.1), (0.34, 0.12, 1.34), accent(rng))
    return make_model("gym_equipment", "treadmill", b)


def dumbbells(rng: np.random.Generator) -> Model:
    """Make a small rack with three dumbbells."""
    b = MeshBuilder()
    b.box((-0.4, 0.0, 0.0), (0.4, 0.3, 0.05), _DARK)
    b.box((-0.4, 0.05, 0.05), (-0.36, 0.25, 0.4), _DARK)
    b.box((0.36, 0.05, 0.05), (0.4, 0.25, 0.4), _DARK)
    b.box((-0.4, 0.05, 0.4), (0.4, 0.25, 0.44), _DARK)
    color = accent(rng)
    for k, x in enumerate((-0.26, 0.0, 0.26)):
        s = 0.05 + 0.012 * k
        b.rod((x, 0.06, 0.5), (x, 0.28, 0.5), 0.03, (150, 150, 152))
        for y in (0.03, 0.22):
            b.box((x - s, y, 0.5 - s), (x + s, y + 0.06, 0.5 + s), color, taper=0.01)
    return make_model("gym_equipment", "dumbbells", b)


def yoga_ball(rng: np.random.Generator) -> Model:
    """Make an exercise ball."""
    r = uniform(rng, 0.27, 0.34)
    b = MeshBuilder().ball((0.0, r, r), (r, r, r), accent(rng), sides=12, rings=8)
    return make_model("gym_equipment", "exercise ball", b)


def piano(rng: np.random.Generator) -> Model:
    """Make an upright piano, played at its front."""
    color = vary(rng, pick(rng, ((30, 28, 28), (110, 68, 42), (236, 234, 230))), 0.08)
    b = MeshBuilder()
    b.box((-0.74, 0.0, 0.0), (0.74, 0.36, 1.2), color)
    b.box((-0.74, 0.36, 0.6), (0.74, 0.6, 0.7), color)
    b.box((-0.68, 0.42, 0.7), (0.68, 0.58, 0.715), (244, 244, 240))
    for k in range(20):
        x = -0.64 + 0.066 * k
        b.box((x, 0.42, 0.715), (x + 0.025, 0.51, 0.73), (24, 24, 26))
    for x in (-0.7, 0.64):
        b.box((x, 0.52, 0.0), (x + 0.06, 0.58, 0.6), color)
    surface = Surface(x0=-0.65, y0=0.05, x1=0.65, y1=0.32, z=1.2, kind="shelf")
    return make_model("furniture", "piano", b, (surface,))


def coat_stand(rng: np.random.Generator, style: Style) -> Model:
    """Make a stand with coats."""
    color = wood(rng, style)
    b = MeshBuilder()
    b.frustum((0.0, 0.25), (0.0, 0.04), (0.2, 0.18), color)
    b.frustum((0.0, 0.25), (0.04, 1.72), (0.025, 0.02), color, sides=6)
    for k in range(4):
        a = 0.5 * math.pi * k + 0.4
        x, y = math.cos(a), math.sin(a)
        b.rod((0.0, 0.25, 1.6), (0.16 * x, 0.25 + 0.16 * y, 1.68), 0.02, color)
        if chance(rng, 0.7):
            coat = vary(rng, fabric(rng, style), 0.25)
            b.frustum(
                (0.12 * x, 0.25 + 0.12 * y),
                (uniform(rng, 0.75, 1.0), 1.6),
                (0.15, 0.06),
                coat,
                sides=7,
            )
    return make_model("clothes", "coats", b)


def hanging_clothes(rng: np.random.Generator, style: Style) -> Model:
    """Make jackets on a row of hooks; z = 0 is the floor."""
    w = uniform(rng, 0.6, 1.0)
    b = MeshBuilder()
    b.box((-w / 2, 0.0, 1.66), (w / 2, 0.03, 1.76), wood(rng, style))
    for x in np.arange(-w / 2 + 0.16, w / 2 - 0.1, 0.26).tolist():
        if chance(rng, 0.85):
            low = uniform(rng, 0.85, 1.15)
            color = vary(rng, fabric(rng, style), 0.3)
            b.box((x - 0.14, 0.03, low), (x + 0.14, 0.16, 1.7), color, taper=0.05)
    return make_model("clothes", "jackets", b)


def drying_rack(rng: np.random.Generator, style: Style) -> Model:
    """Make a rack with laundry on it."""
    b = MeshBuilder()
    metal = (190, 192, 196)
    for x in (-0.5, 0.5):
        b.rod((x, 0.05, 0.0), (x, 0.5, 0.95), 0.025, metal)
        b.rod((x, 0.5, 0.0), (x, 0.05, 0.95), 0.025, metal)
    for y in (0.05, 0.2, 0.35, 0.5):
        b.rod((-0.5, y, 0.95), (0.5, y, 0.95), 0.015, metal)
        x = -0.46
        while x < 0.3:
            w = uniform(rng, 0.15, 0.34)
            if chance(rng, 0.7):
                b.box(
                    (x, y - 0.01, uniform(rng, 0.4, 0.65)),
                    (x + w, y + 0.012, 0.96),
                    vary(rng, fabric(rng, style), 0.3),
                )
            x += w + 0.04
    return make_model("clothes", "laundry", b)


def ironing_board(rng: np.random.Generator) -> Model:
    """Make an ironing board."""
    b = MeshBuilder()
    b.box((-0.62, 0.0, 0.84), (0.62, 0.36, 0.88), accent(rng), taper=0.01)
    for s in (-1.0, 1.0):
        b.rod(
            (-0.4 * s, 0.1 + 0.08 * s, 0.0), (0.35 * s, 0.1 + 0.08 * s, 0.84), 0.03, (170, 172, 176)
        )
    return make_model("furniture", "ironing board", b)


def cardboard_box(rng: np.random.Generator) -> Model:
    """Make a closed box with tape."""
    w, d, h = uniform(rng, 0.3, 0.55), uniform(rng, 0.3, 0.45), uniform(rng, 0.25, 0.42)
    b = MeshBuilder()
    b.box((-w / 2, 0.0, 0.0), (w / 2, d, h), vary(rng, (184, 146, 102), 0.1))
    b.box((-w / 2, d / 2 - 0.03, h), (w / 2, d / 2 + 0.03, h + 0.003), (214, 190, 150))
    return make_model("objects", "box", b)
