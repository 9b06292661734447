"""Regions of CIELAB that people call by the name of a colour.

The regions overlap, because light and camera shift colours: a white mug in the shade is as grey as
a grey one in the sun. The limits follow the basic colour terms of Berlin and Kay (1969); hue is the
angle of (a*, b*), chroma their length.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from skimage.color import rgb2lab

from ippon.geometry import Float64Array

_GREY_CHROMA: Final = 12.0
"""Chroma below which a pixel has no hue that people name."""
_DARK_L, _LIGHT_L = 45.0, 55.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ColourRegion:
    """Lightness, chroma and hue of one colour name."""

    lightness: tuple[float, float] = (0.0, 100.0)
    chroma: tuple[float, float] = (0.0, 200.0)
    hue_deg: tuple[float, float] = (0.0, 360.0)
    """From the first to the second, counter-clockwise."""

    def contains(self, lab: Float64Array) -> NDArray[np.bool_]:
        """Return which of (N, 3) CIELAB colours lie in the region."""
        light = lab[:, 0]
        chroma = np.hypot(lab[:, 1], lab[:, 2])
        turn = np.degrees(np.arctan2(lab[:, 2], lab[:, 1])) - self.hue_deg[0]
        span = self.hue_deg[1] - self.hue_deg[0]
        hue = np.ones(len(lab), np.bool_) if span >= 360.0 else turn % 360.0 <= span % 360.0
        return (
            (light >= self.lightness[0])
            & (light <= self.lightness[1])
            & (chroma >= self.chroma[0])
            & (chroma <= self.chroma[1])
            & hue
        )


_CHROMATIC: Final = (_GREY_CHROMA, 200.0)
_REGIONS: Final[dict[str, ColourRegion]] = {
    "black": ColourRegion(lightness=(0.0, 32.0), chroma=(0.0, 18.0)),
    "white": ColourRegion(lightness=(62.0, 100.0), chroma=(0.0, 17.0)),
    "grey": ColourRegion(lightness=(25.0, 82.0), chroma=(0.0, 14.0)),
    "red": ColourRegion(lightness=(12.0, 68.0), chroma=(22.0, 200.0), hue_deg=(355.0, 408.0)),
    "orange": ColourRegion(lightness=(38.0, 88.0), chroma=(32.0, 200.0), hue_deg=(40.0, 78.0)),
    "yellow": ColourRegion(lightness=(52.0, 100.0), chroma=(28.0, 200.0), hue_deg=(72.0, 112.0)),
    "green": ColourRegion(lightness=(12.0, 96.0), chroma=_CHROMATIC, hue_deg=(105.0, 192.0)),
    "turquoise": ColourRegion(lightness=(25.0, 95.0), chroma=_CHROMATIC, hue_deg=(172.0, 238.0)),
    "blue": ColourRegion(lightness=(5.0, 88.0), chroma=_CHROMATIC, hue_deg=(215.0, 310.0)),
    "purple": ColourRegion(lightness=(8.0, 75.0), chroma=_CHROMATIC, hue_deg=(292.0, 345.0)),
    "pink": ColourRegion(lightness=(45.0, 95.0), chroma=_CHROMATIC, hue_deg=(325.0, 390.0)),
    "brown": ColourRegion(lightness=(12.0, 58.0), chroma=(9.0, 55.0), hue_deg=(28.0, 88.0)),
    "beige": ColourRegion(lightness=(58.0, 96.0), chroma=(5.0, 36.0), hue_deg=(50.0, 108.0)),
}
_SYNONYMS: Final = {
    "gray": "grey", "silver": "grey", "charcoal": "black", "blackish": "black", "ivory": "white",
    "golden": "yellow", "gold": "yellow", "mustard": "yellow", "yellowish": "yellow",
    "reddish": "red", "crimson": "red", "scarlet": "red", "burgundy": "red", "maroon": "red",
    "greenish": "green", "olive": "green", "khaki": "green", "mint": "green", "lime": "green",
    "bluish": "blue", "navy": "blue", "indigo": "blue", "sky": "blue", "royal": "blue",
    "violet": "purple", "lilac": "purple", "lavender": "purple", "magenta": "pink", "rose": "pink",
    "cyan": "turquoise", "teal": "turquoise", "aqua": "turquoise", "brownish": "brown",
    "bronze": "brown", "copper": "orange", "cream": "beige", "tan": "beige", "greyish": "grey",
}  # fmt: skip
_DARKER: Final = frozenset({"dark", "deep", "navy"})
_LIGHTER: Final = frozenset({"light", "pale", "pastel", "baby", "bright", "neon", "sky"})


def region_of(name: str) -> ColourRegion | None:
    """Return the region of a colour in words, such as "dark blue"; None for an unknown one."""
    *shades, last = name.lower().replace("-", " ").split() or [""]
    region = _REGIONS.get(_SYNONYMS.get(last, last))
    if region is None:
        return None
    low, high = region.lightness
    if _DARKER.intersection([*shades, last]):
        high = min(high, max(_DARK_L, low + 10.0))
    if _LIGHTER.intersection(shades):
        low = max(low, min(_LIGHT_L, high - 10.0))
    return ColourRegion(lightness=(low, high), chroma=region.chroma, hue_deg=region.hue_deg)


def lab_of(rgb: NDArray[np.uint8]) -> Float64Array:
    """Return (N, 3) CIELAB colours (D65) of (N, 3) sRGB pixels."""
    return np.asarray(rgb2lab(rgb[None])[0], dtype=np.float64)


def colour_name(lab: Float64Array) -> str:
    """Return the colour that most of (N, 3) CIELAB pixels have; empty if none has a majority."""
    if not len(lab):
        return ""
    shares = {name: float(region.contains(lab).mean()) for name, region in _REGIONS.items()}
    best = max(shares, key=lambda name: shares[name])
    return best if shares[best] >= 0.5 else ""
