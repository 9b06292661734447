"""Table of the methods: the paper's, ablations, baselines and an upper bound."""

import dataclasses
import difflib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from ippon import extensions
from ippon.evaluation.methods.baselines import (
    BaselinePlanner,
    GreedyNextBestView,
    NearestFrontier,
    Rule,
    SemanticFrontier,
)
from ippon.evaluation.methods.oracle import OraclePlanner
from ippon.evaluation.metrics import Judge
from ippon.frame import Frame
from ippon.guidance.levels import Guidance, LabelLevel, Level
from ippon.mission.config import MissionConfig
from ippon.planning.interface import Planner
from ippon.planning.planner import ViewpointPlanner
from ippon.robot import CollisionSphere, RobotProfile
from ippon.simulation.scene import Scene

HARD_MARGIN_M: Final = 0.1
"""Clearance around the body that `hard_clearance` requires everywhere, instead of a cost."""
_NO_CAP: Final = 1e6
ORACLE_ROOM_M: Final = 0.06
"""Enlargement of the body for the oracle's paths."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerInputs:
    """Inputs for making a planner. Only the oracle uses scene and judge."""

    config: MissionConfig
    robot: RobotProfile
    guidance: Guidance
    seed: int
    scene: Scene
    judge: Judge
    goal: str
    parameters: Mapping[str, float] = field(default_factory=dict[str, float])
    """`Method.parameters`, with the values of the run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerSetup:
    """A planner, and the callback for each frame before its step."""

    planner: Planner
    observe: Callable[[Frame], None] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Method:
    """A search method."""

    name: str
    summary: str
    configure: Callable[[MissionConfig], MissionConfig] = lambda config: config
    """Changes the configuration of the run, which the planner is made of."""
    guide: Callable[[Guidance], Guidance] = lambda guidance: guidance
    """Changes the levels of the labels, such as to every one *average*."""
    make_planner: Callable[[PlannerInputs], PlannerSetup]
    """Makes a planner for one search: `ViewpointPlanner`, or one that decides by a `Rule`."""
    supports_second_goal: bool = True
    """Whether it can search for a second object; the oracle's paths lead to the first only."""
    parameters: Mapping[str, float] = field(default_factory=dict[str, float])
    """Numbers that `make_planner` uses, with their defaults. The name `mine@power=2` is a method
    with another value, whose rows stand beside those of `mine`."""


def _viewpoint_planner(s: PlannerInputs) -> PlannerSetup:
    return PlannerSetup(planner=ViewpointPlanner(s.config.planner, s.robot, s.seed))


def _by_rule(make: Callable[[PlannerInputs], Rule]) -> Callable[[PlannerInputs], PlannerSetup]:
    def make_planner(s: PlannerInputs) -> PlannerSetup:
        planner = BaselinePlanner(s.config.planner, s.robot, s.seed, make(s))
        return PlannerSetup(planner=planner, observe=planner.observe)

    return make_planner


def _semantic(s: PlannerInputs) -> Rule:
    probabilities = s.config.levels.as_array().astype(np.float64)
    rows = s.guidance.rows
    return SemanticFrontier({row.label: float(probabilities[row.level]) for row in rows})


def _oracle(s: PlannerInputs) -> PlannerSetup:
    wide = Judge(s.scene, widened(s.robot, ORACLE_ROOM_M), s.goal, colour=s.judge.colour)
    return PlannerSetup(planner=OraclePlanner(s.scene, s.judge, wide))


def widened(robot: RobotProfile, by_m: float) -> RobotProfile:
    """Return a robot whose body is enlarged on every side."""
    spheres = tuple(
        CollisionSphere(x_m=s.x_m, y_m=s.y_m, z_m=s.z_m, radius_m=s.radius_m + by_m)
        for s in robot.spheres
    )
    return replace(robot, spheres=spheres)


