"""What a mission needs of a planner, so that another method can take its place."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ippon.command import Command
from ippon.geometry import Float64Array
from ippon.mapping.arrays import MapArrays
from ippon.mapping.far_evidence.far_evidence import FarEvidence
from ippon.planning.plan import Plan


class Planner(Protocol):
    """Decides where the robot goes; `ViewpointPlanner` is the one of the paper."""

    def set_goal(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """Take over a new goal or other levels.

        Args:
            probabilities: (4,) p_img by level.
            termination_min: T_min; viewpoints that show more object voxels end the search.
        """
        ...

    def set_termination_min(self, termination_min: float) -> None:
        """Take another T_min for the goal that there is; all else stays."""
        ...

    def set_far_evidence(self, far_evidence: FarEvidence | None) -> None:
        """Set the evidence from beyond the map's range; a planner may ignore it.

        Args:
            far_evidence: Evidence for the present goal, updated with every image; None for none.
        """
        ...

    def mark_contact(self, T_world_base: Float64Array, motion: Command | None = None) -> None:
        """Take note that the robot ran into something.

        Args:
            T_world_base: Where it stands.
            motion: What it was commanded last; None for straight ahead.
        """
        ...

    def step(self, map_arrays: MapArrays, T_world_base: Float64Array, tilt_rad: float) -> Plan:
        """Return the best plan for a robot that stands here and has just updated the map."""
        ...
