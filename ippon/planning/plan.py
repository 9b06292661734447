"""The plan: target, path and tree of viewpoints, from the planner to the mission."""

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.guidance.levels import Level


class NodeKind(IntEnum):
    """How a viewpoint is selected and drawn (Fig. 2 of the paper)."""

    EXPLORING = 0
    MINIMAL = 1
    """Has little gain, and faces the direction of travel; black."""
    TERMINATING = 2
    """Shows enough of the object from nearby to end the search here; white."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Viewpoint:
    """A position and orientation of the robot, with gain and cost."""

    position_world: tuple[float, float, float]
    """The base on the floor, metres."""
    yaw_rad: float
    tilt_rad: float
    gain: float
    """G(n), eq. (3): number of object voxels that it is expected to show."""
    termination: float
    """T(n), eq. (4): visible object voxels within reach, and those just beyond."""
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
    """(N,) direction of the camera, from the x axis to the left."""
    tilts_rad: NDArray[np.float32]
    """(N,) tilt of the camera, negative is down."""
    gains: NDArray[np.float32]
    """(N,) expected number of object voxels that are seen from there: `Viewpoint.gain`."""
    terminations: NDArray[np.float32]
    """(N,) object voxels in view and within reach: `Viewpoint.termination`."""
    path_costs_s: NDArray[np.float32]
    """(N,) seconds from the robot, turning included."""
    levels: NDArray[np.uint8]
    """(N,) a `Level` each, that the gain was computed with."""
    kinds: NDArray[np.uint8]
    """(N,) a `NodeKind` each."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The best plan so far."""

    target: Viewpoint | None
    """None if no known viewpoint has enough gain."""
    path_world: Float64Array
    """(K, 3) metres from the robot to the target, K = 0 without a target."""
    tree: TreeView
    exhausted: bool
    """Everything reachable was seen: no viewpoint has enough gain."""
    evaluated: int
    """Number of viewpoints evaluated in this step."""
    closer_look: bool = False
    """The target is a viewpoint for a closer look at what may be the object."""
    out_of_reach_m: float | None = None
    """Set if the search ends at the target with an object out of reach: metres over the floor from
    there to it. None otherwise."""
    unseen_shortcut_m: float = 0.0
    """Length of the straight line to the target over unseen floor, metres; 0 if the path is
    straight, or if a known obstacle blocks the line."""
    floor_gap: tuple[float, float] | None = None
    """World x and y of nearby unseen floor that separates the robot from a room, metres."""
    free_turn_rad: tuple[float, float] = (math.pi, math.pi)
    """How far a long body can turn on the spot, to the right and to the left, before it would reach
    an obstacle, a drop or floor that was not seen."""
    floor_z_m: float | None = None
    """Height at which the planner has read the floor, world frame; None for that of the base."""
    full: bool = False
    """The roadmap is full: it takes no viewpoint beyond those that it has."""
    cut_short: bool = False
    """The time budget ended the step before its work was done; the next step continues with it.
    Such a plan is never exhausted."""
    max_gain_per_s: float = math.inf
    """Highest gain per second of any exploring path; infinite from planners without scores."""
    by_rule: bool | None = None
    """Whether the rule of a method of evaluation chose the target, whose gain is then the rule's
    worth; False if it had none within reach and this planner chose, None if no rule was asked."""
    rule_reason: str = ""
    """Why the rule chose it, in its own words."""

    def can_turn(self, turn_rad: float) -> bool:
        """Return whether the body can turn so far on the spot; positive is to the left."""
        right, left = self.free_turn_rad
        return -right <= turn_rad <= left

    @property
    def ends_search(self) -> bool:
        """The search ends at the target."""
        if self.target is None:
            return False
        return self.target.kind is NodeKind.TERMINATING or self.out_of_reach_m is not None
