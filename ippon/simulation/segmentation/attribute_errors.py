"""Errors of an attribute: an object appears in another colour, by object and by view."""

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from ippon.geometry import Float64Array
from ippon.simulation.camera.renderer import Rendering
from ippon.simulation.homes.config import MUG_COLORS
from ippon.simulation.scene import Scene
from ippon.simulation.segmentation.truth import NamePredicate, true_label
from ippon.simulation.segmentation.view_noise import hashed, normals, view_noise

_THING, _VIEW, _COLOUR = range(101, 104)
_LUMINANCE: Final = np.array([0.2126, 0.7152, 0.0722])
_SHADES: Final = (0.3, 1.3)
"""Range of the brightness of a pixel over the mean of its object."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AttributeErrorConfig:
    """How often an object of interest appears in another colour."""

    rate: float = 0.0
    """Share of objects and views; larger makes more finds of the wrong one, and of the right one
    that are passed by."""
    thing_share: float = 0.5
    """Share of the variance that is constant over the views of an object; larger makes errors
    persist, less makes them differ between views."""

    def __post_init__(self) -> None:
        """Reject values out of range."""
        if not 0.0 <= self.rate <= 0.5 or not 0.0 <= self.thing_share <= 1.0:
            raise ValueError(
                "the rate lies in 0 to 0.5 and thing_share in 0 to 1; got "
                f"{self.rate}, {self.thing_share}"
            )


class AttributeErrors:
    """Recolours objects of interest in some views.

    Each object has a constant draw and one that depends on the view, correlated between similar
    views; where their weighted sum exceeds a threshold, the object appears in another colour, in
    all views the same. An image depends only on the seed and the pose.
    """

    def __init__(
        self,
        scene: Scene,
        wanted: Sequence[str],
        config: AttributeErrorConfig,
        seed: int = 0,
        is_instance_of: NamePredicate = operator.eq,
    ) -> None:
        """Draw the persistent errors.

        Args:
            scene: The home.
            wanted: Canonical labels of the objects of interest.
            config: How often.
            seed: Seed of the errors.
            is_instance_of: See `true_label`.
        """
        is_wanted = [
            true_label(i, (), None, is_instance_of, wanted) is not None for i in scene.instances
        ]
        self._instances = np.flatnonzero(is_wanted)
        keys = self._instances.astype(np.uint64)
        self._keys = hashed(keys, seed, _VIEW)
        self._constant = np.sqrt(config.thing_share) * normals(hashed(keys, seed, _THING))
        self._varying = np.sqrt(1.0 - config.thing_share)
        self._limit = float(ndtri(1.0 - config.rate)) if config.rate > 0.0 else np.inf
        self._order = hashed(keys, seed, _COLOUR)
        boxes = [scene.instances[k] for k in self._instances.tolist()]
        self._centres = np.array(
            [np.add(i.aabb_min, i.aabb_max) * 0.5 for i in boxes], np.float64
        ).reshape(-1, 3)

    def is_wrong(self, camera_world: Float64Array) -> NDArray[np.bool_]:
        """Return (K,) which of `instances` appear in another colour from a position (3,)."""
        varying = self._varying * view_noise(self._keys, camera_world - self._centres)
        return self._constant + varying > self._limit

    @property
    def instances(self) -> NDArray[np.int64]:
        """(K,) rows of `Scene.instances` of the objects of interest."""
        return self._instances

    def apply(self, rendering: Rendering, camera_world: Float64Array) -> NDArray[np.uint8]:
        """Return the colour image with the errors of a view.

        Args:
            rendering: Noise-free images.
            camera_world: (3,) metres.
        """
        color = rendering.color
        wrong = np.flatnonzero(self.is_wrong(camera_world))
        seen = [k for k in wrong.tolist() if (rendering.instance == self._instances[k]).any()]
        if not seen:
            return color
        color = color.copy()
        for k in seen:
            shown = rendering.instance == self._instances[k]
            color[shown] = _recoloured(color[shown], int(self._order[k]))
        return color


def _recoloured(pixels: NDArray[np.uint8], order: int) -> NDArray[np.uint8]:
    """Return the (N, 3) pixels of an object in another of the colours, with their shades."""
    mean = pixels.mean(axis=0)
    palette = np.array(list(MUG_COLORS.values()), np.float64)
    nearest = int(np.linalg.norm(palette - mean, axis=1).argmin())
    others = np.delete(palette, nearest, axis=0)
    shade = (pixels @ _LUMINANCE) / max(float(mean @ _LUMINANCE), 1.0)
    shaded = np.clip(shade, *_SHADES)[:, None] * others[order % len(others)]
    return np.clip(shaded, 0.0, 255.0).astype(np.uint8)
