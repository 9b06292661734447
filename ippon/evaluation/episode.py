"""Loop over one search in a simulated home: world and mission, step by step."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ippon.frame import Frame
from ippon.mission.mission import Mission
from ippon.mission.snapshot import MissionState, StepResult
from ippon.simulation.world import SimulatedWorld

ENDED = (MissionState.FOUND, MissionState.EXHAUSTED)


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeLimits:
    """Time steps and time limit of an episode."""

    time_step_s: float = 0.2
    """Simulated time between commands; path length is summed over these steps."""
    steps_per_frame: int = 1
    """Time steps between images; more is faster and reacts later."""
    max_time_s: float = 500.0
    """Simulated time limit of an episode."""

    def __post_init__(self) -> None:
        """Reject values out of range."""
        if not (
            0.0 < self.time_step_s < math.inf
            and self.steps_per_frame >= 1
            and 0.0 < self.max_time_s < math.inf
        ):
            raise ValueError(
                "time_step_s and max_time_s must be positive and steps_per_frame at least 1; got "
                f"{self.time_step_s}, {self.max_time_s}, {self.steps_per_frame}"
            )
        if self.frames < 1:
            raise ValueError(
                f"max_time_s of {self.max_time_s} is less than the time between two images, "
                f"{self.time_step_s * self.steps_per_frame:g} s"
            )

    @property
    def frames(self) -> int:
        """Most images of an episode."""
        return round(self.max_time_s / self.time_step_s / self.steps_per_frame)


def run_episode(
    world: SimulatedWorld,
    mission: Mission,
    limits: EpisodeLimits,
    watch: Callable[[Frame], None] | None = None,
) -> Iterator[StepResult]:
    """Yield the mission's result for each frame until the search ends or time is up.

    The mission must have a goal; the world is asked to segment the labels of the mission's map.

    Args:
        world: Home and robot.
        mission: The search.
        limits: Time steps and time limit.
        watch: Called with each frame before the mission.
    """
    if mission.goal is None:
        raise ValueError("an episode needs a goal: call mission.goals.set_goal first")
    first, *others = mission.goals.asked
    world.set_labels(mission.voxel_map.labels, first, others)
    for _ in range(limits.frames):
        frame = world.observe()
        if watch is not None:
            watch(frame)
        result = mission.step(frame)
        yield result
        if result.snapshot.state in ENDED:
            return
        for _ in range(limits.steps_per_frame):
            world.step(result.command, limits.time_step_s)
        if world.navigation is not None and mission.navigation is not None:
            for number, outcome in world.navigation.take_reports():
                mission.navigation.follower.report(number, outcome)
