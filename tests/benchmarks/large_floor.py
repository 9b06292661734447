"""What a step of the planner takes on a floor of 1,000 m2: two corridors, 30 rooms, all seen."""

import math
import time
from collections.abc import Iterator

import numpy as np

from ippon.geometry import base_pose
from ippon.guidance.levels import LevelProbabilities
from ippon.mapping.arrays import OCCUPIED, UNKNOWN
from ippon.planning.config import PlannerConfig
from ippon.planning.plan import Plan
from ippon.planning.planner import ViewpointPlanner
from ippon.robot import ZED
from tests.benchmarks.rows import Row
from tests.ippon.planning.conftest import DenseMap

STEPS = 200
SKIPPED = 100
"""The whole floor appears at once, which no robot sees: the steps in which the first viewpoints are
laid out are not counted."""
STRIDE_M = 0.16
WHAT = "1,000 m2, 30 rooms, all seen"


def planner_rows() -> Iterator[Row]:
    """Walk where the planner says and time its steps."""
    arrays = hospital().arrays()
    planner = ViewpointPlanner(PlannerConfig(), ZED, 0)
    planner.set_goal(probabilities=LevelProbabilities().as_array(), termination_min=6.0)
    x, y, yaw = 1.8, 7.0, 0.0
    seconds: list[float] = []
    nodes = 0
    for _ in range(SKIPPED + STEPS):
        began = time.process_time()
        plan = planner.step(arrays, base_pose(x, y, 0.0, yaw), -0.2)
        seconds.append(time.process_time() - began)
        nodes = len(plan.tree.gains) - 1
        x, y, yaw = walked(plan, x, y, yaw)
    milliseconds = 1e3 * np.array(seconds[SKIPPED:])
    median = float(np.median(milliseconds))
    yield Row(name="planner step", data=WHAT, voxel_size_m=0.1, median_ms=median)
    for name, share in (("95th percentile", 95), ("longest", 100)):
        value = float(np.percentile(milliseconds, share))
        yield Row(name=f"planner step, {name}", data=WHAT, value=value, unit="ms")
    yield Row(name="viewpoints", data=WHAT, value=float(nodes), unit="viewpoints")


def walked(plan: Plan, x: float, y: float, yaw: float) -> tuple[float, float, float]:
    """Return x, y and heading after a stride along a plan's path."""
    if plan.target is None:
        return x, y, yaw
    left, here = STRIDE_M, np.array([x, y])
    for corner in plan.path_world[1:, :2]:
        step = corner - here
        length = float(np.linalg.norm(step))
        if length >= left:
            here = here + step * (left / length)
            return float(here[0]), float(here[1]), math.atan2(step[1], step[0])
        left, here = left - length, corner
    return float(here[0]), float(here[1]), plan.target.yaw_rad


def hospital() -> DenseMap:
    """Four rows of rooms of 5 m by 5 m, two corridors of 2.5 m and a passage between them."""
    rng = np.random.default_rng(7)
    volume = DenseMap((41.6, 26.4, 2.4))
    volume.room((0.8, 0.8), (40.8, 25.8))

    def block(x0: float, y0: float, x1: float, y1: float, height: float = 2.0) -> None:
        corner = (0.8 + x1, 0.8 + y1, height)
        volume.fill((0.8 + x0, 0.8 + y0, 0.0), corner, OCCUPIED, ooi=0.02, level=1)

    for row, (low, high, front) in enumerate(
        ((0.0, 5.0, 5.0), (7.5, 12.5, 7.5), (12.5, 17.5, 17.5), (20.0, 25.0, 20.0))
    ):
        for column in range(8):
            x = 5.0 * column
            block(x, low, x + 0.1, high)
            if row in (1, 2) and column == 4:
                continue
            door = x + round(float(rng.uniform(0.6, 3.3)), 1)
            block(x, front, door, front + 0.1)
            block(door + 1.0, front, x + 5.0, front + 0.1)
            back = low + 0.3 if front == high else high - 2.3
            block(x + 0.4, back, x + 1.4, back + 2.0, 0.6)
            block(x + 4.0, back, x + 4.6, back + 1.0, 1.8)
            # What stands there was never looked behind.
            dark = (0.8 + x + 2.2, 0.8 + back, 0.0)
            volume.fill(dark, (dark[0] + 0.7, dark[1] + 0.7, 0.9), UNKNOWN)
    block(0.0, 12.4, 20.0, 12.5)
    block(25.0, 12.4, 40.0, 12.5)
    return volume
