"""Places on surfaces of a home where a detector makes false detections."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.simulation.scene import Scene
from ippon.simulation.segmentation.truth import STUFF
from ippon.simulation.segmentation.view_noise import UInt64Array, hashed

_UNKNOWN_SIZE_M: Final = 0.38
"""Size of objects that the home lacks: false boxes are then 0.23 m, the measured median."""
_LEAST_SIZE_M: Final = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class FalsePlaceConfig:
    """Density and size of false detections."""

    per_m2: float = 5.0
    """Places per square metre of the surface of objects, for each label; larger makes more false
    detections."""
    per_m2_of_stuff: float = 0.5
    """The same on walls, floors and ceilings."""
    count_sigma: float = 0.6
    """Differences between labels in the logarithm of both densities; larger makes labels more
    unequal."""
    size_share: float = 0.6
    """Size of a false box as a share of that of the label's objects; larger boxes cover more."""
    size_sigma: float = 0.45
    """Spread of that size, in the logarithm."""

    def __post_init__(self) -> None:
        """Reject values out of range."""
        values = (self.per_m2, self.per_m2_of_stuff, self.count_sigma, self.size_sigma)
        if not all(0.0 <= x <= 100.0 for x in values) or not 0.0 < self.size_share <= 10.0:
            raise ValueError(
                "densities and sigmas lie in 0 to 100, size_share in 0 to 10 and above 0; got "
                f"{values}, {self.size_share}"
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FalsePlaces:
    """Places of all labels, one row each."""

    points: Float64Array
    """(P, 3) metres, on a surface."""
    instance: NDArray[np.int64]
    """(P,) instance of the surface."""
    label: NDArray[np.int64]
    """(P,) false label, as a row of the labels."""
    size_m: Float64Array
    """(P,) side of the box, metres."""
    keys: UInt64Array
    """(P,) unique numbers, keys of the noise."""


def draw_false_places(
    scene: Scene,
    labels: Sequence[str],
    is_label: NDArray[np.bool_],
    config: FalsePlaceConfig,
    seed: int,
) -> FalsePlaces:
    """Draw the places of each label, independently of the other labels.

    Args:
        scene: The home.
        labels: Labels that are searched for.
        is_label: (I, L) whether an instance has a label, so that the label is not false there.
        config: Density and size.
        seed: Seed of the places.
    """
    corners = scene.vertices[scene.faces].astype(np.float64)
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * np.linalg.norm(np.cross(first, second), axis=1)
    is_stuff = np.array([i.category in STUFF for i in scene.instances], np.bool_)
    density = np.where(is_stuff[scene.face_instance], config.per_m2_of_stuff, config.per_m2)
    total = np.cumsum(area * density)
    sizes = _sizes(scene)
    # Without labels there are no places.
    points = [np.zeros((0, 3))]
    instances = [np.zeros(0, np.int64)]
    label_rows = [np.zeros(0, np.int64)]
    size_m = [np.zeros(0)]
    keys = [np.zeros(0, np.uint64)]
    for k, label in enumerate(labels):
        name = crc32(label.encode())
        rng = np.random.Generator(np.random.PCG64([seed, 0xFA15E, name]))
        expected = float(total[-1]) if len(total) else 0.0
        count = rng.poisson(expected * np.exp(config.count_sigma * rng.standard_normal()))
        face = np.searchsorted(total, rng.random(count) * expected, side="right")
        a, b = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
        at = corners[face, 0] + a * (1.0 - b) * first[face] + a * b * second[face]
        own = sizes[is_label[:, k]]
        size = float(np.exp(np.log(own).mean())) if len(own) else _UNKNOWN_SIZE_M
        spread = np.exp(config.size_sigma * rng.standard_normal(count))
        instance = scene.face_instance[face].astype(np.int64)
        wrong = np.flatnonzero(~is_label[instance, k])
        points.append(at[wrong])
        instances.append(instance[wrong])
        label_rows.append(np.full(len(wrong), k))
        size_m.append(config.size_share * size * spread[wrong])
        keys.append(hashed(wrong.astype(np.uint64), seed, 0xFA15E, name))
    return FalsePlaces(
        points=np.concatenate(points),
        instance=np.concatenate(instances),
        label=np.concatenate(label_rows),
        size_m=np.maximum(np.concatenate(size_m), _LEAST_SIZE_M),
        keys=np.concatenate(keys),
    )


def _sizes(scene: Scene) -> Float64Array:
    """Return (I,) the geometric mean of each instance's two longer sides, metres."""
    sides = np.array([np.subtract(i.aabb_max, i.aabb_min) for i in scene.instances]).reshape(-1, 3)
    longer = np.sort(np.maximum(sides, _LEAST_SIZE_M), axis=1)[:, 1:]
    return np.sqrt(longer.prod(axis=1))
