"""Cabinets, chests of drawers and shelves."""

import numpy as np

from ippon.simulation.homes.furniture.mesh_builder import Color, MeshBuilder
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


def _fronts(
    b: MeshBuilder,
    box: tuple[float, float, float, float],
    y: float,
    grid: tuple[int, int],
    color: Color,
    handle: Color,
) -> None:
    """Add a grid of doors or drawers with handles on the front at `y`.

    Args:
        b: Builder that receives the fronts.
        box: x0, z0, x1, z1 of the front.
        y: Position of the front.
        grid: Columns and rows.
        color: Colour of the fronts.
        handle: Colour of the handles.
    """
    x0, z0, x1, z1 = box
    columns, rows = grid
    dx, dz = (x1 - x0) / columns, (z1 - z0) / rows
    g = 0.006
    for i in range(columns):
        for j in range(rows):
            x, z = x0 + i * dx, z0 + j * dz
            b.box((x + g, y, z + g), (x + dx - g, y + 0.018, z + dz - g), color)
            if dx > dz:
                b.box(
                    (x + dx / 2 - 0.07, y + 0.018, z + 0.62 * dz),
                    (x + dx / 2 + 0.07, y + 0.035, z + 0.62 * dz + 0.02),
                    handle,
                )
            else:
                hx = x + (dx - 0.05 if i % 2 == 0 else 0.03)
                b.box(
                    (hx, y + 0.018, z + 0.45 * dz),
                    (hx + 0.02, y + 0.035, z + 0.45 * dz + 0.14),
                    handle,
                )


def wardrobe(rng: np.random.Generator, style: Style, width: float) -> Model:
    """Make a wardrobe of this width, metres."""
    d, h = uniform(rng, 0.55, 0.62), uniform(rng, 1.95, 2.3)
    body = style.front if chance(rng, 0.5) else wood(rng, style)
    b = MeshBuilder()
    b.box((-width / 2, 0.0, 0.0), (width / 2, d, h), body)
    _fronts(
        b,
        (-width / 2, 0.06, width / 2, h),
        d,
        (max(2, round(width / 0.5)), 1),
        shade(body, 1.06),
        style.metal,
    )
    return make_model("cabinet", "wardrobe", b)


def chest_of_drawers(rng: np.random.Generator, style: Style) -> Model:
    """Make a chest of drawers."""
    w, d, h = uniform(rng, 0.75, 1.3), uniform(rng, 0.42, 0.5), uniform(rng, 0.75, 1.05)
    color = wood(rng, style)
    b = MeshBuilder()
    b.box((-w / 2, 0.0, 0.08), (w / 2, d, h), color)
    for x in (-w / 2 + 0.02, w / 2 - 0.07):
        b.box((x, 0.02, 0.0), (x + 0.05, d - 0.02, 0.08), shade(color, 0.8))
    grid = (2 if w > 1.05 else 1, int(pick(rng, (3, 4))))
    _fronts(
        b, (-w / 2 + 0.02, 0.1, w / 2 - 0.02, h - 0.03), d, grid, shade(color, 1.1), style.metal
    )
    surface = Surface(x0=-w / 2 + 0.06, y0=0.06, x1=w / 2 - 0.06, y1=d - 0.06, z=h, kind="shelf")
    return make_model("chest_of_drawers", pick(rng, ("chest of drawers", "dresser")), b, (surface,))


def tv_stand(rng: np.random.Generator, style: Style, width: float) -> Model:
    """Make a low cabinet for a television."""
    d, h = uniform(rng, 0.38, 0.45), uniform(rng, 0.4, 0.58)
    color = wood(rng, style)
    b = MeshBuilder()
    b.box((-width / 2, 0.0, 0.06), (width / 2, d, h), color)
    _fronts(
        b,
        (-width / 2 + 0.02, 0.09, width / 2 - 0.02, h - 0.04),
        d,
        (3, 1),
        shade(color, 1.1),
        style.metal,
    )
    surface = Surface(
        x0=-width / 2 + 0.04,
        y0=d - 0.16,
        x1=width / 2 - 0.04,
        y1=d - 0.03,
        z=h,
        kind="shelf",
        headroom_m=0.1,
    )
    return make_model("cabinet", "tv stand", b, (surface,))


def bookshelf(rng: np.random.Generator, style: Style, width: float) -> Model:
    """Make an open bookshelf with rows of books; some boards stay free for other objects."""
    d, h = uniform(rng, 0.27, 0.36), uniform(rng, 1.5, 2.1)
    color = wood(rng, style)
    rows = max(3, round(h / 0.38))
    gap = (h - 0.05) / rows
    b = MeshBuilder()
    for x in (-width / 2, width / 2 - 0.025):
        b.box((x, 0.0, 0.0), (x + 0.025, d, h), color)
    b.box((-width / 2, 0.0, 0.0), (width / 2, 0.012, h), shade(color, 0.85))
    surfaces: list[Surface] = []
    for k in range(rows + 1):
        z = 0.05 + k * gap
        b.box((-width / 2, 0.0, z - 0.025), (width / 2, d, z), color)
        if k == rows:
            continue
        filled = uniform(rng, 0.15, 0.9) if k in (0, 1) or chance(rng, 0.7) else 0.0
        end = _books(
            rng, b, -width / 2 + 0.03, -width / 2 + 0.03 + filled * (width - 0.06), z, gap, d
        )
        if width / 2 - end > 0.2:
            surfaces.append(
                Surface(
                    x0=end + 0.02,
                    y0=0.05,
                    x1=width / 2 - 0.04,
                    y1=d - 0.02,
                    z=z,
                    kind="shelf",
                    headroom_m=gap - 0.05,
                )
            )
    return make_model("shelving", "bookshelf", b, tuple(surfaces))


