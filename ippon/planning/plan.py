"""What the planner hands to the mission: where to go, how, and why."""

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.guidance.levels import Level


class NodeKind(IntEnum):
    """How a viewpoint is drawn and chosen (Fig. 2 of the paper)."""

    EXPLORING = 0
    MINIMAL = 1
    """Explores little; faces the direction of travel; black."""
    TERMINATING = 2
    """Sees enough of the object from close by to end the search here; white."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Viewpoint:
    """A place to stand and a direction to look, with what it promises."""

    position_world: tuple[float, float, float]
    """The base on the floor, metres."""
    yaw_rad: float
    tilt_rad: float
    gain: float
    """G(n), eq. (3): expected voxels of the object that it shows."""
    termination: float
    """T(n), eq. (4): object voxels in sight within reach, and what lies just behind."""
    level: Level
    """Level that p_img(n) was taken from."""
    kind: NodeKind
    path_gain: float
    """G(P_n), gain summed over the path from the robot."""
    path_cost_s: float
    """C(P_n), travel time from the robot, turning included."""
    far_evidence_nat: float = 0.0
    """Nat, log-likelihood ratio of the object in this view, from `FarEvidence`."""
    cued: bool = False
    """The level comes from far evidence of a common object that the goal is certainly near."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TreeView:
    """The whole tree as arrays, one row a node, row 0 the root."""

    positions_world: NDArray[np.float32]
    """(N, 3) metres, base on the floor."""
    parents: NDArray[np.int32]
    """(N,) row of the parent, -1 for the root."""
    yaws_rad: NDArray[np.float32]
    tilts_rad: NDArray[np.float32]
    gains: NDArray[np.float32]
    terminations: NDArray[np.float32]
    path_costs_s: NDArray[np.float32]
    levels: NDArray[np.uint8]
    kinds: NDArray[np.uint8]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The best plan so far."""

    target: Viewpoint | None
    """None when nothing worth going to is known yet, or any more."""
    path_world: Float64Array
    """(K, 3) metres from the robot to the target, K = 0 without a target."""
    tree: TreeView
    exhausted: bool
    """Everything reachable was seen: no viewpoint promises anything."""
    evaluated: int
    """Viewpoints evaluated for this plan."""
    closer_look: bool = False
    """The target is where something that may be the object is seen better."""
    out_of_reach_m: float | None = None
    """The target is where the search ends with an object that no way leads close to: metres over
    the floor from there to it. None otherwise."""
    unseen_straight_m: float = 0.0
    """How much of the straight way to the target leads over floor that was never seen; 0 where the
    path is straight or an obstacle is known to be in the way."""
    floor_gap: tuple[float, float] | None = None
    """World x and y of unseen floor nearby that is all that keeps the robot from a room."""
    full: bool = False
    """No viewpoint more is kept: what lies beyond those that there are stays unseen."""
    cut_short: bool = False
    """The seconds of the step were used up before its work was done: the next step goes on with it.
    A step that was cut short has not shown that nothing is left."""
    promised_per_s: float = math.inf
    """Gain a second of the way to explore that has most of it, infinite where none is weighed."""
