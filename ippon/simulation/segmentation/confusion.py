"""Confusion of labels by a simulated open-vocabulary segmentation."""

from collections.abc import Sequence

import numpy as np

from ippon.geometry import Float64Array

_LOOK_ALIKES: tuple[tuple[float, tuple[str, ...]], ...] = (
    (1.0, ("table", "counter", "chest_of_drawers")),
    (1.0, ("chair", "stool", "seating")),
    (0.6, ("sofa", "seating", "chair")),
    (0.7, ("bed", "sofa")),
    (1.0, ("cabinet", "chest_of_drawers", "shelving", "furniture")),
    (0.5, ("cabinet", "counter", "appliances")),
    (0.5, ("cabinet", "door")),
    (0.6, ("table", "furniture")),
    (0.5, ("table", "stool")),
    (0.8, ("picture", "tv", "mirror", "window", "board_panel")),
    (0.8, ("shower", "bathtub")),
    (0.5, ("sink", "bathtub", "toilet")),
    (0.4, ("sink", "counter")),
    (0.8, ("curtain", "blinds")),
    (0.5, ("curtain", "towel", "clothes")),
    (0.4, ("curtain", "shower")),
    (0.5, ("window", "blinds", "curtain", "door")),
    (0.5, ("plant", "objects")),
    (0.3, ("plant", "curtain")),
    (0.7, ("cushion", "bed", "sofa")),
    (0.5, ("cushion", "objects", "towel")),
    (0.8, ("objects", "others")),
    (0.5, ("clothes", "objects", "towel")),
    (0.5, ("appliances", "objects")),
    (0.5, ("lighting", "objects")),
    (0.6, ("wall", "column")),
    (0.5, ("wall", "door", "cabinet")),
    (0.3, ("wall", "ceiling")),
    (0.3, ("wall", "others", "board_panel")),
    (0.5, ("ceiling", "beam")),
    (0.3, ("ceiling", "lighting")),
    (0.4, ("beam", "column")),
    (0.6, ("stairs", "railing")),
    (0.4, ("floor", "stairs")),
    (0.5, ("floor", "others")),
    (0.4, ("fireplace", "wall", "furniture")),
    (0.6, ("gym_equipment", "furniture", "objects")),
    (0.4, ("railing", "shelving")),
)
"""Strength of the confusion within each group of labels, relative to the strongest."""

_VAGUE: tuple[str, ...] = ("objects", "others", "furniture")
_ANY = 0.01
_ANY_VAGUE = 0.06
_OOI_SAME_CATEGORY = 0.35
_OOI_VAGUE = 0.2


def is_vague(category: str) -> bool:
    """Tell whether a category is a catch-all class, recognised with low confidence."""
    return category in _VAGUE


def affinity(category: str, labels: Sequence[str]) -> Float64Array:
    """Return (N,) how strongly an object of a category is confused with each other label."""
    weights = np.array([_ANY_VAGUE if is_vague(label) else _ANY for label in labels])
    for strength, group in _LOOK_ALIKES:
        if category in group:
            weights += strength * np.array([label in group for label in labels])
    return weights * np.array([label != category for label in labels])


def ooi_affinity(category: str, ooi_categories: frozenset[str]) -> float:
    """Return how strongly objects of a category are confused with the object of interest.

    Args:
        category: Category of the confused object.
        ooi_categories: Categories of the instances of the object of interest.
    """
    if is_vague(category):
        return _OOI_VAGUE
    return _OOI_SAME_CATEGORY if category in ooi_categories else _ANY
