"""The interface of a behavior: it returns an action for a step, or none."""

from dataclasses import dataclass, field
from typing import Protocol

from ippon.command import Command
from ippon.control.goal_follower import GoalFollower
from ippon.control.path_follower import PathFollower
from ippon.frame import Frame
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.search import Search
from ippon.mission.snapshot import MissionState
from ippon.planning.plan import Plan

Follower = PathFollower | GoalFollower


@dataclass(frozen=True, slots=True)
class Action:
    """The command until the next frame, and what the operator reads about it."""

    command: Command
    state: MissionState | None = None
    """The new state of the search; None leaves it as it is."""
    why: str | None = None
    """The new reason that the operator reads; None leaves it as it is."""
    plan: Plan | None = None
    """Shown instead of the planner's plan; None shows that."""
    heading_rad: float | None = None
    """World heading at which a turn on the spot ends; None for one that goes on."""


@dataclass(slots=True)
class StepContext:
    """Frame, plan and search of one step."""

    frame: Frame
    dt_s: float
    """Seconds since the last frame."""
    plan: Plan
    search: Search | None
    """The running search; None if the robot only drives to the operator's point."""
    follower: Follower
    voxel_map: VoxelMap
    others: tuple[Search, ...] = ()
    """The other running searches of a tour."""
    counts: bool = True
    """Whether the step counts where patience is given in steps, five a second."""
    _followed: Command | None = field(default=None, init=False)

    @property
    def searches(self) -> tuple[Search, ...]:
        """Every running search, the leading one first."""
        return self.others if self.search is None else (self.search, *self.others)

    @property
    def hold(self) -> Command:
        """The command that keeps the robot where it is, with the camera as it is."""
        return Command(tilt_rad=self.frame.tilt_rad)

    def follow(self, plan: Plan) -> Command:
        """Step the path follower along a plan; `follower.reached` is set at its end."""
        return self.follower.step(
            plan,
            self.frame.T_world_base,
            self.frame.tilt_rad,
            self.voxel_map.arrays(),
            self.dt_s,
        )

    def follow_plan(self) -> Command:
        """Follow the planner's plan; the follower is stepped by the first call only."""
        if self._followed is None:
            self._followed = self.follow(self.plan)
        return self._followed


class Behavior(Protocol):
    """One kind of action; see `ippon.mission.behaviors.priority` for their order."""

    def act(self, step: StepContext) -> Action | None:
        """Return an action, or None to pass the step to the behavior of next lower priority."""
        ...
