"""Record of one search in a running world."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ippon.command import Command
from ippon.evaluation.episode import EpisodeLimits, run_episode
from ippon.evaluation.methods.method_table import PlannerSetup
from ippon.evaluation.metrics import Judge
from ippon.evaluation.outcome import Ending, is_at_instance, is_wrong_instance, shows_object
from ippon.frame import Frame
from ippon.geometry import Float64Array
from ippon.mapping.arrays import MapArrays
from ippon.mapping.far_evidence.joint_evidence import EvidenceAhead
from ippon.mission.mission import Mission
from ippon.mission.operator_control import WeighingPlanner, path_to
from ippon.mission.snapshot import MissionState, Snapshot, StepResult
from ippon.planning.interface import Planner
from ippon.planning.plan import Plan
from ippon.planning.visibility.region_weights import Stroke, WeightGrid
from ippon.simulation.world import SimulatedWorld

Clock = Callable[[], float]
FrameObserver = Callable[[Frame, StepResult, Mission], None]
"""Called with every frame, the mission's result, and the mission."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Clocks:
    """Time sources; the library itself has no clock."""

    wall: Clock
    """Seconds."""
    cpu: Clock
    """Processor time of this process, seconds."""


class TimedPlanner:
    """Delegates to a planner and records the time of each step, and who chose its target."""

    def __init__(self, planner: Planner, cpu: Clock) -> None:
        self._planner = planner
        self._cpu = cpu
        self.seconds: list[float] = []
        self.by_rule: list[bool | None] = []
        """`Plan.by_rule` of each step."""

    def set_goal(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """See `Planner.set_goal`."""
        self._planner.set_goal(probabilities=probabilities, termination_min=termination_min)

    def set_levels(self, *, probabilities: NDArray[np.float32], termination_min: float) -> None:
        """See `Planner.set_levels`."""
        self._planner.set_levels(probabilities=probabilities, termination_min=termination_min)

    def set_termination_min(self, termination_min: float) -> None:
        """See `Planner.set_termination_min`."""
        self._planner.set_termination_min(termination_min)

    def set_searching(self, searching: bool, *, counts: bool = True) -> None:
        """See `Planner.set_searching`."""
        self._planner.set_searching(searching, counts=counts)

    def set_far_evidence(self, far_evidence: EvidenceAhead | None) -> None:
        """See `Planner.set_far_evidence`."""
        self._planner.set_far_evidence(far_evidence)

    def set_regions(self, strokes: Sequence[Stroke], rooms: WeightGrid | None = None) -> None:
        """See `WeighingPlanner.set_regions`; methods without it ignore regions."""
        if isinstance(self._planner, WeighingPlanner):
            self._planner.set_regions(strokes, rooms)

    def path_to_point(self, T_world_base: Float64Array, xy: Float64Array) -> Float64Array | None:
        """See `PathPlanner.path_to_point`; None for methods without it."""
        return path_to(self._planner, (float(xy[0]), float(xy[1])), T_world_base)

    def note_height(self, z_m: float) -> None:
        """See `Planner.note_height`."""
        self._planner.note_height(z_m)

    def mark_contact(self, T_world_base: Float64Array, motion: Command | None = None) -> None:
        """See `Planner.mark_contact`."""
        self._planner.mark_contact(T_world_base, motion)

    def mark_unreachable(self, xy: tuple[float, float]) -> None:
        """See `Planner.mark_unreachable`."""
        self._planner.mark_unreachable(xy)

    def step(self, map_arrays: MapArrays, T_world_base: Float64Array, tilt_rad: float) -> Plan:
        """See `Planner.step`."""
        began = self._cpu()
        plan = self._planner.step(map_arrays, T_world_base, tilt_rad)
        self.seconds.append(self._cpu() - began)
        self.by_rule.append(plan.by_rule)
        return plan


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeSetup:
    """A robot in a home with its mission; reusable for a second goal."""

    world: SimulatedWorld
    mission: Mission
    planner_setup: PlannerSetup
    planner: TimedPlanner


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchRecord:
    """Record of one search, counted from its own start."""

    trajectory: Float64Array
    """(N, 3) metres: the start, then the end of every step that moved the base."""
    positions: NDArray[np.float64]
    """(F, 2) metres, one per frame."""
    contacts: NDArray[np.bool_]
    """(F,) whether the base was in contact since the frame before."""
    time_s: float
    frames: int
    hits: int
    first_seen_s: float
    """When the object first came into view, -1 for never."""
    seen_point: int
    """Point of the trajectory at that time, -1 for never."""
    mapped_point: int
    """Point of the trajectory when the map, after that, first held a cluster of voxels at the
    object; -1 for never."""
    last: Snapshot
    ending: Ending
    recognised: bool
    """Whether the map holds a cluster of voxels at the object at the end."""
    wrong_instance: bool
    """Whether the find is of the goal's kind and has another colour."""
    rule_steps: int
    """Planner steps in which the method's rule was asked, and the robot searched by the plan."""
    unruled_steps: int
    """Those in which it gave no target within reach."""
    planner_s: tuple[float, ...]
    step_s: tuple[float, ...]
    """Processor time of each planner step, and of each mission step."""


@dataclass(slots=True, kw_only=True)
class _Notes:
    positions: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    contacts: list[bool] = field(default_factory=list[bool])
    step_s: list[float] = field(default_factory=list[float])
    by_rule: list[bool] = field(default_factory=list[bool])
    """Whether the rule gave the target, where it was asked and the plan was followed."""
    first_seen_s: float = -1.0
    seen_point: int = -1
    mapped_point: int = -1
    last: Snapshot | None = None


def search(
    setup: EpisodeSetup,
    judge: Judge,
    limits: EpisodeLimits,
    cpu: Clock,
    *,
    seen_within_m: float,
    observer: FrameObserver | None = None,
) -> SearchRecord:
    """Search for the mission's goal from the robot's present position.

    Args:
        setup: Home, robot and mission.
        judge: Ground truth of the goal.
        limits: Time steps and time limit.
        cpu: Processor time.
        seen_within_m: Range within which the object counts as in view.
        observer: Called with every frame, or None.
    """
    world, planner = setup.world, setup.planner
    base = world.base
    began_ns, began_frames, began_hits = world.stamp_ns, world.frames, world.collisions
    began_points, began_plans = len(world.trajectory) - 1, len(planner.seconds)
    notes, hits = _Notes(), began_hits
    instances, wrong = (
        [world.scene.instances[k] for k in rows]
        for rows in (judge.instances, judge.wrong_instances)
    )
    # The generator runs observe, watch and the mission's step; the step alone is timed by
    # taking the clock when the frame is handed over.
    handed: list[tuple[int, float, Frame]] = []

    def watch(frame: Frame) -> None:
        if setup.planner_setup.observe is not None:
            setup.planner_setup.observe(frame)
        handed[:] = [(len(planner.by_rule), cpu(), frame)]

    for result in run_episode(world, setup.mission, limits, watch):
        planned, began, frame = handed[0]
        notes.step_s.append(cpu() - began)
        notes.last = result.snapshot
        if result.snapshot.state is MissionState.SEARCHING:
            notes.by_rule += [by for by in planner.by_rule[planned:] if by is not None]
        notes.positions.append((base.x_m, base.y_m))
        # A contact may begin and end between two frames.
        notes.contacts.append(base.contact or world.collisions > hits)
        hits = world.collisions
        if notes.first_seen_s < 0.0 and _is_in_view(world, judge, seen_within_m):
            notes.first_seen_s = round((world.stamp_ns - began_ns) * 1e-9, 3)
            notes.seen_point = len(world.trajectory) - 1 - began_points
        if notes.seen_point >= 0 > notes.mapped_point and any(
            is_at_instance(cluster, instances) for cluster in result.snapshot.candidates
        ):
            notes.mapped_point = len(world.trajectory) - 1 - began_points
        if observer is not None:
            observer(frame, result, setup.mission)
    last = notes.last
    assert last is not None, "an episode has at least one frame"
    return SearchRecord(
        trajectory=world.trajectory[began_points:],
        positions=np.array(notes.positions),
        contacts=np.array(notes.contacts),
        time_s=(world.stamp_ns - began_ns) * 1e-9,
        frames=world.frames - began_frames,
        hits=world.collisions - began_hits,
        first_seen_s=notes.first_seen_s,
        seen_point=notes.seen_point,
        mapped_point=notes.mapped_point,
        last=last,
        ending=last.outcome or "time",
        recognised=any(is_at_instance(c, instances) for c in last.candidates),
        wrong_instance=last.find is not None and is_wrong_instance(last.find, instances, wrong),
        rule_steps=len(notes.by_rule),
        unruled_steps=notes.by_rule.count(False),
        planner_s=tuple(planner.seconds[began_plans:]),
        step_s=tuple(notes.step_s),
    )


def _is_in_view(world: SimulatedWorld, judge: Judge, within_m: float) -> bool:
    rendering = world.rendering
    return rendering is not None and shows_object(rendering, judge.instances, within_m)
