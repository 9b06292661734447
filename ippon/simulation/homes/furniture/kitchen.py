"""Kitchen furniture and household machines."""

import numpy as np

from ippon.simulation.homes.furniture.mesh_builder import MeshBuilder
from ippon.simulation.homes.furniture.model import Model, Surface, make_model
from ippon.simulation.homes.furniture.style import Style, chance, pick, shade, uniform, vary, wood

COUNTER_HEIGHT_M = 0.9
COUNTER_DEPTH_M = 0.6
_STEEL = (176, 178, 180)
_WHITE = (236, 236, 234)


def _machine_color(rng: np.random.Generator) -> tuple[int, int, int]:
    return vary(rng, pick(rng, (_WHITE, _STEEL, (60, 62, 66))), 0.05)


def counter(rng: np.random.Generator, style: Style, width: float) -> Model:
    """Make base cabinets under a worktop."""
    h, d = COUNTER_HEIGHT_M, COUNTER_DEPTH_M
    b = MeshBuilder()
    b.box((-width / 2, 0.03, 0.0), (width / 2, d - 0.05, 0.1), shade(style.front, 0.5))
    b.box((-width / 2, 0.0, 0.1), (width / 2, d - 0.02, h - 0.04), style.front)
    count = max(1, round(width / 0.55))
    step = width / count
    for k in range(count):
        x = -width / 2 + k * step
        top = h - 0.06
        if chance(rng, 0.35):
            for z0, z1 in ((0.12, 0.38), (0.39, 0.63), (0.64, top)):
                b.box(
                    (x + 0.006, d - 0.02, z0), (x + step - 0.006, d, z1), shade(style.front, 1.05)
                )
                b.box(
                    (x + step / 2 - 0.07, d, z1 - 0.05),
                    (x + step / 2 + 0.07, d + 0.015, z1 - 0.035),
                    style.metal,
                )
        else:
            b.box((x + 0.006, d - 0.02, 0.12), (x + step - 0.006, d, top), shade(style.front, 1.05))
            b.box(
                (x + step / 2 - 0.07, d, top - 0.05),
                (x + step / 2 + 0.07, d + 0.015, top - 0.035),
                style.metal,
            )
    b.box((-width / 2, 0.0, h - 0.04), (width / 2, d + 0.02, h), style.worktop)
    surface = Surface(
        x0=-width / 2 + 0.04,
        y0=0.1,
        x1=width / 2 - 0.04,
        y1=d - 0.05,
        z=h,
        kind="counter",
        headroom_m=0.5,
    )
    return make_model("counter", "kitchen counter", b, (surface,))


def sink_unit(rng: np.random.Generator, style: Style) -> Model:
    """Make a basin with a tap for a worktop; z = 0 is the worktop."""
    w = uniform(rng, 0.5, 0.7)
    b = MeshBuilder()
    dark = shade(_STEEL, 0.6)
    b.box((-w / 2, 0.1, 0.0), (w / 2, 0.52, 0.012), _STEEL)
    b.box((-w / 2 + 0.04, 0.14, 0.012), (w / 2 - 0.04, 0.48, 0.016), dark)
    b.box((-0.02, 0.05, 0.0), (0.02, 0.09, 0.26), style.metal)
    b.box((-0.015, 0.05, 0.24), (0.015, 0.26, 0.265), style.metal)
    b.box((-0.012, 0.235, 0.2), (0.012, 0.26, 0.24), style.metal)
    return make_model("sink", "kitchen sink", b)


def hob(rng: np.random.Generator) -> Model:
    """Make a glass hob for a worktop."""
    w = uniform(rng, 0.56, 0.6)
    b = MeshBuilder()
    b.box((-w / 2, 0.06, 0.0), (w / 2, 0.55, 0.012), (28, 28, 30))
    for x in (-0.14, 0.14):
        for y, r in ((0.18, 0.08), (0.41, 0.1)):
            b.frustum((x, y), (0.012, 0.016), (r, r), (72, 60, 58), sides=10)
    return make_model("appliances", "stove", b)


