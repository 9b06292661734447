"""What the operator asks for between two steps: to hold still, who drives, and where to."""

import numpy as np

from ippon.command import Command
from ippon.control.drive_mode import DriveMode
from ippon.control.path_follower import PathFollower
from ippon.frame import Frame
from ippon.geometry import Float64Array
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.waypoint import Steerable, Waypoint, way_length
from ippon.mission.journal import Journal
from ippon.mission.snapshot import MissionState
from ippon.planning.interface import Planner
from ippon.planning.plan import Plan
from ippon.planning.visibility.region_weights import RegionWeights

HELD_TEXT = {
    MissionState.STOPPED: "stopped: press Resume to go on",
    MissionState.PAUSED: "paused",
}
DRIVE_TEXT = {
    DriveMode.AUTO: "the robot drives by itself again",
    DriveMode.ASSISTED: "the operator drives, with the planner's help",
    DriveMode.MANUAL: "the operator drives",
}


class Steering:
    """Holds the robot, says who drives it, and brings it to the operator's point."""

    def __init__(
        self, planner: Planner, follower: PathFollower, voxel_map: VoxelMap, journal: Journal
    ) -> None:
        self._planner = planner
        self._follower = follower
        self._voxel_map = voxel_map
        self._journal = journal
        self._held: MissionState | None = None
        self._mode = DriveMode.AUTO
        self._waypoint: Waypoint | None = None

    @property
    def held(self) -> MissionState | None:
        """`STOPPED` or `PAUSED` while the robot must stand still."""
        return self._held

    @property
    def held_text(self) -> str | None:
        """Why it must, for the operator."""
        return None if self._held is None else HELD_TEXT[self._held]

    @property
    def waypoint(self) -> Waypoint | None:
        """Where the operator sends the robot, until it is there."""
        return self._waypoint

    @property
    def by_hand(self) -> bool:
        """Commands are the operator's, whether given one by one or as a point to go to."""
        return self._waypoint is not None or self._mode is DriveMode.MANUAL

    @property
    def commands_followed(self) -> bool:
        """What the mission commands is what the robot does: nobody else drives."""
        return self._waypoint is not None or self._mode is DriveMode.AUTO

    def stop(self) -> None:
        """Hold still until `resume`, whatever happens."""
        if self._held is not MissionState.STOPPED:
            self._journal.note("stopped", "stopped by the operator")
        self._held = MissionState.STOPPED

    def pause(self) -> None:
        """Hold still until `resume`; a stop is more and stays."""
        self._held = self._held or MissionState.PAUSED

    def resume(self) -> None:
        """Go on after `stop` or `pause`."""
        if self._held is not None:
            self._journal.note("resumed", "the search goes on")
        self._held = None

    def drive(self, mode: DriveMode) -> None:
        """Say who drives; a way to a point ends."""
        if mode is not self._mode:
            self._journal.note("drive", DRIVE_TEXT[mode])
        self._mode = mode
        self._waypoint = None

    def set_regions(self, regions: RegionWeights | None) -> bool:
        """Hand painted parts of the floor to the planner; returns whether it takes them."""
        if not isinstance(self._planner, Steerable):
            return False
        self._planner.set_regions(regions)
        return True

    def go_to(self, xy: tuple[float, float], frame: Frame) -> float | None:
        """Go to a point on the floor; returns the length of the way, None where there is none."""
        # The floor as of this frame: without a goal the planner has not looked at it yet.
        self._planner.step(self._voxel_map.arrays(), frame.T_world_base, frame.tilt_rad)
        way = self._way_to(xy, frame)
        if way is None:
            return None
        self._waypoint = Waypoint(xy=xy)
        self._journal.note("drive", f"going to a point {way_length(way):.1f} m away")
        return way_length(way)

    def cancel_go_to(self) -> None:
        """Go to no point any more."""
        self._waypoint = None

    def go_on(self, frame: Frame, plan: Plan, dt_s: float) -> tuple[Command, Plan]:
        """Drive on to the operator's point; there, or without a way, it is done with.

        Args:
            frame: Where the robot stands.
            plan: What the planner chose on this frame.
            dt_s: Seconds since the frame before.

        Returns:
            The command, and the plan with the way to the point in place of the planner's choice.
        """
        waypoint, way = self._waypoint, None
        if waypoint is not None:
            way = self._way_to(waypoint.xy, frame)
        if waypoint is None or way is None:
            self._end_waypoint("there is no way to the point any more")
            return Command(tilt_rad=frame.tilt_rad), plan
        plan = waypoint.plan(plan, frame.T_world_base, way)
        self._journal.why = f"going to your point, {way_length(way):.1f} m"
        command = self._follower.step(
            plan, frame.T_world_base, frame.tilt_rad, self._voxel_map.arrays(), dt_s
        )
        if self._follower.reached:
            self._end_waypoint("at the point that you chose")
        return command, plan

    def _end_waypoint(self, text: str) -> None:
        self._waypoint = None
        self._journal.why = text
        self._journal.note("drive", text)

    def _way_to(self, xy: tuple[float, float], frame: Frame) -> Float64Array | None:
        if not isinstance(self._planner, Steerable):
            return None
        return self._planner.path_to_point(frame.T_world_base, np.array(xy))
