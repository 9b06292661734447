"""Compilation of the planner's kernels that a search may first need long after its start."""

import numpy as np

from ippon.geometry import Float64Array
from ippon.mapping.arrays import MapArrays
from ippon.planning.floor_ways import FloorSurvey
from ippon.planning.roadmap.narrow_passages import NarrowPassageConfig, straight_passage
from ippon.planning.selection.detours import Surroundings, flood_fill_unseen
from ippon.planning.terrain.motion_check import can_turn
from ippon.planning.terrain.reachability import reachable_cells
from ippon.planning.terrain.traversability import Traversability, TraversabilityConfig
from ippon.planning.visibility.view_config import ViewConfig
from ippon.planning.visibility.view_geometry import ViewGeometry, layers_at, ranges_for
from ippon.robot import RobotProfile


def warm_up(arrays: MapArrays, robot: RobotProfile, T_world_base: Float64Array) -> None:
    """Run the kernels for unreachable objects, lengths of ways, and a long body.

    Args:
        arrays: A map in which the robot has driven.
        robot: A long body needs additional kernels.
        T_world_base: Pose of the robot.
    """
    floor = Traversability(TraversabilityConfig(), robot)
    floor.update(arrays, T_world_base)
    grid, limits, margin_m = floor.grid, floor.limits, floor.margin_m
    x, y = float(T_world_base[0, 3]), float(T_world_base[1, 3])
    reachable = reachable_cells(grid, limits, x, y, margin_m, 0.0)
    view, v = ViewConfig(), arrays.voxel_size
    layers = layers_at(view, robot, v, floor.floor_z_m)
    ranges = ranges_for(view, v, 1.0, arrays.ooi_clear_m)
    geometry = ViewGeometry.build(view, robot, v, layers, ranges, 0.5)
    around = Surroundings(grid, limits, margin_m, reachable, arrays, geometry)
    flood_fill_unseen(around, np.zeros_like(reachable), (x, y))
    FloorSurvey(TraversabilityConfig(), robot).read(arrays, T_world_base).ways()
    if not robot.is_round:
        can_turn(grid, limits, x, y, 0.0, 1.0, margin_m, margin_m)
        floor.free_turn(T_world_base)
        straight_passage(NarrowPassageConfig(), grid, limits, x, y, margin_m)