def cooker(rng: np.random.Generator) -> Model:
    """Make a free-standing cooker with an oven."""
    color = _machine_color(rng)
    b = MeshBuilder()
    b.box((-0.3, 0.0, 0.0), (0.3, 0.6, 0.9), color)
    b.box((-0.25, 0.6, 0.2), (0.25, 0.615, 0.64), (34, 34, 38))
    b.box((-0.24, 0.615, 0.67), (0.24, 0.65, 0.69), _STEEL)
    for x in (-0.2, -0.07, 0.07, 0.2):
        b.box((x - 0.02, 0.6, 0.77), (x + 0.02, 0.63, 0.81), (50, 50, 52))
    b.box((-0.28, 0.04, 0.9), (0.28, 0.57, 0.908), (30, 30, 32))
    for x in (-0.14, 0.14):
        for y in (0.18, 0.43):
            b.frustum((x, y), (0.908, 0.925), (0.09, 0.09), (84, 82, 80), sides=10)
    return make_model("appliances", "stove", b)


def range_hood(rng: np.random.Generator) -> Model:
    """Make a range hood; its underside is at z = 0."""
    color = vary(rng, _STEEL, 0.1)
    b = MeshBuilder()
    b.box((-0.3, 0.0, 0.0), (0.3, 0.48, 0.12), color, taper=0.05)
    b.box((-0.13, 0.0, 0.12), (0.13, 0.26, 0.75), color)
    return make_model("appliances", "range hood", b)


def fridge(rng: np.random.Generator) -> Model:
    """Make a refrigerator with a freezer door."""
    w, d, h = uniform(rng, 0.58, 0.72), uniform(rng, 0.6, 0.7), uniform(rng, 1.65, 2.0)
    color = _machine_color(rng)
    split = uniform(rng, 0.3, 0.4) * h
    b = MeshBuilder()
    b.box((-w / 2, 0.0, 0.03), (w / 2, d, h), color)
    for z0, z1 in ((0.05, split), (split + 0.01, h - 0.01)):
        b.box((-w / 2, d, z0), (w / 2, d + 0.03, z1), shade(color, 1.06))
    for z0 in (split - 0.34, split + 0.08):
        b.box(
            (-w / 2 + 0.05, d + 0.03, z0), (-w / 2 + 0.08, d + 0.065, z0 + 0.26), shade(_STEEL, 0.8)
        )
    return make_model("appliances", "refrigerator", b)


def washing_machine(rng: np.random.Generator, *, dryer: bool = False) -> Model:
    """Make a washing machine or dryer with a round door."""
    color = vary(rng, _WHITE if chance(rng, 0.8) else (70, 72, 76), 0.04)
    b = MeshBuilder()
    b.box((-0.3, 0.0, 0.02), (0.3, 0.56, 0.85), color)
    b.box((-0.29, 0.56, 0.73), (0.29, 0.575, 0.84), shade(color, 0.85))
    _disc(b, 0.56, 0.43, 0.2, 0.03, _STEEL)
    _disc(b, 0.585, 0.43, 0.15, 0.015, (48, 52, 60))
    surface = Surface(x0=-0.25, y0=0.05, x1=0.25, y1=0.5, z=0.85, kind="counter")
    return make_model("appliances", "dryer" if dryer else "washing machine", b, (surface,))


def _disc(
    b: MeshBuilder, y: float, z: float, radius: float, thickness: float, color: tuple[int, int, int]
) -> None:
    """Add a round plate that faces +y."""
    a = 2.0 * np.pi * np.arange(12) / 12
    ring = np.stack([radius * np.cos(a), np.full(12, y), z + radius * np.sin(a)], axis=1)
    front = ring + np.array([0.0, thickness, 0.0])
    center = np.array([[0.0, y + thickness, z]])
    i = np.arange(12)
    j = (i + 1) % 12
    faces = np.concatenate(
        [
            np.stack([i, i + 12, j + 12], axis=1),
            np.stack([i, j + 12, j], axis=1),
            np.stack([np.full(12, 24), j + 12, i + 12], axis=1),
        ]
    )
    b.add(np.concatenate([ring, front, center]), faces, color)


def dishwasher(rng: np.random.Generator, style: Style) -> Model:
    """Make a dishwasher under a piece of worktop."""
    color = _machine_color(rng)
    b = MeshBuilder()
    b.box((-0.3, 0.0, 0.05), (0.3, 0.57, 0.86), color)
    b.box((-0.29, 0.57, 0.1), (0.29, 0.6, 0.74), shade(color, 1.05))
    b.box((-0.29, 0.57, 0.75), (0.29, 0.6, 0.85), shade(color, 0.6))
    b.box((-0.3, 0.0, 0.86), (0.3, 0.62, 0.9), style.worktop)
    surface = Surface(x0=-0.26, y0=0.1, x1=0.26, y1=0.5, z=0.9, kind="counter", headroom_m=0.5)
    return make_model("appliances", "dishwasher", b, (surface,))


