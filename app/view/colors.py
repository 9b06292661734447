"""The palette, the colour modes of the map, and their legends, as data.

Every colour has one meaning in the scene, the tables, the page and the reports.
"""

from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from app.view.colormaps import CIVIDIS, INFERNO, ColorTable
from app.view.words import Words
from ippon.guidance.levels import Level
from ippon.planning.plan import NodeKind

Rgb = tuple[int, int, int]

# Okabe-Ito palette, distinguishable for colour-blind viewers.
VERMILION: Final[Rgb] = (0xD5, 0x5E, 0x00)
ORANGE: Final[Rgb] = (0xE6, 0x9F, 0x00)
GREY: Final[Rgb] = (0x9A, 0xA0, 0xA6)
BLUE: Final[Rgb] = (0x00, 0x72, 0xB2)
GREEN: Final[Rgb] = (0x00, 0x9E, 0x73)
SKY: Final[Rgb] = (0x56, 0xB4, 0xE9)
YELLOW: Final[Rgb] = (0xF0, 0xE4, 0x42)

PURPLE: Final[Rgb] = (0xCC, 0x79, 0xA7)

FOUND: Final = GREEN
CERTAIN_BRUSH: Final = VERMILION
"""Regions painted "look here", and marks in pictures."""
FAR_EVIDENCE: Final = PURPLE
NEVER_BRUSH: Final = BLUE
ROBOT: Final = SKY
"""The robot and its view."""
PATH: Final = YELLOW
QUIET: Final[Rgb] = (0x46, 0x4E, 0x5A)
"""A secondary button."""
UNMAPPED: Final[Rgb] = (0x46, 0x4B, 0x54)
"""A surface without a value in the colour mode."""

NOT_MAPPED: Final = 255
OOI_SCALE: Final = 254.0
"""`ooi` and `proximity` of a voxel are probabilities in units of 1/254; 255 means no value."""

LEVEL_COLORS: Final[dict[Level, Rgb]] = {
    Level.FAR: BLUE,
    Level.AVERAGE: GREY,
    Level.NEAR: ORANGE,
    Level.CERTAIN: VERMILION,
}

ColorMode = Literal["camera", "ooi", "proximity", "height", "thing", "gain"]
COLOR_MODES: Final[tuple[ColorMode, ...]] = get_args(ColorMode)


@dataclass(frozen=True, slots=True, kw_only=True)
class LegendEntry:
    """One swatch and its label."""

    color: Rgb
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Legend:
    """Legend of a colour mode: a ramp with end labels, swatches, or both."""

    title: str
    ramp: ColorTable | None = None
    low: str = ""
    high: str = ""
    entries: tuple[LegendEntry, ...] = ()


def hex_of(color: Rgb) -> str:
    """Return a colour as `#rrggbb`."""
    return "#{:02x}{:02x}{:02x}".format(*color)


def _ramp(*stops: Rgb) -> ColorTable:
    at = np.linspace(0.0, 255.0, len(stops))
    table = np.stack(
        [np.interp(np.arange(256), at, [s[c] for s in stops]) for c in range(3)], axis=1
    )
    return np.round(table).astype(np.uint8)


GAIN: Final = _ramp((0x2F, 0x6B, 0xFF), (0x9C, 0x5B, 0xE0), (0xE2, 0x4A, 0x8B), (0xFF, 0x2E, 0x2E))
"""Gains from blue (lowest) to red (highest), as in Fig. 2 of the paper."""

TERMINATING: Final[Rgb] = (0xFF, 0xFF, 0xFF)
MINIMAL: Final[Rgb] = (0x08, 0x08, 0x0A)

_LEVEL_TABLE: Final = np.full((256, 3), UNMAPPED, dtype=np.uint8)
for _level, _color in LEVEL_COLORS.items():
    _LEVEL_TABLE[_level] = _color

# 0..254 over the ramp without its darkest part, which is invisible in a dark scene.
_OOI_TABLE: Final = INFERNO[np.linspace(36.0, 255.0, 256).round().astype(int)]
_OOI_TABLE[NOT_MAPPED] = UNMAPPED


_GAIN_TABLE: Final = GAIN.copy()
_GAIN_TABLE[NOT_MAPPED] = UNMAPPED

_STEPS: Final = np.arange(256) / 255.0
_LINEAR: Final = np.round(
    np.where(_STEPS <= 0.04045, _STEPS / 12.92, ((_STEPS + 0.055) / 1.055) ** 2.4) * 255.0
).astype(np.uint8)


