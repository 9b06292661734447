"""Small household objects; each stands at z = 0 on its support."""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from ippon.simulation.homes.furniture.decor import add_mug
from ippon.simulation.homes.furniture.mesh_builder import Color, MeshBuilder
from ippon.simulation.homes.furniture.model import Model, make_model
from ippon.simulation.homes.furniture.style import accent, chance, pick, shade, uniform, vary

Maker = Callable[[np.random.Generator, MeshBuilder], None]
_DARK: Color = (38, 40, 44)


def _hat(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = vary(rng, pick(rng, ((126, 84, 52), (196, 170, 120), (60, 64, 76), (150, 48, 44))))
    r = uniform(rng, 0.15, 0.18)
    b.frustum((0.0, 0.0), (0.0, 0.015), (r, 0.96 * r), color, sides=14)
    b.frustum((0.0, 0.0), (0.015, 0.12), (0.56 * r, 0.5 * r), color, sides=12)
    b.frustum((0.0, 0.0), (0.018, 0.045), (0.58 * r, 0.57 * r), shade(color, 0.45), sides=12)


def _mug(rng: np.random.Generator, b: MeshBuilder) -> None:
    add_mug(b, accent(rng))


def _book(rng: np.random.Generator, b: MeshBuilder) -> None:
    z = 0.0
    for _ in range(int(rng.integers(1, 4))):
        w, d, h = uniform(rng, 0.12, 0.17), uniform(rng, 0.17, 0.24), uniform(rng, 0.015, 0.04)
        b.box((-w / 2, -d / 2, z), (w / 2, d / 2, z + h), accent(rng))
        b.box(
            (-w / 2 + 0.006, -d / 2 - 0.002, z + 0.004),
            (w / 2, d / 2 + 0.002, z + h - 0.004),
            (236, 230, 216),
        )
        z += h


def _laptop(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = pick(rng, ((176, 178, 182), (70, 72, 76)))
    b.box((-0.17, -0.12, 0.0), (0.17, 0.12, 0.018), color)
    b.box((-0.15, -0.04, 0.018), (0.15, 0.1, 0.02), _DARK)
    v = np.array(
        [[-0.17, -0.12, 0.018], [0.17, -0.12, 0.018], [0.17, -0.19, 0.24], [-0.17, -0.19, 0.24]]
    )
    quad = np.array([[0, 1, 2], [0, 2, 3]])
    b.add(v, quad, color)
    inner = v * (0.93, 1.0, 0.94) + (0.0, 0.006, 0.008)
    b.add(inner, quad, (84, 120, 160))


def _remote(_: np.random.Generator, b: MeshBuilder) -> None:
    b.box((-0.025, -0.09, 0.0), (0.025, 0.09, 0.022), _DARK)
    b.box((-0.012, 0.05, 0.022), (0.012, 0.07, 0.025), (190, 60, 50))
    b.box((-0.016, -0.06, 0.022), (0.016, 0.03, 0.024), (130, 132, 136))


def _keys(rng: np.random.Generator, b: MeshBuilder) -> None:
    b.frustum((0.0, 0.0), (0.0, 0.008), (0.03, 0.03), (200, 176, 90), sides=8)
    for a in (0.2, 1.0, 1.9):
        b.rod(
            (0.0, 0.0, 0.006),
            (0.09 * math.cos(a), 0.09 * math.sin(a), 0.006),
            0.012,
            (176, 178, 182),
        )
    b.box((-0.06, -0.05, 0.0), (-0.02, -0.02, 0.015), accent(rng))


def _backpack(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = accent(rng)
    b.box((-0.16, -0.1, 0.0), (0.16, 0.1, 0.42), color, taper=0.035)
    b.box((-0.13, 0.1, 0.03), (0.13, 0.16, 0.22), shade(color, 0.8), taper=0.015)
    for x in (-0.1, 0.07):
        b.rod((x, -0.1, 0.05), (x, -0.12, 0.36), 0.035, shade(color, 0.6))


def _handbag(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = vary(rng, pick(rng, ((120, 70, 44), (44, 42, 46), (170, 60, 70), (206, 186, 150))))
    b.box((-0.16, -0.06, 0.0), (0.16, 0.06, 0.22), color, taper=0.02)
    for s in (-1.0, 1.0):
        b.rod((0.1 * s, 0.0, 0.21), (0.05 * s, 0.0, 0.34), 0.018, shade(color, 0.7))
    b.rod((-0.05, 0.0, 0.34), (0.05, 0.0, 0.34), 0.018, shade(color, 0.7))


def _toy_car(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = accent(rng)
    b.box((-0.05, -0.12, 0.025), (0.05, 0.12, 0.065), color)
    b.box((-0.045, -0.07, 0.065), (0.045, 0.05, 0.105), shade(color, 1.25), taper=0.012)
    for x in (-0.055, 0.04):
        for y in (-0.085, 0.055):
            b.box((x, y, 0.0), (x + 0.015, y + 0.045, 0.045), _DARK)


def _teddy(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = vary(rng, pick(rng, ((160, 112, 66), (206, 176, 130), (110, 78, 56), (196, 150, 150))))
    b.ball((0.0, 0.0, 0.12), (0.1, 0.085, 0.12), color)
    b.ball((0.0, 0.02, 0.28), (0.085, 0.08, 0.08), color)
    b.ball((0.0, 0.09, 0.265), (0.035, 0.03, 0.028), shade(color, 1.3), sides=6, rings=4)
    for s in (-1.0, 1.0):
        b.ball((0.065 * s, 0.0, 0.355), (0.03, 0.02, 0.03), color, sides=6, rings=4)
        b.ball((0.06 * s, 0.1, 0.04), (0.04, 0.08, 0.04), color, sides=6, rings=4)
        b.ball((0.11 * s, 0.04, 0.17), (0.04, 0.07, 0.035), color, sides=6, rings=4)


def _toy_elephant(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = vary(rng, pick(rng, ((140, 146, 158), (176, 150, 170), (120, 150, 170))))
    b.ball((0.0, -0.04, 0.14), (0.085, 0.13, 0.08), color)
    b.ball((0.0, 0.11, 0.19), (0.065, 0.07, 0.07), color)
    b.rod((0.0, 0.16, 0.18), (0.0, 0.22, 0.06), 0.04, color)
    for s in (-1.0, 1.0):
        b.ball((0.08 * s, 0.08, 0.2), (0.05, 0.015, 0.06), shade(color, 1.1), sides=6, rings=4)
        for y in (-0.11, 0.04):
            b.frustum((0.045 * s, y), (0.0, 0.1), (0.03, 0.03), color, sides=6)


def _bottle(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = pick(rng, ((52, 96, 66), (150, 190, 206), (120, 70, 40), accent(rng)))
    b.frustum((0.0, 0.0), (0.0, 0.18), (0.038, 0.038), color, sides=8)
    b.frustum((0.0, 0.0), (0.18, 0.23), (0.038, 0.014), color, sides=8)
    b.frustum((0.0, 0.0), (0.23, 0.29), (0.014, 0.014), shade(color, 0.7), sides=6)
    b.frustum((0.0, 0.0), (0.06, 0.13), (0.0395, 0.0395), (236, 230, 214), sides=8)


def _vase(rng: np.random.Generator, b: MeshBuilder) -> None:
    color, h = accent(rng), uniform(rng, 0.2, 0.32)
    b.frustum((0.0, 0.0), (0.0, 0.45 * h), (0.04, 0.075), color)
    b.frustum((0.0, 0.0), (0.45 * h, 0.85 * h), (0.075, 0.03), color)
    b.frustum((0.0, 0.0), (0.85 * h, h), (0.03, 0.045), color, top_color=_DARK)


def _shoes(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = vary(rng, pick(rng, ((226, 226, 222), (44, 44, 48), (126, 82, 52), (176, 54, 54))))
    for x, lag in ((-0.065, 0.0), (0.065, uniform(rng, -0.05, 0.05))):
        b.box((x - 0.048, -0.14 + lag, 0.0), (x + 0.048, 0.14 + lag, 0.03), shade(color, 0.6))
        b.box((x - 0.045, -0.135 + lag, 0.03), (x + 0.045, 0.13 + lag, 0.075), color, taper=0.012)
        b.box((x - 0.042, -0.135 + lag, 0.07), (x + 0.042, -0.01 + lag, 0.12), color, taper=0.012)


def _umbrella(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = accent(rng)
    b.rod((0.0, -0.38, 0.03), (0.0, 0.2, 0.03), 0.055, color)
    b.rod((0.0, 0.2, 0.03), (0.0, 0.4, 0.03), 0.018, _DARK)
    b.rod((0.0, 0.4, 0.03), (0.07, 0.4, 0.03), 0.025, (126, 84, 52))


def _phone(rng: np.random.Generator, b: MeshBuilder) -> None:
    b.box((-0.037, -0.075, 0.0), (0.037, 0.075, 0.009), accent(rng), faces={"top": (24, 26, 32)})


def _tablet(_: np.random.Generator, b: MeshBuilder) -> None:
    b.box((-0.09, -0.125, 0.0), (0.09, 0.125, 0.01), (190, 192, 196))
    b.box((-0.08, -0.115, 0.01), (0.08, 0.115, 0.0115), (30, 34, 42))


def _glasses_case(rng: np.random.Generator, b: MeshBuilder) -> None:
    b.box((-0.08, -0.03, 0.0), (0.08, 0.03, 0.022), accent(rng))
    b.box((-0.08, -0.03, 0.022), (0.08, 0.03, 0.045), accent(rng), taper=0.012)


def _headphones(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = accent(rng)
    points = [
        (0.085 * math.cos(a), 0.085 * math.sin(a), 0.03)
        for a in np.linspace(0.0, math.pi, 7).tolist()
    ]
    for p, q in pairwise(points):
        b.rod(p, q, 0.02, _DARK)
    for s in (-1.0, 1.0):
        b.box((0.085 * s - 0.02, -0.06, 0.0), (0.085 * s + 0.02, 0.02, 0.07), color)


def _bowl(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = accent(rng)
    b.frustum((0.0, 0.0), (0.0, 0.08), (0.06, 0.13), color, sides=12, top_color=shade(color, 0.7))
    for k in range(int(rng.integers(0, 5))):
        a = 2.1 * k
        fruit = pick(rng, ((200, 52, 44), (226, 168, 50), (120, 160, 60), (232, 130, 40)))
        b.ball(
            (0.055 * math.cos(a), 0.055 * math.sin(a), 0.1), (0.038, 0.038, 0.036), fruit, sides=7
        )


def _apple(rng: np.random.Generator, b: MeshBuilder) -> None:
    b.ball((0.0, 0.0, 0.036), (0.04, 0.04, 0.036), pick(rng, ((200, 52, 44), (130, 170, 62))))
    b.rod((0.0, 0.0, 0.065), (0.01, 0.0, 0.085), 0.008, (90, 62, 40))


def _plate(rng: np.random.Generator, b: MeshBuilder) -> None:
    b.frustum(
        (0.0, 0.0),
        (0.0, 0.02),
        (0.08, 0.13),
        (238, 236, 232),
        sides=14,
        top_color=accent(rng) if chance(rng, 0.3) else (228, 226, 222),
    )


def _pan(_: np.random.Generator, b: MeshBuilder) -> None:
    b.frustum((0.0, 0.0), (0.0, 0.05), (0.11, 0.13), (54, 54, 58), sides=12, top_color=(30, 30, 32))
    b.rod((0.12, 0.0, 0.045), (0.32, 0.0, 0.055), 0.024, _DARK)


def _pot(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = pick(rng, ((170, 172, 176), (176, 60, 50), (70, 74, 80)))
    b.frustum((0.0, 0.0), (0.0, 0.14), (0.11, 0.11), color, sides=12)
    b.frustum((0.0, 0.0), (0.14, 0.16), (0.115, 0.08), shade(color, 0.85), sides=12)
    b.ball((0.0, 0.0, 0.175), (0.02, 0.02, 0.015), _DARK, sides=6, rings=4)


def _clock(rng: np.random.Generator, b: MeshBuilder) -> None:
    b.box((-0.06, -0.03, 0.0), (0.06, 0.03, 0.09), accent(rng), taper=0.008)
    b.box((-0.045, 0.028, 0.02), (0.045, 0.031, 0.07), (236, 236, 230))


def _soap(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = accent(rng)
    b.frustum((0.0, 0.0), (0.0, 0.13), (0.032, 0.032), color, sides=8)
    b.rod((0.0, 0.0, 0.13), (0.0, 0.0, 0.17), 0.012, (230, 230, 228))
    b.rod((0.0, 0.0, 0.17), (0.0, 0.04, 0.168), 0.014, (230, 230, 228))


def _cup(rng: np.random.Generator, b: MeshBuilder) -> None:
    b.frustum((0.0, 0.0), (0.0, 0.1), (0.032, 0.037), (214, 226, 230), sides=8)
    for a in (0.4, 2.6):
        b.rod((0.0, 0.0, 0.02), (0.03 * math.cos(a), 0.03 * math.sin(a), 0.19), 0.01, accent(rng))


def _paper(_: np.random.Generator, b: MeshBuilder) -> None:
    b.frustum(
        (0.0, 0.0), (0.0, 0.1), (0.055, 0.055), (240, 240, 236), sides=10, top_color=(176, 150, 116)
    )


def _screwdriver(rng: np.random.Generator, b: MeshBuilder) -> None:
    b.rod((0.0, -0.1, 0.016), (0.0, 0.01, 0.016), 0.03, pick(rng, ((214, 60, 46), (230, 170, 40))))
    b.rod((0.0, 0.01, 0.016), (0.0, 0.13, 0.016), 0.009, (180, 182, 186))


def _tissues(rng: np.random.Generator, b: MeshBuilder) -> None:
    b.box((-0.12, -0.06, 0.0), (0.12, 0.06, 0.08), accent(rng))
    b.frustum((0.0, 0.0), (0.08, 0.13), (0.03, 0.045), (246, 246, 244), sides=6)


def _ball(rng: np.random.Generator, b: MeshBuilder) -> None:
    r = uniform(rng, 0.09, 0.12)
    b.ball((0.0, 0.0, r), (r, r, r), accent(rng), sides=10, rings=7)
    b.frustum((0.0, 0.0), (r - 0.012, r + 0.012), (1.005 * r, 1.005 * r), (244, 244, 240), sides=12)


def _folded_clothes(rng: np.random.Generator, b: MeshBuilder) -> None:
    z = 0.0
    for _ in range(int(rng.integers(2, 5))):
        b.box((-0.15, -0.12, z), (0.15, 0.12, z + 0.045), accent(rng), taper=0.008)
        z += 0.043


def _shirt(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = accent(rng)
    b.box((-0.2, -0.25, 0.0), (0.2, 0.2, 0.03), color, taper=0.012)
    b.rod((-0.18, 0.14, 0.02), (-0.38, -0.04, 0.02), 0.06, color)
    b.rod((0.18, 0.14, 0.02), (0.3, -0.1, 0.02), 0.06, shade(color, 0.9))


def _scarf(rng: np.random.Generator, b: MeshBuilder) -> None:
    color, p = accent(rng), (-0.3, -0.05, 0.02)
    for k in range(6):
        q = (-0.3 + 0.12 * (k + 1), 0.09 * math.sin(1.7 * k) - 0.02, 0.02)
        b.rod(p, q, 0.055, color if k % 2 == 0 else shade(color, 0.75))
        p = q


def _guitar(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = vary(rng, (176, 108, 54), 0.2)
    b.ball((0.0, -0.25, 0.06), (0.18, 0.18, 0.05), color, sides=12)
    b.ball((0.0, -0.02, 0.06), (0.13, 0.14, 0.05), color, sides=12)
    b.rod((0.0, 0.05, 0.09), (0.0, 0.6, 0.09), 0.045, (70, 46, 34))
    b.box((-0.04, 0.58, 0.07), (0.04, 0.7, 0.1), (40, 30, 26))


def _suitcase(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = accent(rng)
    b.box((-0.21, -0.12, 0.03), (0.21, 0.12, 0.62), color, taper=0.01)
    for x in (-0.12, 0.0, 0.12):
        b.box((x - 0.01, 0.1, 0.08), (x + 0.01, 0.125, 0.58), shade(color, 0.75))
    b.box((-0.08, -0.02, 0.62), (0.08, 0.02, 0.66), _DARK)
    for x in (-0.17, 0.12):
        for y in (-0.1, 0.06):
            b.box((x, y, 0.0), (x + 0.05, y + 0.04, 0.03), _DARK)


def _basket(rng: np.random.Generator, b: MeshBuilder) -> None:
    b.frustum(
        (0.0, 0.0),
        (0.0, 0.28),
        (0.15, 0.19),
        vary(rng, (190, 156, 108), 0.15),
        sides=12,
        top_color=accent(rng),
    )


def _bin(rng: np.random.Generator, b: MeshBuilder) -> None:
    color = pick(rng, ((166, 168, 172), (52, 54, 58), (220, 218, 212)))
    b.frustum((0.0, 0.0), (0.0, 0.36), (0.11, 0.14), color, sides=12, top_color=(34, 34, 36))


_OBJECTS: dict[str, Maker] = {
    "mug": _mug, "book": _book, "laptop": _laptop, "remote control": _remote, "keys": _keys,
    "backpack": _backpack, "handbag": _handbag, "toy car": _toy_car, "teddy bear": _teddy,
    "toy elephant": _toy_elephant, "bottle": _bottle, "vase": _vase, "umbrella": _umbrella,
    "phone": _phone, "tablet": _tablet, "glasses case": _glasses_case, "headphones": _headphones,
    "bowl": _bowl, "apple": _apple, "plate": _plate, "pan": _pan, "pot": _pot,
    "alarm clock": _clock, "soap dispenser": _soap, "toothbrush cup": _cup, "toilet paper": _paper,
    "screwdriver": _screwdriver, "tissue box": _tissues, "ball": _ball, "guitar": _guitar,
    "suitcase": _suitcase, "basket": _basket, "trash can": _bin,
}  # fmt: skip
_CLOTHES: dict[str, Maker] = {
    "hat": _hat, "shoes": _shoes, "folded clothes": _folded_clothes, "shirt": _shirt,
    "scarf": _scarf,
}  # fmt: skip

SMALL_THINGS: tuple[str, ...] = (*_OBJECTS, *_CLOTHES)
"""Labels that `small_thing` can make."""


def small_thing(rng: np.random.Generator, label: str) -> Model:
    """Make a small object around the origin, standing on z = 0.

    Args:
        rng: Random colours and proportions.
        label: One of `SMALL_THINGS`.

    Raises:
        ValueError: The label is not one of them.
    """
    maker = _OBJECTS.get(label) or _CLOTHES.get(label)
    if maker is None:
        raise ValueError(
            f"no small object is called {label!r}; there are {', '.join(SMALL_THINGS)}"
        )
    b = MeshBuilder()
    maker(rng, b)
    return make_model("objects" if label in _OBJECTS else "clothes", label, b)