def _books(
    rng: np.random.Generator,
    b: MeshBuilder,
    x0: float,
    x1: float,
    z: float,
    gap: float,
    depth: float,
) -> float:
    """Fill a board with groups of books from x0; return where they end."""
    x = x0
    while x < x1 - 0.03:
        w = uniform(rng, 0.03, 0.09)
        if x + w > x1:
            break
        h = uniform(rng, 0.5, 0.85) * gap
        b.box(
            (x, 0.02, z),
            (x + w - 0.003, min(depth - 0.02, uniform(rng, 0.15, 0.26)), z + h),
            accent(rng) if chance(rng, 0.6) else vary(rng, (120, 100, 84), 0.4),
        )
        x += w
    return x


def low_shelf(rng: np.random.Generator, style: Style) -> Model:
    """Make a low open shelf of cubes."""
    columns = int(pick(rng, (2, 3, 4)))
    cell, d = uniform(rng, 0.33, 0.4), uniform(rng, 0.32, 0.4)
    w, h = columns * cell, 2 * cell
    color = wood(rng, style)
    b = MeshBuilder()
    b.box((-w / 2, 0.0, 0.0), (w / 2, 0.012, h), shade(color, 0.85))
    for i in range(columns + 1):
        b.box((-w / 2 + i * cell - 0.012, 0.0, 0.0), (-w / 2 + i * cell + 0.012, d, h), color)
    for j in range(3):
        b.box((-w / 2 - 0.012, 0.0, j * cell), (w / 2 + 0.012, d, j * cell + 0.024), color)
    for i in range(columns):
        for j in range(2):
            if chance(rng, 0.5):
                x = -w / 2 + (i + 0.5) * cell
                b.block(
                    x, 0.03, j * cell + 0.025, (cell - 0.06, d - 0.06, cell - 0.12), accent(rng)
                )
    surface = Surface(
        x0=-w / 2 + 0.05, y0=0.05, x1=w / 2 - 0.05, y1=d - 0.05, z=h + 0.024, kind="shelf"
    )
    return make_model("shelving", "shelf", b, (surface,))


def shop_rack(rng: np.random.Generator, style: Style, width: float) -> Model:
    """Make shelves for a shop that are filled from both sides; the origin is at one of them."""
    d, h, board = 0.8, uniform(rng, 1.35, 1.75), shade(style.front, 0.9)
    b = MeshBuilder()
    b.box((-width / 2, d / 2 - 0.02, 0.0), (width / 2, d / 2 + 0.02, h), shade(board, 0.9))
    surfaces: list[Surface] = []
    rows = 4
    gap = (h - 0.1) / rows
    for k in range(rows):
        z = 0.1 + k * gap
        b.box((-width / 2, 0.0, z - 0.03), (width / 2, d, z), board)
        for y in (0.05, d - 0.3):
            x = -width / 2
            while x < width / 2 - 0.5:
                w = uniform(rng, 0.25, 0.5)
                goods = vary(rng, accent(rng), 0.3)
                b.box((x + 0.01, y, z), (x + w, y + 0.25, z + uniform(rng, 0.5, 0.8) * gap), goods)
                x += w if chance(rng, 0.85) else 2.0 * w
            surfaces.append(
                Surface(x0=x + 0.02, y0=y, x1=width / 2 - 0.02, y1=y + 0.25, z=z, kind="shelf",
                        headroom_m=gap - 0.05)
            )  # fmt: skip
    kept = tuple(s for s in surfaces if s.x1 - s.x0 > 0.2)
    return make_model("shelving", "shop rack", b, kept)


def wall_shelf(rng: np.random.Generator, style: Style) -> Model:
    """Make a board on two brackets; its underside is at z = 0."""
    w, d = uniform(rng, 0.6, 1.1), uniform(rng, 0.18, 0.26)
    b = MeshBuilder()
    b.box((-w / 2, 0.0, 0.0), (w / 2, d, 0.03), wood(rng, style))
    for x in (-0.35 * w, 0.35 * w):
        b.box((x - 0.01, 0.0, -0.1), (x + 0.01, 0.7 * d, 0.0), style.metal)
    end = _books(rng, b, -w / 2 + 0.02, -w / 2 + 0.02 + uniform(rng, 0.0, 0.7) * w, 0.03, 0.3, d)
    surface = Surface(
        x0=end + 0.03, y0=0.03, x1=w / 2 - 0.03, y1=d - 0.02, z=0.03, kind="shelf", headroom_m=0.4
    )
    return make_model("shelving", "wall shelf", b, (surface,))


def shoe_rack(rng: np.random.Generator, style: Style) -> Model:
    """Make a shoe rack with slanted boards."""
    w, d = uniform(rng, 0.6, 0.9), 0.3
    color = wood(rng, style)
    b = MeshBuilder()
    for x in (-w / 2, w / 2 - 0.03):
        b.box((x, 0.0, 0.0), (x + 0.03, d, 0.5), color)
    for z in (0.1, 0.3, 0.48):
        b.box((-w / 2, 0.0, z), (w / 2, d, z + 0.02), color)
    for z in (0.12, 0.32):
        for x in np.arange(-w / 2 + 0.12, w / 2 - 0.1, 0.22).tolist():
            if chance(rng, 0.7):
                b.block(
                    x,
                    0.04,
                    z,
                    (0.16, 0.24, 0.08),
                    vary(
                        rng,
                        pick(rng, ((40, 40, 44), (120, 80, 52), (220, 220, 220), (160, 50, 50))),
                        0.2,
                    ),
                )
    surface = Surface(x0=-w / 2 + 0.05, y0=0.04, x1=w / 2 - 0.05, y1=d - 0.04, z=0.5, kind="shelf")
    return make_model("shelving", "shoe rack", b, (surface,))
