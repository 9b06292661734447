"""Chairs, sofas and other seats."""

import math

import numpy as np

from ippon.simulation.homes.furniture.mesh_builder import BOX_FACES, Color, MeshBuilder
from ippon.simulation.homes.furniture.model import Model, Surface, make_model
from ippon.simulation.homes.furniture.style import Style, chance, fabric, pick, shade, uniform, wood


def _legs(
    b: MeshBuilder, width: float, depth: float, height: float, thickness: float, color: Color
) -> None:
    """Add four legs under a seat or top of this size, from y = 0."""
    t = thickness
    for x in (-width / 2 + t, width / 2 - t):
        for y in (t, depth - t):
            b.box((x - t / 2, y - t / 2, 0.0), (x + t / 2, y + t / 2, height), color)


def chair(rng: np.random.Generator, style: Style) -> Model:
    """Make a dining chair: four legs, a seat, a back of slats or a board."""
    w, d = uniform(rng, 0.40, 0.48), uniform(rng, 0.42, 0.50)
    seat, back = uniform(rng, 0.43, 0.47), uniform(rng, 0.82, 1.02)
    frame = wood(rng, style) if chance(rng, 0.75) else style.metal
    b = MeshBuilder()
    _legs(b, w, d, seat, 0.04, shade(frame, 0.88))
    top = fabric(rng, style) if chance(rng, 0.5) else frame
    b.box((-w / 2, 0.0, seat - 0.03), (w / 2, d, seat + 0.03), top)
    if chance(rng, 0.5):
        for x in np.linspace(-w / 2 + 0.03, w / 2 - 0.03, 4).tolist():
            b.rod((x, 0.03, seat), (x, -0.0 + 0.02, back - 0.04), 0.03, frame)
        b.box((-w / 2, 0.0, back - 0.1), (w / 2, 0.04, back), frame)
    else:
        b.box((-w / 2, 0.0, seat + 0.08), (w / 2, 0.04, back), top, taper=0.01)
        for x in (-w / 2 + 0.03, w / 2 - 0.03):
            b.box((x - 0.02, 0.0, seat), (x + 0.02, 0.035, seat + 0.1), frame)
    surface = Surface(
        x0=-w / 2 + 0.03, y0=0.08, x1=w / 2 - 0.03, y1=d - 0.03, z=seat + 0.03, kind="seat"
    )
    return make_model("chair", "chair", b, (surface,))


def office_chair(rng: np.random.Generator, style: Style) -> Model:
    """Make a swivel chair on a star base."""
    color = pick(rng, ((40, 42, 46), (88, 92, 98), fabric(rng, style)))
    b = MeshBuilder()
    for k in range(5):
        a = 2.0 * math.pi * k / 5
        b.rod(
            (0.0, 0.3, 0.09),
            (0.28 * math.cos(a), 0.3 + 0.28 * math.sin(a), 0.05),
            0.04,
            style.metal,
        )
    b.frustum((0.0, 0.3), (0.08, 0.44), (0.03, 0.03), style.metal, sides=6)
    b.box((-0.25, 0.07, 0.44), (0.25, 0.55, 0.52), color, taper=0.02)
    b.box((-0.22, 0.02, 0.56), (0.22, 0.09, 1.05), color, taper=0.015)
    b.box((-0.03, 0.02, 0.44), (0.03, 0.06, 0.6), style.metal)
    for x in (-0.28, 0.25):
        b.box((x, 0.12, 0.66), (x + 0.04, 0.42, 0.69), style.metal)
        b.box((x, 0.24, 0.48), (x + 0.03, 0.28, 0.66), style.metal)
    surface = Surface(x0=-0.2, y0=0.14, x1=0.2, y1=0.5, z=0.52, kind="seat")
    return make_model("chair", "office chair", b, (surface,))


def armchair(rng: np.random.Generator, style: Style) -> Model:
    """Make an armchair."""
    w, d, h = uniform(rng, 0.75, 0.95), uniform(rng, 0.75, 0.9), uniform(rng, 0.78, 0.98)
    return _upholstered(rng, style, (w, d, h), seats=1, name=("chair", "armchair"))


def sofa(rng: np.random.Generator, style: Style, width: float) -> Model:
    """Make a sofa of about this width, metres."""
    d, h = uniform(rng, 0.82, 0.98), uniform(rng, 0.72, 0.9)
    seats = 2 if width < 1.75 else 3
    return _upholstered(rng, style, (width, d, h), seats=seats, name=("sofa", "sofa"))


def _upholstered(
    rng: np.random.Generator,
    style: Style,
    size: tuple[float, float, float],
    *,
    seats: int,
    name: tuple[str, str],
) -> Model:
    """Make frame, back, arms, and one seat and back pad per seat."""
    w, d, h = size
    color = fabric(rng, style)
    pad = shade(color, uniform(rng, 1.04, 1.18))
    arm, arm_h, seat_h = uniform(rng, 0.12, 0.22), uniform(rng, 0.54, 0.66), uniform(rng, 0.4, 0.46)
    foot = uniform(rng, 0.05, 0.14)
    b = MeshBuilder()
    _legs(b, w, d, foot, 0.06, shade(style.wood, 0.7))
    b.box((-w / 2, 0.0, foot), (w / 2, d, seat_h - 0.12), color)
    b.box((-w / 2, 0.0, seat_h - 0.12), (w / 2, 0.2, h), color, taper=0.02)
    for x in (-w / 2, w / 2 - arm):
        b.box((x, 0.0, seat_h - 0.12), (x + arm, d, arm_h), color, taper=0.015)
    inner = (w - 2 * arm) / seats
    for k in range(seats):
        x = -w / 2 + arm + k * inner
        b.box(
            (x + 0.01, 0.16, seat_h - 0.12), (x + inner - 0.01, d + 0.02, seat_h), pad, taper=0.02
        )
        b.box((x + 0.01, 0.16, seat_h), (x + inner - 0.01, 0.34, h + 0.03), pad, taper=0.03)
    surface = Surface(
        x0=-w / 2 + arm + 0.04, y0=0.38, x1=w / 2 - arm - 0.04, y1=d - 0.04, z=seat_h, kind="seat"
    )
    return make_model(*name, b, (surface,))


