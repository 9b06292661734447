"""Colours that the furniture of a home shares."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ippon.simulation.homes.furniture.mesh_builder import Color

T = TypeVar("T")

_WOODS: tuple[Color, ...] = (
    (196, 160, 112), (160, 112, 68), (112, 74, 46), (216, 190, 150), (84, 58, 42), (178, 136, 92),
    (232, 228, 220), (66, 60, 58),
)  # fmt: skip
_FABRICS: tuple[Color, ...] = (
    (120, 130, 140), (88, 100, 118), (168, 158, 144), (140, 84, 66), (72, 98, 90), (196, 182, 160),
    (98, 72, 92), (60, 76, 110), (188, 122, 72), (150, 150, 150), (110, 128, 84), (70, 66, 66),
)  # fmt: skip
_ACCENTS: tuple[Color, ...] = (
    (206, 84, 60), (226, 168, 62), (62, 124, 148), (92, 148, 104), (176, 82, 122), (44, 72, 120),
    (228, 206, 170), (200, 120, 90), (120, 90, 160), (240, 236, 226),
)  # fmt: skip
_METALS: tuple[Color, ...] = ((168, 170, 174), (92, 94, 98), (46, 46, 50), (190, 160, 104))
_WALLS: tuple[Color, ...] = (
    (236, 232, 224), (226, 224, 220), (240, 236, 226), (214, 220, 222), (222, 214, 200),
    (206, 214, 202), (230, 218, 210), (198, 206, 214), (244, 240, 236), (224, 208, 176),
)  # fmt: skip
_WOOD_FLOORS: tuple[Color, ...] = (
    (176, 136, 92), (150, 108, 70), (198, 164, 122), (122, 88, 60), (208, 184, 150),
    (164, 146, 124),
)  # fmt: skip
_TILE_FLOORS: tuple[Color, ...] = (
    (206, 204, 198), (178, 176, 172), (222, 214, 200), (150, 154, 158), (190, 168, 148),
)  # fmt: skip


def pick(rng: np.random.Generator, options: tuple[T, ...]) -> T:
    """Return one of `options`, with equal probability."""
    return options[int(rng.integers(len(options)))]


def uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Return a uniform random number between two bounds."""
    return float(rng.uniform(low, high))


def chance(rng: np.random.Generator, probability: float) -> bool:
    """Return True with this probability."""
    return bool(rng.random() < probability)


def shade(color: Color, factor: float) -> Color:
    """Return a darker (factor below 1) or lighter colour."""
    r, g, b = (max(0, min(255, round(c * factor))) for c in color)
    return r, g, b


def vary(rng: np.random.Generator, color: Color, amount: float = 0.12) -> Color:
    """Return a colour with random changes of brightness and of each channel."""
    factor = 1.0 + amount * float(rng.uniform(-1.0, 1.0))
    shift = rng.uniform(-0.25 * amount, 0.25 * amount, 3) * 255.0
    r, g, b = (
        max(0, min(255, round(c * factor + d))) for c, d in zip(color, shift.tolist(), strict=True)
    )
    return r, g, b


@dataclass(frozen=True, slots=True, kw_only=True)
class Style:
    """Colours that a home's furniture shares."""

    wood: Color
    second_wood: Color
    fabric: Color
    second_fabric: Color
    accent: Color
    metal: Color
    front: Color
    """Fronts of kitchen and wardrobes."""
    worktop: Color
    wall: Color
    wood_floor: Color
    tile_floor: Color


def make_style(rng: np.random.Generator) -> Style:
    """Draw the colours of one home."""
    wood = vary(rng, pick(rng, _WOODS))
    front = pick(rng, ((240, 240, 236), (228, 224, 214), (96, 106, 110), (70, 92, 88), wood))
    return Style(
        wood=wood,
        second_wood=vary(rng, pick(rng, _WOODS)),
        fabric=vary(rng, pick(rng, _FABRICS)),
        second_fabric=vary(rng, pick(rng, _FABRICS)),
        accent=vary(rng, pick(rng, _ACCENTS)),
        metal=pick(rng, _METALS),
        front=vary(rng, front, 0.05),
        worktop=vary(
            rng, pick(rng, ((70, 70, 72), (206, 200, 190), (150, 110, 72), (120, 118, 114)))
        ),
        wall=vary(rng, pick(rng, _WALLS), 0.04),
        wood_floor=vary(rng, pick(rng, _WOOD_FLOORS), 0.08),
        tile_floor=vary(rng, pick(rng, _TILE_FLOORS), 0.06),
    )


def accent(rng: np.random.Generator) -> Color:
    """Draw a contrasting colour for a small object."""
    return vary(rng, pick(rng, _ACCENTS), 0.15)


def fabric(rng: np.random.Generator, style: Style) -> Color:
    """Draw a fabric colour that matches the home."""
    return vary(rng, pick(rng, (style.fabric, style.second_fabric, style.accent)), 0.1)


def wood(rng: np.random.Generator, style: Style) -> Color:
    """Draw a wood colour that matches the home."""
    return vary(rng, style.wood if chance(rng, 0.7) else style.second_wood, 0.08)


def wall_color(rng: np.random.Generator, style: Style) -> Color:
    """Draw the wall colour of one room: usually that of the home."""
    if chance(rng, 0.6):
        return vary(rng, style.wall, 0.02)
    return vary(rng, pick(rng, _WALLS), 0.05)
