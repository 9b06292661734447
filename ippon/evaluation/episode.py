"""One search in a simulated home, without processes: the world and the mission, step by step."""

from collections.abc import Iterator
from dataclasses import dataclass

from ippon.mission.mission import Mission
from ippon.mission.snapshot import MissionState, StepResult
from ippon.simulation.world import SimulatedWorld

ENDED = (MissionState.FOUND, MissionState.EXHAUSTED)


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeLimits:
    """How an episode is clocked and when it is given up."""

    time_step_s: float = 0.2
    """Simulated time between two frames."""
    max_time_s: float = 500.0
    """Simulated time after which the episode ends without a stop."""


def run_episode(
    world: SimulatedWorld, mission: Mission, limits: EpisodeLimits
) -> Iterator[StepResult]:
    """Yield what the mission answers to each frame until it ends the search or time is up.

    The mission must have a goal; the world is asked to segment the labels of the mission's map.
    """
    goal = mission.goal
    if goal is None:
        raise ValueError("an episode needs a goal: call mission.set_goal first")
    world.set_labels(mission.voxel_map.labels, goal.object)
    for _ in range(round(limits.max_time_s / limits.time_step_s)):
        result = mission.step(world.observe())
        yield result
        if result.snapshot.state in ENDED:
            return
        world.step(result.command, limits.time_step_s)
