"""Tables from rows: metrics of each method, and comparisons."""

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from ippon.evaluation.episode_generation import home_name
from ippon.evaluation.methods.method_table import METHODS
from ippon.evaluation.outcome import FAILURES, Failure
from ippon.evaluation.row import ATTAINABLE_COLUMNS, EpisodeRow
from ippon.evaluation.statistics import (
    PairedDifference,
    Ratio,
    mcnemar_p,
    mean_interval,
    paired_difference,
    paired_ratio,
    share_interval,
)
from ippon.vocabulary import HABITAT_GOALS

REFERENCE: Final = "ippon"
"""Method that the others are compared with."""
SHORT_M: Final = 4.0
LONG_M: Final = 8.0
"""Shortest paths between which episodes are told apart."""
LEAST_WAY_M: Final = 1.0
"""Second searches with a shorter path to the object are excluded."""

_Pairs = Sequence[tuple[EpisodeRow, EpisodeRow]]
_Value = Callable[[EpisodeRow], float]


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodSummary:
    """One line of the table: means over episodes, with 95 % intervals over homes.

    The interval of success is Wilson's; see `share_interval`.
    """

    method: str
    episodes: int
    homes: int
    success: float
    success_ci95: tuple[float, float]
    spl: float
    spl_ci95: tuple[float, float] | None
    """None for a single episode."""
    soft_spl: float
    soft_spl_ci95: tuple[float, float] | None
    hits: float
    time_s: float
    find_s: float | None
    """Median simulated time to the find, failures counting as endless; None unless most succeed."""
    path_length_m: float
    planner_ms_p95: float
    """Mean of the episodes' 95th percentiles of a planner step, weighted by frames; not the 95th
    percentile of all steps."""
    realtime_factor: float
    """Total simulated time over total processor time."""
    failures: dict[Failure, int]
    given_up: dict[Failure, int]
    """Those of the failures that ended before their time, with nothing left to look at."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """A method against the reference, on their common episodes."""

    method: str
    spl: PairedDifference
    """Reference minus method."""
    soft_spl: PairedDifference
    success: PairedDifference
    success_p: float
    """McNemar's exact test."""
    spl_ratio: Ratio | None
    """SPL of the reference over that of the method, on these episodes; None over 0."""
    find_s_ratio: Ratio | None
    """Time of the method over that of the reference, summed over the episodes in which both
    succeed; None without any."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """Effect of a single difference on a method, over pairs of searches."""

    method: str
    spl_with: float
    spl_without: float
    ratio: Ratio | None
    """SPL with over SPL without; None over 0."""
    difference: PairedDifference


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Searches of a method that have something in common."""

    name: str
    method: str
    episodes: int
    success: float
    spl: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Losses:
    """Where a method lost its SPL; all and the SPL sum to 1."""

    method: str
    episodes: int
    before_view: float
    """Until the object first came into view, within the map's range."""
    to_map: float
    """From there until the map held a cluster of voxels at the object."""
    to_reach: float
    """From there to the first place where a stop would have been a success."""
    to_stop: float
    """From there to the stop."""
    false_stops: float
    """What false stops could still have had from the last of these moments."""
    other_failures: float


_PARTS: Final[tuple[tuple[str, Callable[[EpisodeRow], bool]], ...]] = (
    (f"path below {SHORT_M:g} m", lambda r: r.shortest_path_m < SHORT_M),
    (f"path {SHORT_M:g} to {LONG_M:g} m", lambda r: SHORT_M <= r.shortest_path_m < LONG_M),
    (f"path {LONG_M:g} m and more", lambda r: r.shortest_path_m >= LONG_M),
    ("Habitat's objects", lambda r: r.goal in HABITAT_GOALS),
    ("other objects", lambda r: r.goal not in HABITAT_GOALS),
)


def parts(rows: Sequence[EpisodeRow]) -> tuple[Part, ...]:
    """Return each method's figures by shortest path and by kind of object, without empty parts."""
    return tuple(
        Part(
            name=name,
            method=method,
            episodes=len(of),
            success=float(np.mean([row.success for row in of])),
            spl=float(np.mean([row.spl for row in of])),
        )
        for name, belongs in _PARTS
        for method, of in by_method(row for row in rows if belongs(row)).items()
    )