def _all_average(guidance: Guidance) -> Guidance:
    rows = tuple(
        LabelLevel(label=row.label, level=Level.AVERAGE, reason="no guidance")
        for row in guidance.rows
    )
    return dataclasses.replace(guidance, provider="none", rows=rows)


def _max_fusion(config: MissionConfig) -> MissionConfig:
    return replace(config, map=replace(config.map, fusion="max"))


def _without_far_evidence(config: MissionConfig) -> MissionConfig:
    return replace(config, far_evidence=replace(config.far_evidence, enabled=False))


def _no_colour_check(config: MissionConfig) -> MissionConfig:
    """Judge no find by its colour: no image is near enough."""
    return replace(config, attribute_check=replace(config.attribute_check, max_range_m=0.0))


def _papers_scores(config: MissionConfig) -> MissionConfig:
    """Score viewpoints as in the paper: G(P_n) / C(P_n), the whole sum, and T(n) within range."""
    config = _without_far_evidence(config)
    planner = config.planner
    selection = replace(
        planner.selection,
        cost_power=1.0,
        look_s=1.0,
        stay_power=0.0,
        passing_weight=1.0,
        framing_cap=_NO_CAP,
    )
    view = replace(planner.view, termination_depth_m=0.0)
    passing = replace(planner.closer_look.passing, enabled=False)
    looks = replace(planner.closer_look, passing=passing)
    planner = replace(planner, selection=selection, view=view, closer_look=looks)
    return replace(config, planner=planner)


def _straight_only(config: MissionConfig) -> MissionConfig:
    planner = config.planner
    local = replace(planner.local_planner, enabled=False)
    return replace(config, planner=replace(planner, local_planner=local))


def _hard_clearance(config: MissionConfig) -> MissionConfig:
    """Forbid clearance below a margin instead of weighting it."""
    planner = config.planner
    local = replace(planner.local_planner, clearance="hard", hard_margin_m=HARD_MARGIN_M)
    floor = replace(planner.traversability, margin_m=HARD_MARGIN_M, slow_fraction=1.0)
    return replace(config, planner=replace(planner, local_planner=local, traversability=floor))


def _no_initial_yaw(config: MissionConfig) -> MissionConfig:
    return replace(config, look_around=replace(config.look_around, turn=False))


def _no_travel_pitch(config: MissionConfig) -> MissionConfig:
    return replace(config, travel_pitch=replace(config.travel_pitch, sweep=False))


_ALL: Final = (
    Method(
        name="ippon",
        summary="the paper's method, with evidence from images beyond the map's range",
        make_planner=_viewpoint_planner,
    ),
    Method(
        name="no_bayes",
        summary="voxels keep the highest probability seen instead of the Bayes filter",
        configure=_max_fusion,
        make_planner=_viewpoint_planner,
    ),
    Method(
        name="no_guidance",
        summary="every common object is rated average",
        guide=_all_average,
        make_planner=_viewpoint_planner,
    ),
    Method(
        name="no_far_evidence",
        summary="no evidence from images beyond the map's range, as in the paper",
        configure=_without_far_evidence,
        make_planner=_viewpoint_planner,
    ),
    Method(
        name="paper",
        summary="viewpoints are scored as in the paper, from the map alone",
        configure=_papers_scores,
        make_planner=_viewpoint_planner,
    ),
    Method(
        name="no_local_planner",
        summary="viewpoints connect by straight lines or not at all",
        configure=_straight_only,
        make_planner=_viewpoint_planner,
    ),
    Method(
        name="hard_clearance",
        summary="a fixed margin around the body instead of a cost that falls with clearance",
        configure=_hard_clearance,
        make_planner=_viewpoint_planner,
    ),
    Method(
        name="no_initial_yaw",
        summary="no turn on the spot at the start",
        configure=_no_initial_yaw,
        make_planner=_viewpoint_planner,
    ),
    Method(
        name="no_travel_pitch",
        summary="the camera keeps its tilt while driving",
        configure=_no_travel_pitch,
        make_planner=_viewpoint_planner,
    ),
    Method(
        name="no_colour_check",
        summary="a find of the object counts in any colour",
        configure=_no_colour_check,
        make_planner=_viewpoint_planner,
    ),
    Method(
        name="nearest_frontier",
        summary="the frontier with the least travel time (Yamauchi 1997)",
        make_planner=_by_rule(lambda _: NearestFrontier()),
    ),
    Method(
        name="semantic_frontier",
        summary="the frontier of highest value on a value map (VLFM)",
        make_planner=_by_rule(_semantic),
        supports_second_goal=False,
    ),
    Method(
        name="greedy_nbv",
        summary="the viewpoint of highest discounted gain, without guidance (Bircher 2016)",
        make_planner=_by_rule(lambda _: GreedyNextBestView()),
    ),
    Method(
        name="oracle",
        summary="the shortest path to the object, from ground truth",
        make_planner=_oracle,
        supports_second_goal=False,
    ),
)
METHODS: Final[Mapping[str, Method]] = {method.name: method for method in _ALL}
"""All methods by name, the paper's first."""
BASELINES: Final = ("nearest_frontier", "semantic_frontier", "greedy_nbv")
ABLATIONS: Final = (
    "no_bayes", "no_guidance", "no_local_planner", "hard_clearance", "no_initial_yaw",
    "no_travel_pitch", "no_far_evidence", "paper",
)  # fmt: skip