def corner_sofa(rng: np.random.Generator, style: Style, width: float) -> Model:
    """Make a sofa with a chaise longue at one end."""
    straight = sofa(rng, style, width)
    color: Color = tuple(straight.mesh.colors[-1].tolist())  # type: ignore[assignment]
    side = 1.0 if chance(rng, 0.5) else -1.0
    d, long = straight.depth_m, uniform(rng, 1.45, 1.7)
    x = side * (width / 2 - 0.42)
    b = MeshBuilder().add_mesh(straight.mesh)
    b.box((x - 0.4, d - 0.03, 0.08), (x + 0.4, long, 0.43), color, taper=0.015)
    lounge = Surface(x0=x - 0.35, y0=d, x1=x + 0.35, y1=long - 0.05, z=0.43, kind="seat")
    return make_model("sofa", "corner sofa", b, (*straight.surfaces, lounge))


def stool(rng: np.random.Generator, style: Style, *, bar: bool = False) -> Model:
    """Make a stool or a bar stool."""
    h = uniform(rng, 0.64, 0.76) if bar else uniform(rng, 0.42, 0.5)
    r = uniform(rng, 0.16, 0.2)
    color = wood(rng, style)
    b = MeshBuilder()
    b.frustum((0.0, r), (h - 0.05, h), (r, r), fabric(rng, style) if chance(rng, 0.5) else color)
    for k in range(4):
        a = math.pi * (0.25 + 0.5 * k)
        x, y = math.cos(a), math.sin(a)
        b.rod(
            (0.6 * r * x, r + 0.6 * r * y, h - 0.04),
            (0.95 * r * x, r + 0.95 * r * y, 0.0),
            0.035,
            shade(color, 0.85),
        )
    surface = Surface(x0=-0.1, y0=r - 0.1, x1=0.1, y1=r + 0.1, z=h, kind="seat")
    return make_model("stool", "bar stool" if bar else "stool", b, (surface,))


def pouf(rng: np.random.Generator, style: Style) -> Model:
    """Make a low round seat."""
    r, h = uniform(rng, 0.22, 0.3), uniform(rng, 0.34, 0.42)
    color = fabric(rng, style)
    b = MeshBuilder()
    b.frustum((0.0, r), (0.0, 0.3 * h), (0.85 * r, r), color)
    b.frustum((0.0, r), (0.3 * h, h), (r, 0.8 * r), color, top_color=shade(color, 1.15))
    return make_model("stool", "pouf", b)


def bench(rng: np.random.Generator, style: Style) -> Model:
    """Make a bench for a hall or the foot of a bed."""
    w, d, h = uniform(rng, 0.9, 1.3), uniform(rng, 0.34, 0.42), uniform(rng, 0.42, 0.48)
    color = wood(rng, style)
    b = MeshBuilder()
    _legs(b, w, d, h, 0.05, color)
    b.box((-w / 2, 0.0, h - 0.05), (w / 2, d, h), color)
    b.box(
        (-w / 2 + 0.03, 0.02, h), (w / 2 - 0.03, d - 0.02, h + 0.05), fabric(rng, style), taper=0.01
    )
    surface = Surface(
        x0=-w / 2 + 0.05, y0=0.05, x1=w / 2 - 0.05, y1=d - 0.05, z=h + 0.05, kind="seat"
    )
    return make_model("seating", "bench", b, (surface,))


def cushion(rng: np.random.Generator, color: Color, label: str = "cushion") -> Model:
    """Make a cushion that leans against a back, or a pillow."""
    b = MeshBuilder()
    if label == "pillow":
        w, d = uniform(rng, 0.5, 0.68), uniform(rng, 0.34, 0.42)
        b.box((-w / 2, 0.0, 0.0), (w / 2, d, 0.05), color)
        b.box((-w / 2, 0.0, 0.05), (w / 2, d, 0.13), color, taper=0.05)
    else:
        s = uniform(rng, 0.36, 0.46)
        lean = 0.12
        for k, (y, t) in enumerate(((0.0, 0.06), (0.06, 0.06))):
            inset = 0.02 + 0.03 * k
            low, high = (y + lean, y + lean + t), (y, y + t)
            v = np.array(
                [
                    [-s / 2, low[0], 0.0], [s / 2, low[0], 0.0],
                    [s / 2 - inset, low[1], 0.02], [-s / 2 + inset, low[1], 0.02],
                    [-s / 2, high[0], s], [s / 2, high[0], s],
                    [s / 2 - inset, high[1], s - 0.02], [-s / 2 + inset, high[1], s - 0.02],
                ]
            )  # fmt: skip
            b.add(v, BOX_FACES, color if k == 0 else shade(color, 1.08))
    return make_model("cushion", label, b)
