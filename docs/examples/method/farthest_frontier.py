"""A search method.

Try it: `ippon eval run --out FOLDER --methods farthest_frontier,farthest_frontier@same_m=1`.
"""

import math

from ippon.evaluation.methods.baselines import Aim, BaselinePlanner, NearestFrontier
from ippon.evaluation.methods.frontiers import find_frontiers
from ippon.evaluation.methods.method_table import Method, PlannerInputs, PlannerSetup
from ippon.planning.terrain.floor_grid import cell_centre


class FarthestFrontier(NearestFrontier):
    """Goes to the frontier that is farthest away, and keeps it until it is gone."""

    def __init__(self, same_m):
        """Take a frontier within `same_m` of the present target for the same one."""
        self.same_m = same_m

    def choose(self, plan, routes, last, untried):
        """Return the next target; None leaves the choice to the planner of ippon."""
        frontiers = [one for one in find_frontiers(routes) if untried(one.position)]
        if last is not None:
            kept = [one for one in frontiers if math.dist(one.position, last.about) < self.same_m]
            frontiers = kept or frontiers
        best = max(frontiers, key=lambda one: one.time_s, default=None)
        if best is None:
            return None
        stand = cell_centre(routes.grid, *best.cell)
        return Aim(stand=stand, yaw_rad=best.yaw_rad, tilt_rad=-0.3, worth=1, about=best.position)


def make_planner(inputs: PlannerInputs) -> PlannerSetup:
    """Return the planner of one search."""
    rule = FarthestFrontier(inputs.parameters["same_m"])
    planner = BaselinePlanner(inputs.config.planner, inputs.robot, inputs.seed, rule)
    return PlannerSetup(planner=planner, observe=planner.observe)


METHOD = Method(
    name="farthest_frontier",
    summary="the frontier farthest away",
    make_planner=make_planner,
    parameters={"same_m": 0.5},
)
