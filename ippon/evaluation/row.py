"""One row of an evaluation: a search by one method, with everything needed to repeat it."""

import math
from dataclasses import MISSING, asdict, dataclass, fields
from typing import Any, Final, Literal

from ippon.evaluation.outcome import Ending, Failure

SearchKind = Literal["single", "second", "fresh"]
"""`single`: an episode by itself. `second`: on the map of an earlier search. `fresh`: same start
and object as a second search, with an empty map."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeRow:
    """Results of a search. For a seed all but `TIMING_COLUMNS` are reproducible."""

    episode_id: str
    method: str
    home: str
    start_index: int
    start_x_m: float
    start_y_m: float
    start_yaw_rad: float
    goal: str
    context: str
    seed: int
    robot: str
    image_width: int
    image_height: int
    config_hash: str
    """Hash of robot, camera, world, limits, mission and method."""
    version: str
    """Versions of this program, its commit, and of numpy, numba and ompl."""
    success: bool
    spl: float
    soft_spl: float
    path_length_m: float
    shortest_path_m: float
    distance_to_goal_m: float
    ending: Ending
    failure: Failure
    time_s: float
    """Simulated time."""
    frames: int
    hits: int
    """Number of times that the base came into contact."""
    first_seen_s: float
    """Time at which the object first came into view, -1 for never."""
    explored_m2: float
    best_ooi: float
    candidates: int
    """Candidate clusters at the end."""
    path_x_m: tuple[float, ...]
    """Path of the base, a point about every 10 cm."""
    path_y_m: tuple[float, ...]
    planner_ms_p50: float
    """Median processor time of a planner step."""
    planner_ms_p95: float
    step_ms_p50: float
    """Median processor time of a mission step: map, plan and command."""
    wall_s: float
    cpu_s: float
    """Processor time of the whole episode, rendering and segmentation included."""
    realtime_factor: float
    """Simulated time over processor time."""
    kind: SearchKind = "single"
    colour: str = ""
    """Colour that tells the object from others of its kind; empty for none."""
    after: str = ""
    """Goal of the previous search, at whose end this search starts; empty for none."""
    seen_spl: float = -1.0
    """SPL that a straight way to the object would have had from where it first came into view; -1
    if it never did, or in a row of an earlier version."""
    mapped_spl: float = -1.0
    """The same from where the map then first held a cluster of voxels at the object."""
    reached_spl: float = -1.0
    """The same from the first place after that where a stop would have been a success."""
    rule_steps: int = -1
    """Planner steps in which the method's rule was asked and the robot searched by the plan, 0 for
    a method without a rule; -1 in a row of an earlier version."""
    unruled_steps: int = -1
    """Those in which the rule gave no target within reach, so that the planner of `ippon` chose."""


TIMING_COLUMNS: Final = (
    "planner_ms_p50", "planner_ms_p95", "step_ms_p50", "wall_s", "cpu_s", "realtime_factor",
)  # fmt: skip
"""Columns that differ from run to run."""
PATH_COLUMNS: Final = ("path_x_m", "path_y_m")
"""Columns with a list in each row."""
ATTAINABLE_COLUMNS: Final = ("seen_spl", "mapped_spl", "reached_spl")
"""Columns that rows of earlier versions lack, in the order in which a search passes them."""
_DISTANCES: Final = ("shortest_path_m", "distance_to_goal_m")
"""Columns that are infinite where there is no path."""


def values_of(row: EpisodeRow) -> dict[str, Any]:
    """Return the plain values of a row; None for an infinite distance: JSON has no word for it."""
    values = asdict(row)
    return values | {name: None for name in _DISTANCES if math.isinf(values[name])}


def row_from(values: dict[str, Any]) -> EpisodeRow:
    """Return a row from plain values, as `values_of` returns them.

    Raises:
        ValueError: Columns are missing or unknown.
    """
    expected = {f.name for f in fields(EpisodeRow)}
    needed = {f.name for f in fields(EpisodeRow) if f.default is MISSING}
    odd = sorted((needed - set(values)) | (set(values) - expected))
    if odd:
        raise ValueError(f"a row of another version: it lacks or adds {', '.join(odd)}")
    for name in PATH_COLUMNS:
        values = {**values, name: tuple(values[name])}
    values |= {name: math.inf for name in _DISTANCES if values[name] is None}
    return EpisodeRow(**values)
