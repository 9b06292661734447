# %% [markdown]
# Compare a planner of your own with the baselines in generated homes. For many homes, processes
# and a report, make it a package: docs/examples/method, and `ippon eval run`.
"""Evaluate a planner of your own against baselines."""

# %% The planner: a rule that chooses where to go next
import argparse
import math
import time

import numpy as np

from ippon.evaluation.episode import EpisodeLimits
from ippon.evaluation.episode_generation import EpisodeGenerationConfig, list_episodes
from ippon.evaluation.episode_record import Clocks
from ippon.evaluation.methods.baselines import Aim, BaselinePlanner, NearestFrontier
from ippon.evaluation.methods.frontiers import find_frontiers
from ippon.evaluation.methods.method_table import METHODS, Method, PlannerInputs, PlannerSetup
from ippon.evaluation.statistics import paired_difference
from ippon.evaluation.trial import Trial, TrialConfig
from ippon.guidance.prior import EmbeddedPrior
from ippon.planning.terrain.floor_grid import cell_centre
from ippon.robot import ZED
from ippon.simulation.homes.generator import generate_home


class AheadFirst(NearestFrontier):
    """Goes to the nearest frontier, where one behind the robot counts three seconds more."""

    def choose(self, plan, routes, last, untried):  # noqa: ARG002 - the rule may use the plan
        """Return the next target; None leaves the choice to the planner of ippon."""

        def cost_s(one):
            before = last.yaw_rad if last is not None else one.yaw_rad
            return one.time_s + 1.5 * (1.0 - math.cos(one.yaw_rad - before))

        left = [one for one in find_frontiers(routes) if untried(one.position)]
        best = min(left, key=cost_s, default=None)
        if best is None:
            return None
        stand = cell_centre(routes.grid, *best.cell)
        return Aim(
            stand=stand, yaw_rad=best.yaw_rad, tilt_rad=-0.3, worth=1, about=best.position,
            reason="ahead first",
        )  # fmt: skip


def make_planner(inputs: PlannerInputs) -> PlannerSetup:
    """Return the planner of one search."""
    planner = BaselinePlanner(inputs.config.planner, inputs.robot, inputs.seed, AheadFirst())
    return PlannerSetup(planner=planner, observe=planner.observe)


mine = Method(name="ahead_first", summary="frontiers ahead first", make_planner=make_planner)
methods = [mine, METHODS["nearest_frontier"], METHODS["ippon"]]

# %% The searches: the same starts, objects and noise for every method
parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("homes", type=int, nargs="?", default=3, help="number of homes")
parser.add_argument("seconds", type=float, nargs="?", default=300.0, help="limit of a search")
arguments = parser.parse_args()
homes, limits = arguments.homes, EpisodeLimits(max_time_s=arguments.seconds)
trial = TrialConfig(robot=ZED, image_width=160, limits=limits)
clocks = Clocks(wall=time.perf_counter, cpu=time.process_time)
rows = {method.name: [] for method in methods}
for seed in range(1001, 1001 + homes):
    home = generate_home(seed)
    plants = EpisodeGenerationConfig(goals=("plant",), min_shortest_path_m=4.0)
    episodes, _ = list_episodes(home, str(seed), ZED, plants)
    searches = Trial(trial, home, "example", clocks, EmbeddedPrior())
    for episode in episodes:
        for method in methods:
            row = searches.run(episode, method)
            rows[method.name].append(row)
            print(f"home {seed}, {method.name}: {row.ending} after {row.time_s:.0f} s", flush=True)

# %% What came of it; SPL is success weighted by the length of the path
for name, searches in rows.items():
    spl = [row.spl for row in searches]
    print(f"{name:18} found {sum(row.success for row in searches)} of {len(spl)}, ", end="")
    print(f"SPL {np.mean(spl):.2f}, path {np.mean([row.path_length_m for row in searches]):.1f} m")
if homes > 1:
    ours, theirs = ([row.spl for row in rows[name]] for name in ("ahead_first", "nearest_frontier"))
    difference = paired_difference(ours, theirs, [row.home for row in rows["ahead_first"]])
    print(f"SPL against nearest_frontier: {difference}")
