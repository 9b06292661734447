"""Operator commands between two steps: hold still, drive mode, a point to drive to, regions."""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from ippon.control.drive_mode import DriveMode
from ippon.frame import Frame
from ippon.geometry import Float64Array
from ippon.mapping.arrays import MapArrays
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.journal import Journal
from ippon.mission.snapshot import MissionState
from ippon.planning.interface import Planner
from ippon.planning.plan import Viewpoint
from ippon.planning.visibility.region_weights import Stroke, WeightGrid

HELD_TEXT = {
    MissionState.STOPPED: "stopped: press Resume to go on",
    MissionState.PAUSED: "paused",
}
DRIVE_TEXT = {
    DriveMode.AUTO: "the robot drives by itself again",
    DriveMode.ASSISTED: "the operator drives, with the planner's help",
    DriveMode.MANUAL: "the operator drives",
}


@runtime_checkable
class WeighingPlanner(Protocol):
    """A planner that weighs regions of the floor."""

    def set_regions(self, strokes: Sequence[Stroke], rooms: WeightGrid | None = None) -> None:
        """Weigh the gain of viewpoints by the painted regions and the rooms that they see.

        Args:
            strokes: Painted regions, empty for none.
            rooms: Weights of rooms; None for none.
        """
        ...


@runtime_checkable
class PathPlanner(Protocol):
    """A planner that also plans to points."""

    def path_to_point(self, T_world_base: Float64Array, xy: Float64Array) -> Float64Array | None:
        """Return (K, 2) points from the robot to as near `xy` (2,) as it can stand, or None."""
        ...


@runtime_checkable
class SteerablePlanner(WeighingPlanner, PathPlanner, Protocol):
    """A planner that plans to points of the operator, and previews other levels."""

    def preview(self, map_arrays: MapArrays, *, cues: bool) -> Viewpoint | None:
        """Return what would be chosen on such a map; the planner does not change."""
        ...


class OperatorControl:
    """Holds the robot, keeps the drive mode, and the point that the operator chose."""

    def __init__(self, planner: Planner, voxel_map: VoxelMap, journal: Journal) -> None:
        self._planner = planner
        self._voxel_map = voxel_map
        self._journal = journal
        self._mode = DriveMode.AUTO
        self._strokes: tuple[Stroke, ...] = ()
        self._rooms: WeightGrid | None = None
        self.frame: Frame | None = None
        """The last frame that the mission decided on."""
        self.held: MissionState | None = None
        """`STOPPED` or `PAUSED` while the robot must stand still."""
        self.waypoint: tuple[float, float] | None = None
        """World x and y of the operator's point, until the robot is there, metres."""
        self.speed_limit = 1.0
        """Share of the mission's velocities that the robot is sent; the commands are those of a
        robot without a limit."""

    @property
    def held_text(self) -> str | None:
        """Why the robot stands still, for the operator."""
        return None if self.held is None else HELD_TEXT[self.held]

    @property
    def drives(self) -> bool:
        """The operator drives, by hand or to a point."""
        return self.waypoint is not None or self._mode is DriveMode.MANUAL

    @property
    def follows_mission(self) -> bool:
        """The robot executes the mission's commands: the operator does not drive by hand."""
        return self.waypoint is not None or self._mode is DriveMode.AUTO

    def stop(self) -> None:
        """Hold still until `resume`; `pause` does not weaken a stop."""
        if self.held is not MissionState.STOPPED:
            self._journal.note("stopped", "stopped by the operator")
        self.held = MissionState.STOPPED

    def pause(self) -> None:
        """Hold still until `resume`."""
        if self.held is None:
            self._journal.note("stopped", "paused by the operator")
        self.held = self.held or MissionState.PAUSED

    def resume(self) -> None:
        """Continue after `stop` or `pause`."""
        if self.held is not None:
            self._journal.note("resumed", "the search goes on")
        self.held = None

    def drive(self, mode: DriveMode) -> None:
        """Change the drive mode; cancels a point to go to. Mapping continues."""
        if mode is not self._mode:
            self._journal.note("drive", DRIVE_TEXT[mode])
        self._mode = mode
        self.waypoint = None

    def limit_speed(self, share: float) -> None:
        """Change the share of the mission's velocities that the robot is sent, above 0 to 1."""
        self.speed_limit = share

    def set_regions(self, strokes: Sequence[Stroke]) -> bool:
        """Set the painted regions of the floor, for every goal until changed.

        Returns:
            Whether the planner supports regions.
        """
        self._strokes = tuple(strokes)
        return self._weigh()

    def set_rooms(self, rooms: WeightGrid | None) -> bool:
        """Set the weights of rooms; None for none.

        Returns:
            Whether the planner supports regions.
        """
        self._rooms = rooms
        return self._weigh()

    def _weigh(self) -> bool:
        if not isinstance(self._planner, WeighingPlanner):
            return False
        self._planner.set_regions(self._strokes, self._rooms)
        return True

    def go_to(self, xy: tuple[float, float]) -> float | None:
        """Drive to a point on the floor, then continue in the present mode.

        Args:
            xy: World x and y, metres.

        Returns:
            Length of the path in metres; None, and nothing changes, where there is no path.
        """
        frame = self.frame
        if frame is None:
            return None
        # Without a goal the planner has not been stepped: it must know the floor of this frame.
        self._planner.step(self._voxel_map.arrays(), frame.T_world_base, frame.tilt_rad)
        path = path_to(self._planner, xy, frame.T_world_base)
        if path is None:
            return None
        self.waypoint = xy
        self._journal.note("drive", f"going to a point {path_length(path):.1f} m away")
        return path_length(path)

    def cancel_go_to(self) -> None:
        """Drop the point to go to."""
        self.waypoint = None


def path_to(
    planner: Planner, xy: tuple[float, float], T_world_base: Float64Array
) -> Float64Array | None:
    """Return (K, 2) points from the robot to a point; None where the planner finds no path."""
    if not isinstance(planner, PathPlanner):
        return None
    return planner.path_to_point(T_world_base, np.array(xy))


def path_length(path: Float64Array) -> float:
    """Return the length of a (K, 2) polyline in metres."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