def linear(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Undo the sRGB curve: glTF, and viser for lines and instances, take linear light."""
    return _LINEAR[colors]


def voxel_colors(
    mode: ColorMode,
    *,
    rgb: NDArray[np.uint8],
    ooi: NDArray[np.uint8],
    level: NDArray[np.uint8],
    height_m: NDArray[np.float32],
    top_m: float,
    thing: NDArray[np.uint8],
    gain: NDArray[np.uint8],
    kind: NDArray[np.uint8] | None = None,
) -> NDArray[np.uint8]:
    """Colour surface voxels.

    Args:
        mode: Colour mode.
        rgb: (N, 3) camera colours.
        ooi: (N,) p(v in O) in units of 1/254, 255 for none.
        level: (N,) `Level`, 255 for none.
        height_m: (N,) height of the voxel above the floor.
        top_m: Height at the end of the height ramp.
        thing: (N,) probability of the chosen common object in units of 1/254, 255 for none.
        kind: (N, 3) colour of the most probable label; None to show `thing`.
        gain: (N,) gain of the viewpoint there over the highest, in units of 1/254, 255 for none.

    Returns:
        (N, 3) uint8 RGB.
    """
    match mode:
        case "camera":
            return rgb
        case "ooi":
            return _OOI_TABLE[ooi]
        case "proximity":
            return _LEVEL_TABLE[level]
        case "height":
            step = np.clip(height_m * (255.0 / max(top_m, 0.1)), 0.0, 255.0)
            return CIVIDIS[step.astype(np.uint8)]
        case "thing":
            return _OOI_TABLE[thing] if kind is None else kind
        case "gain":
            return _GAIN_TABLE[gain]


def ooi_colors(ooi: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Colour probabilities in units of 1/254 by inferno: (N,) to (N, 3)."""
    return _OOI_TABLE[ooi]


def node_colors(kinds: NDArray[np.uint8], gains: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Colour viewpoints as the paper does (Fig. 2).

    Args:
        kinds: (N,) `NodeKind`.
        gains: (N,) G(n).

    Returns:
        (N, 3) uint8: white terminating, black barely exploring, else blue (lowest) to red.
    """
    exploring = kinds == NodeKind.EXPLORING
    colors = np.empty((len(kinds), 3), dtype=np.uint8)
    if exploring.any():
        shown = gains[exploring]
        low, high = float(shown.min()), float(shown.max())
        step = (shown - low) * (255.0 / max(high - low, 1e-6))
        colors[exploring] = GAIN[np.clip(step, 0.0, 255.0).astype(np.uint8)]
    colors[kinds == NodeKind.TERMINATING] = TERMINATING
    colors[kinds == NodeKind.MINIMAL] = MINIMAL
    return colors


def legend(
    mode: ColorMode, top_m: float, say: Words, kinds: tuple[LegendEntry, ...] | None = None
) -> Legend:
    """Return the legend of a mode.

    Args:
        mode: Colour mode.
        top_m: End of the height ramp.
        say: The words of the legend.
        kinds: Colours of the labels, where all kinds of things are shown; None for one kind.
    """
    title = say(f"panel.legend.{mode}")
    unmapped = LegendEntry(color=UNMAPPED, text=say("panel.legend.unknown"))
    match mode:
        case "camera":
            return Legend(title=title)
        case "ooi":
            return _ramp_legend(title, unmapped)
        case "proximity":
            levels = tuple(
                LegendEntry(color=LEVEL_COLORS[level], text=say(f"panel.level.{level.text}"))
                for level in sorted(Level, reverse=True)
            )
            return Legend(title=title, entries=(*levels, unmapped))
        case "thing" if kinds is not None:
            return Legend(title=say("panel.legend.kinds"), entries=kinds)
        case "thing":
            otherwise = say("panel.legend.otherwise")
            return _ramp_legend(title, LegendEntry(color=UNMAPPED, text=otherwise))
        case "gain":
            nothing = LegendEntry(color=UNMAPPED, text=say("panel.legend.no_viewpoint"))
            low, high = say("panel.legend.low"), say("panel.legend.high")
            return Legend(title=title, ramp=GAIN, low=low, high=high, entries=(nothing,))
        case "height":
            low, high = (say("panel.legend.metres", n=n) for n in ("0", say.number(top_m, 1)))
            return Legend(title=title, ramp=CIVIDIS, low=low, high=high)


def _ramp_legend(title: str, rest: LegendEntry) -> Legend:
    return Legend(title=title, ramp=_OOI_TABLE[:NOT_MAPPED], low="0", high="1", entries=(rest,))


def tree_legend(say: Words) -> Legend:
    """Return the legend of the viewpoints."""
    return Legend(
        title=say("panel.legend.tree"),
        ramp=GAIN,
        low=say("panel.legend.low"),
        high=say("panel.legend.high"),
        entries=(
            LegendEntry(color=TERMINATING, text=say("panel.legend.ends")),
            LegendEntry(color=MINIMAL, text=say("panel.legend.little")),
        ),
    )