def wall_cupboard(style: Style, width: float) -> Model:
    """Make a wall cabinet; its underside is at z = 0."""
    b = MeshBuilder()
    b.box((-width / 2, 0.0, 0.0), (width / 2, 0.33, 0.68), style.front)
    count = max(1, round(width / 0.5))
    step = width / count
    for k in range(count):
        x = -width / 2 + k * step
        b.box((x + 0.006, 0.33, 0.006), (x + step - 0.006, 0.348, 0.674), shade(style.front, 1.05))
        b.box((x + step / 2 - 0.05, 0.348, 0.03), (x + step / 2 + 0.05, 0.36, 0.045), style.metal)
    return make_model("cabinet", "kitchen upper cabinet", b)


def island(rng: np.random.Generator, style: Style) -> Model:
    """Make a kitchen island of cabinets."""
    w, d = uniform(rng, 1.2, 1.9), uniform(rng, 0.75, 0.95)
    b = MeshBuilder()
    color = style.front if chance(rng, 0.5) else wood(rng, style)
    b.box((-w / 2 + 0.1, 0.05, 0.0), (w / 2 - 0.1, d - 0.25, 0.86), color)
    b.box((-w / 2, 0.0, 0.86), (w / 2, d, 0.91), style.worktop)
    surface = Surface(x0=-w / 2 + 0.08, y0=0.1, x1=w / 2 - 0.08, y1=d - 0.1, z=0.91, kind="counter")
    return make_model("counter", "kitchen island", b, (surface,))


def microwave(rng: np.random.Generator) -> Model:
    """Make a microwave oven."""
    color = _machine_color(rng)
    b = MeshBuilder()
    b.box((-0.25, 0.0, 0.01), (0.25, 0.36, 0.29), color)
    b.box((-0.23, 0.36, 0.03), (0.1, 0.37, 0.27), (30, 32, 36))
    b.box((0.12, 0.36, 0.03), (0.23, 0.37, 0.27), shade(color, 0.7))
    return make_model("appliances", "microwave", b)


def coffee_machine(rng: np.random.Generator) -> Model:
    """Make a coffee machine with its pot."""
    color = pick(rng, ((40, 40, 44), (180, 50, 46), (190, 192, 194)))
    b = MeshBuilder()
    b.box((-0.1, 0.0, 0.0), (0.1, 0.26, 0.04), color)
    b.box((-0.1, 0.0, 0.04), (0.1, 0.1, 0.34), color)
    b.box((-0.1, 0.0, 0.26), (0.1, 0.24, 0.36), shade(color, 1.15))
    b.frustum((0.0, 0.17), (0.04, 0.19), (0.07, 0.055), (70, 48, 36), sides=8)
    return make_model("appliances", "coffee machine", b)


def kettle(rng: np.random.Generator) -> Model:
    """Make a kettle."""
    color = pick(rng, ((196, 198, 200), (44, 46, 50), (196, 66, 54)))
    b = MeshBuilder()
    b.frustum((0.0, 0.09), (0.0, 0.18), (0.085, 0.06), color, sides=10)
    b.frustum((0.0, 0.09), (0.18, 0.22), (0.06, 0.015), shade(color, 0.8), sides=10)
    b.box((0.06, 0.08, 0.08), (0.12, 0.1, 0.2), (36, 36, 40))
    b.box((-0.12, 0.08, 0.13), (-0.06, 0.1, 0.16), color)
    return make_model("appliances", "kettle", b)


def toaster(rng: np.random.Generator) -> Model:
    """Make a toaster."""
    color = pick(rng, ((200, 200, 202), (196, 66, 54), (120, 160, 150)))
    b = MeshBuilder()
    b.box((-0.14, 0.0, 0.01), (0.14, 0.17, 0.19), color, taper=0.015)
    for y in (0.05, 0.1):
        b.box((-0.1, y, 0.185), (0.1, y + 0.025, 0.193), (40, 34, 30))
    return make_model("appliances", "toaster", b)