def base_name(name: str) -> str:
    """Return the name of a method without the values of its parameters."""
    return name.partition("@")[0]


def method_named(name: str) -> Method:
    """Return a method by name, ours or one that an installed package adds.

    Args:
        name: Its name, and values of its parameters, as in `mine@power=2@look_s=1`.

    Raises:
        ValueError: There is no such method or parameter, or the method's package is damaged.
    """
    base, *given = name.split("@")
    method = METHODS.get(base) or _installed(base)
    return _with_values(method, given) if given else method


def _with_values(method: Method, given: list[str]) -> Method:
    """Return a method with other values of parameters, named by them in their declared order."""
    changed: dict[str, float] = {}
    for text in given:
        parameter, _, value = text.partition("=")
        if parameter not in method.parameters:
            there = ", ".join(f"{key}={usual:g}" for key, usual in method.parameters.items())
            raise ValueError(
                f"{method.name} has no parameter {parameter!r}; it has {there or 'none'}"
            )
        try:
            changed[parameter] = float(value)
        except ValueError:
            changed[parameter] = math.nan
        if not math.isfinite(changed[parameter]):
            raise ValueError(f"{method.name}@{parameter}= takes a number; got {value!r}")
    values = {key: changed.get(key, usual) for key, usual in method.parameters.items()}
    told = [f"{key}={_text_of(values[key])}" for key in values if key in changed]
    name = "@".join([method.name, *told])
    return replace(method, name=name, parameters=values)


def _text_of(value: float) -> str:
    """Return the shortest text of a number: another process reads the value from it."""
    short = f"{value:g}"
    return short if float(short) == value else repr(value)


def _installed(name: str) -> Method:
    """Return a method that an installed package adds; raises ValueError."""
    added = extensions.names(extensions.METHODS)
    if name not in added:
        known = (*METHODS, *added)
        near = difflib.get_close_matches(name, known, 1)
        there = f"did you mean {near[0]!r}? There" if near else "there"
        raise ValueError(
            f"no method {name!r}; {there} are {', '.join(known)}; one of your own is an installed "
            "package (docs/guides/extending.md)"
        )
    method = extensions.load(extensions.METHODS, name)
    if not isinstance(method, Method) or method.name != name:
        what = f"a Method named {method.name!r}" if isinstance(method, Method) else repr(method)
        raise ValueError(f"the installed method {name!r} is no Method of that name: it is {what}")
    return method
