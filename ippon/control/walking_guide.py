"""Directions for a person who carries the camera: turn, walk, look up or down, hold still."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from ippon.command import Command
from ippon.geometry import Float64Array, wrap_angle, yaw_of

ARRIVED_M: Final = 0.3
"""Distance to the goal at which the person stands there; one who stands there leaves it at
`LEFT_M`."""
LEFT_M: Final = 0.5
FACES_RAD: Final = math.radians(12.0)
"""Bearing within which a person faces the way; one who faces it turns again beyond
`ASTRAY_RAD`."""
ASTRAY_RAD: Final = math.radians(35.0)
STRAIGHT_M: Final = 0.25
"""Distance of a path from a straight line within which it is walked as one."""
BESIDE_M: Final = 0.5
"""Distance of a path's end from the goal above which the path leads elsewhere."""


class WalkingStep(StrEnum):
    """What to do first; the values are the words of messages."""

    TURN = "turn"
    WALK = "walk"
    LOOK = "look"
    HOLD = "hold"


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkingDirections:
    """Where to go and look next, as seen by who carries the camera."""

    step: WalkingStep
    turn_rad: float
    """To the next corner of the way, at its end to the wanted heading; positive is left."""
    walk_m: float
    """To that corner; 0 at the end of the way."""
    way_m: float
    """Length of the whole way."""
    look_up_rad: float
    """Change of the camera's tilt; positive is up, 0 where it is right."""


class WalkingGuide:
    """Turns goals into directions, with some hysteresis, so that they do not flicker.

    Args:
        tilt_tolerance_rad: Error of the camera's tilt that is right.
    """

    def __init__(self, tilt_tolerance_rad: float) -> None:
        self._tilt_tolerance = tilt_tolerance_rad
        self._there = self._faces = False

    def step(
        self,
        command: Command,
        path_world: Float64Array,
        T_world_base: Float64Array,
        tilt_rad: float,
    ) -> WalkingDirections | None:
        """Return the directions of a step.

        Args:
            command: Its goal and its tilt; without a goal, the camera's tilt alone.
            path_world: (K, 3) way to the goal, metres; one that leads elsewhere is ignored.
            T_world_base: Pose of the person.
            tilt_rad: Tilt of the camera.

        Returns:
            None where there is nothing to do.
        """
        up = wrap_angle(command.tilt_rad - tilt_rad)
        up = up if abs(up) > self._tilt_tolerance else 0.0
        goal = command.goal
        if goal is None:
            self._there = self._faces = False
            return self._still(WalkingStep.LOOK, up) if up else None
        here, end = T_world_base[:2, 3], np.array([goal.x_m, goal.y_m])
        way = _way(here, end, path_world)
        way_m = float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
        self._there = way_m <= (LEFT_M if self._there else ARRIVED_M)
        if self._there:
            turn = wrap_angle(goal.yaw_rad - yaw_of(T_world_base))
            if not self._facing(turn):
                return self._still(WalkingStep.TURN, up, turn)
            return self._still(WalkingStep.LOOK if up else WalkingStep.HOLD, up)
        corner = _corner(way) - here
        turn = wrap_angle(math.atan2(corner[1], corner[0]) - yaw_of(T_world_base))
        return WalkingDirections(
            step=WalkingStep.WALK if self._facing(turn) else WalkingStep.TURN,
            turn_rad=turn,
            walk_m=float(np.linalg.norm(corner)),
            way_m=way_m,
            look_up_rad=up,
        )

    def _facing(self, turn_rad: float) -> bool:
        self._faces = abs(turn_rad) <= (ASTRAY_RAD if self._faces else FACES_RAD)
        return self._faces

    @staticmethod
    def _still(step: WalkingStep, up_rad: float, turn_rad: float = 0.0) -> WalkingDirections:
        return WalkingDirections(
            step=step, turn_rad=turn_rad, walk_m=0.0, way_m=0.0, look_up_rad=up_rad
        )


def _way(here: Float64Array, end: Float64Array, path_world: Float64Array) -> Float64Array:
    """Return (K, 2) the way to the goal: the path, or straight where that leads elsewhere."""
    if len(path_world) < 2 or np.linalg.norm(path_world[-1, :2] - end) > BESIDE_M:
        return np.stack([here, end])
    return np.concatenate([here[None], path_world[1:, :2]])


def _corner(way: Float64Array) -> Float64Array:
    """Return the farthest point of a way up to which it is about straight."""
    for k in range(len(way) - 1, 1, -1):
        chord = way[k] - way[0]
        length = float(np.linalg.norm(chord))
        if length < STRAIGHT_M:
            continue
        between = way[1:k] - way[0]
        beside = np.abs(between[:, 0] * chord[1] - between[:, 1] * chord[0]) / length
        if beside.max() <= STRAIGHT_M and (between @ chord >= 0.0).all():
            return way[k]
    return way[1]