def losses(rows: Sequence[EpisodeRow]) -> tuple[Losses, ...]:
    """Return where each method lost its SPL; rows of earlier versions do not say it."""
    return tuple(
        _losses(name, of)
        for name, of in by_method(rows).items()
        if all(row.first_seen_s < 0.0 or row.seen_spl >= 0.0 for row in of)
    )


def _losses(method: str, rows: list[EpisodeRow]) -> Losses:
    stages = np.zeros(4)
    false_stops = other = 0.0
    for row in rows:
        left = 1.0
        for k, name in enumerate(ATTAINABLE_COLUMNS):
            reached = float(getattr(row, name))
            if reached < 0.0:
                break
            stages[k] += left - min(left, reached)
            left = min(left, reached)
        if row.success:
            stages[3] += left - row.spl
        elif row.failure == "false_stop":
            false_stops += left
        else:
            other += left
    before_view, to_map, to_reach, to_stop = (float(x) for x in stages / len(rows))
    return Losses(
        method=method, episodes=len(rows), before_view=before_view, to_map=to_map,
        to_reach=to_reach, to_stop=to_stop, false_stops=false_stops / len(rows),
        other_failures=other / len(rows),
    )  # fmt: skip


def summarise(rows: Sequence[EpisodeRow]) -> tuple[MethodSummary, ...]:
    """Summarise each method, in the order of `METHODS`."""
    return tuple(_summary(name, of) for name, of in by_method(rows).items())


def by_method(rows: Iterable[EpisodeRow]) -> dict[str, list[EpisodeRow]]:
    """Return the rows of each method, in the order of `METHODS`, unknown ones last."""
    groups: dict[str, list[EpisodeRow]] = defaultdict(list)
    for row in rows:
        groups[row.method].append(row)
    known = [name for name in METHODS if name in groups]
    return {name: groups[name] for name in (*known, *sorted(set(groups) - set(known)))}


def compare(rows: Sequence[EpisodeRow], reference: str = REFERENCE) -> tuple[Comparison, ...]:
    """Compare every other method with the reference, episode by episode.

    Episodes of one name with different contexts, as of two folders, are different searches.
    """
    groups = by_method(rows)
    mine = {(row.episode_id, row.context): row for row in groups.get(reference, [])}
    out: list[Comparison] = []
    for name, of in groups.items():
        keys = ((row.episode_id, row.context) for row in of)
        pairs = [(mine[key], row) for key, row in zip(keys, of, strict=True) if key in mine]
        if name == reference or not pairs:
            continue
        wins = sum(a.success and not b.success for a, b in pairs)
        losses = sum(b.success and not a.success for a, b in pairs)
        finds = [(b, a) for a, b in pairs if a.success and b.success]
        out.append(
            Comparison(
                method=name,
                spl=_paired(pairs, lambda r: r.spl),
                soft_spl=_paired(pairs, lambda r: r.soft_spl),
                success=_paired(pairs, lambda r: float(r.success)),
                success_p=mcnemar_p(wins, losses),
                spl_ratio=_ratio(pairs, lambda r: r.spl),
                find_s_ratio=_ratio(finds, lambda r: r.time_s) if finds else None,
            )
        )
    return tuple(out)


def context_effects(rows: Sequence[EpisodeRow]) -> tuple[Effect, ...]:
    """Compare searches with a true context to the same searches without."""
    out: list[Effect] = []
    for name, of in by_method(singles(rows)).items():
        untold = {_search_key(r): r for r in of if not r.context}
        pairs = [(r, untold[_search_key(r)]) for r in of if r.context and _search_key(r) in untold]
        out += _effect(name, pairs)
    return tuple(out)


def second_object_effects(rows: Sequence[EpisodeRow]) -> tuple[Effect, ...]:
    """Compare searches on the map of an earlier search to those on an empty map.

    Pairs have the same start and goal. Pairs that start within a metre of a viewpoint, or without a
    path to one, are excluded.
    """
    out: list[Effect] = []
    for name, of in by_method(rows).items():
        fresh = {_pair_key(r): r for r in of if r.kind == "fresh"}
        pairs = [
            (r, fresh[_pair_key(r)])
            for r in of
            if r.kind == "second"
            and _pair_key(r) in fresh
            and LEAST_WAY_M <= r.shortest_path_m < math.inf
        ]
        out += _effect(name, pairs)
    return tuple(out)


