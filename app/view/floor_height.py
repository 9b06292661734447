"""Height of the floor that a robot stands on, and of the cut above it."""

from typing import Final

from ippon.frame import UNDERFOOT_M

_STILL_M: Final = 0.1
_STILL_NS: Final = 1_000_000_000
"""Extent and time of a motion up or down that ends on a floor: lifts and stairs move faster."""


class FloorHeight:
    """Height of the floor under a robot; it stays the same while the pose varies."""

    def __init__(self) -> None:
        self.z_m = 0.0
        """World frame, metres; 0, where most maps begin, until a pose is farther from it."""
        self._still: tuple[int, float] | None = None
        """Stamp and height from which on the pose has kept its height."""

    def stand_on(self, z_m: float, stamp_ns: int) -> bool:
        """Follow the base pose; return whether the floor is another one.

        On the way to another floor, as in a lift, the floor is that where the robot came from.

        Args:
            z_m: Height of the base, which is on the floor, world frame, metres.
            stamp_ns: Time of the pose, nanoseconds.
        """
        before, still = self.z_m, self._still
        if still is None and abs(z_m - self.z_m) > UNDERFOOT_M:
            self.z_m = z_m
        if still is None or abs(z_m - still[1]) > _STILL_M or stamp_ns < still[0]:
            self._still = (stamp_ns, z_m)
        elif stamp_ns - still[0] >= _STILL_NS and abs(z_m - self.z_m) > UNDERFOOT_M:
            self.z_m = z_m
        return self.z_m != before

    def restart(self) -> None:
        """Take the next pose as the first one: the time or the world is another."""
        self._still = None


def layer_below(ceiling_m: float, floor_z_m: float, voxel_size_m: float) -> int:
    """Return the voxel layer from which upwards the map is hidden.

    Args:
        ceiling_m: Height of the cut above the floor, metres.
        floor_z_m: Height of the floor, world frame, metres.
        voxel_size_m: Edge length of a voxel, metres.
    """
    return round((floor_z_m + ceiling_m) / voxel_size_m)
