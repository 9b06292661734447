"""The interface of planners, so that missions can run with different methods."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ippon.command import Command
from ippon.geometry import Float64Array
from ippon.mapping.arrays import MapArrays
from ippon.mapping.far_evidence.joint_evidence import EvidenceAhead
from ippon.planning.plan import Plan


class Planner(Protocol):
    """Selects where the robot goes; `ViewpointPlanner` is the paper's."""

    def set_goal(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """Set a new goal.

        Args:
            probabilities: (4,) p_img by level.
            termination_min: T_min; viewpoints that show more object voxels end the search.
        """
        ...

    def set_levels(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """Set other levels for the same goal, or for what is left of a tour.

        Args:
            probabilities: See `set_goal`.
            termination_min: See `set_goal`.
        """
        ...

    def set_termination_min(self, termination_min: float) -> None:
        """Change T_min of the present goal."""
        ...

    def set_searching(self, searching: bool, *, counts: bool = True) -> None:
        """Say whether a search runs; a planner may take more risk before a search gives up.

        Args:
            searching: False from the end of a search until it goes on or a goal is set.
            counts: Whether the next step counts where a planner gives up after a number of steps;
                five a second do while the robot follows the plan.
        """
        ...

    def set_far_evidence(self, far_evidence: EvidenceAhead | None) -> None:
        """Set the evidence from beyond the map's range; a planner may ignore it.

        Args:
            far_evidence: Evidence for the present goal, updated with every image; None for none.
        """
        ...

    def note_height(self, z_m: float) -> None:
        """Take over the height of the base in a frame, whether or not a step follows.

        Args:
            z_m: World z, metres.
        """
        ...

    def mark_contact(self, T_world_base: Float64Array, motion: Command | None = None) -> None:
        """Record that the robot has touched an obstacle.

        Args:
            T_world_base: Pose of the robot.
            motion: The last command; None for straight ahead.
        """
        ...

    def mark_unreachable(self, xy: tuple[float, float]) -> None:
        """Record that the robot's own navigation cannot reach a point.

        Args:
            xy: World x and y, metres.
        """
        ...

    def step(self, map_arrays: MapArrays, T_world_base: Float64Array, tilt_rad: float) -> Plan:
        """Return the best plan for a robot at this pose.

        Args:
            map_arrays: The map, with the image taken from here in it.
            T_world_base: Pose of the robot.
            tilt_rad: Tilt of its camera.
        """
        ...
