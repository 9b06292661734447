"""The pose of the base in the world, by the last transforms that a recording holds."""

from collections.abc import Iterable
from dataclasses import replace
from functools import reduce
from operator import matmul
from typing import Final

from app.messages.keys import BASE_FRAME, WORLD_FRAME
from app.messages.motion import StampedTransform
from ippon.geometry import Float64Array

_FIXED_NS: Final = -1
"""Instead of the stamp of a fixed transform, which is not a time of the robot."""


class BasePose:
    """Follows the transforms between world and base.

    Args:
        world: Frame of the world.
        base: Frame of the base.
    """

    def __init__(self, world: str = WORLD_FRAME, base: str = BASE_FRAME) -> None:
        self._world = world
        self._base = base
        self._links: dict[str, StampedTransform] = {}
        self.T_map_world: Float64Array | None = None
        """(4, 4) from that world to the map, where an alignment says it."""
        self._chain: list[StampedTransform] = []
        """Transforms from the world to the base; empty while one is missing."""

    def take(self, transforms: Iterable[StampedTransform], *, fixed: bool) -> None:
        """Take transforms of one message; `fixed` ones have no time."""
        for one in transforms:
            self._links[one.child] = replace(one, stamp_ns=_FIXED_NS) if fixed else one
        self._chain = self._follow()

    def pose(self) -> Float64Array | None:
        """Return T_world_base (4, 4), None while a transform is missing.

        With an alignment the world is the map.
        """
        transforms = [link.T_parent_child for link in self._chain]
        if not transforms:
            return None
        T_world_base = reduce(matmul, transforms)
        return T_world_base if self.T_map_world is None else self.T_map_world @ T_world_base

    def stamp_ns(self) -> int | None:
        """Return the time of the pose, None while a transform or its time is missing.

        It is that of the moving transform next to the base: localisation stamps its own, from the
        world to the odometry, ahead of time.
        """
        stamps = (link.stamp_ns for link in reversed(self._chain))
        return next((stamp for stamp in stamps if stamp != _FIXED_NS), None)

    def _follow(self) -> list[StampedTransform]:
        chain: list[StampedTransform] = []
        frame = self._base
        while frame != self._world:
            link = self._links.get(frame)
            if link is None or len(chain) == len(self._links):
                return []
            chain.append(link)
            frame = link.parent
        return chain[::-1]