def singles(rows: Iterable[EpisodeRow]) -> list[EpisodeRow]:
    """Return the rows of single episodes, on which methods are compared."""
    return [row for row in rows if row.kind == "single"]


def _search_key(row: EpisodeRow) -> tuple[str, str, str, int]:
    """Return what a search with a context and that without have in common."""
    return row.home, row.colour, row.goal, row.start_index


def _pair_key(row: EpisodeRow) -> str:
    return row.episode_id.rsplit(".", maxsplit=1)[0]


def _effect(method: str, pairs: _Pairs) -> tuple[Effect, ...]:
    """Return the difference between the first and second of each pair; empty without pairs."""
    if not pairs:
        return ()
    effect = Effect(
        method=method,
        spl_with=float(np.mean([a.spl for a, _ in pairs])),
        spl_without=float(np.mean([b.spl for _, b in pairs])),
        ratio=_ratio(pairs, lambda r: r.spl),
        difference=_paired(pairs, lambda r: r.spl),
    )
    return (effect,)


def spl_by_goal(rows: Sequence[EpisodeRow]) -> dict[str, dict[str, tuple[float, int]]]:
    """Return, by goal and method, the mean SPL and the number of episodes."""
    groups: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        groups[row.goal][row.method].append(row.spl)
    return {
        goal: {m: (float(np.mean(v)), len(v)) for m, v in of.items()}
        for goal, of in sorted(groups.items())
    }


def _summary(name: str, rows: list[EpisodeRow]) -> MethodSummary:
    homes = [home_name(row.home) for row in rows]
    success = [float(row.success) for row in rows]
    spl, soft = [row.spl for row in rows], [row.soft_spl for row in rows]
    frames = np.array([row.frames for row in rows], np.float64)
    causes = Counter(row.failure for row in rows)
    exhausted = Counter(row.failure for row in rows if row.ending == "exhausted")
    return MethodSummary(
        method=name,
        episodes=len(rows),
        homes=len(set(homes)),
        success=float(np.mean(success)),
        success_ci95=share_interval(success, homes),
        spl=float(np.mean(spl)),
        spl_ci95=mean_interval(spl, homes),
        soft_spl=float(np.mean(soft)),
        soft_spl_ci95=mean_interval(soft, homes),
        hits=float(np.mean([row.hits for row in rows])),
        time_s=float(np.mean([row.time_s for row in rows])),
        find_s=_median_find_s(rows),
        path_length_m=float(np.mean([row.path_length_m for row in rows])),
        planner_ms_p95=float(np.average([row.planner_ms_p95 for row in rows], weights=frames)),
        realtime_factor=sum(r.time_s for r in rows) / max(1e-9, sum(r.cpu_s for r in rows)),
        failures={cause: causes[cause] for cause in FAILURES if causes[cause]},
        given_up={cause: exhausted[cause] for cause in FAILURES if exhausted[cause]},
    )


def _median_find_s(rows: Sequence[EpisodeRow]) -> float | None:
    # Sorted, so that two searches without an end are not averaged to NaN.
    times = sorted(row.time_s if row.success else math.inf for row in rows)
    median = 0.5 * (times[(len(times) - 1) // 2] + times[len(times) // 2])
    return median if math.isfinite(median) else None


def _paired(pairs: _Pairs, value: _Value) -> PairedDifference:
    return paired_difference(*_columns(pairs, value))


def _ratio(pairs: _Pairs, value: _Value) -> Ratio | None:
    return paired_ratio(*_columns(pairs, value))


def _columns(pairs: _Pairs, value: _Value) -> tuple[list[float], list[float], list[str]]:
    """Return the value of the first and of the second of each pair, and its home."""
    return (
        [value(a) for a, _ in pairs],
        [value(b) for _, b in pairs],
        [home_name(a.home) for a, _ in pairs],
    )
