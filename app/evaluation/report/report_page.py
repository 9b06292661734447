"""The report of an evaluation as a self-contained HTML page."""

import json
import math
import os
import shlex
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Final
from urllib.parse import quote

from app.evaluation.report.plots import failure_plot, goal_plot, interval_plot, success_curves
from app.evaluation.report.report_data import ReportData
from app.evaluation.results_folder import SESSIONS
from app.evaluation.version import program_of
from app.report_style import REPORT_STYLE
from ippon.evaluation.episode_generation import home_name
from ippon.evaluation.methods.method_table import method_named
from ippon.evaluation.methods.rule_share import MOSTLY, rule_note
from ippon.evaluation.outcome import FAILURES, Failure
from ippon.evaluation.row import EpisodeRow
from ippon.evaluation.statistics import PairedDifference
from ippon.evaluation.summary import (
    Effect,
    Losses,
    MethodSummary,
    Part,
    by_method,
    spl_by_goal,
)

_RECORDING: Final = "*/metadata.yaml"
"""Pattern of an episode's recordings, each in a folder named by its time."""
ENOUGH_HOMES: Final = 10
"""Number of homes below which a bootstrap over homes is too narrow."""
ENOUGH_EPISODES: Final = 200
"""Number of episodes below which the page warns about a small sample."""

_STYLE: Final = """
.legend span{margin-right:16px;white-space:nowrap}.legend i{display:inline-block;width:12px;
height:12px;margin-right:6px}
.legend b{display:inline-block;min-width:24px;margin-right:6px;vertical-align:middle}
.legend b+b{min-width:0}svg{width:100%;height:auto}
"""
_CAUSES: Final[Mapping[Failure, str]] = {
    "never_seen": "the object was never seen within mapping range",
    "seen_and_missed": "it was seen, but not found",
    "false_stop": "the robot reported a find at a wrong place",
    "wrong_instance": "the robot reported one of the object's kind in another colour",
    "out_of_reach": "the robot found the object and reported no path close to it",
    "collision": "contact with an obstacle and no motion during the last minute",
    "stuck": "no motion during the last minute, without contact",
    "time": "the map shows the object, but time ran out before the robot reached it",
}
_SECOND: Final = (
    '<p class="dim">With: searches for a second object from the end of the first search, with '
    "its map. Without: the same searches with an empty map. Neither is included in the tables "
    "above.</p>"
)


def report_page(data: ReportData) -> str:
    """Return the page."""
    groups = by_method(data.compared)
    parts = [
        "<h1>Search efficiency</h1>",
        _facts(data),
        *_warnings(data),
        "<h2>Methods</h2>",
        _methods_table(data.summaries),
        interval_plot(data.summaries),
    ]
    if data.comparisons:
        parts += [
            f"<h2>{escape(data.reference)} against each, on the same episodes</h2>",
            _pairs_table(data),
        ]
    if data.contexts:
        parts += ["<h2>Effect of a correct sentence</h2>", _effects_table(data.contexts)]
    if data.seconds:
        parts += ["<h2>Effect of a known home</h2>", _effects_table(data.seconds), _SECOND]
    parts += [
        "<h2>Success against path length</h2>",
        success_curves(groups),
        "<h2>SPL by goal</h2>",
        goal_plot(spl_by_goal(data.compared), list(groups)),
        "<h2>Why searches failed</h2>",
        failure_plot(data.summaries),
        _causes(),
        "<h2>By shortest path and by object</h2>",
        _parts_table(data.parts),
        *_losses(data.losses),
        *_episodes(data),
        *_recorded(data),
        "<h2>Set-up</h2>",
        "<details><summary>configuration</summary><pre>",
        escape(json.dumps(data.settings, indent=1)),
        "</pre></details>",
    ]
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>IPPON evaluation</title>'
        f"<style>{REPORT_STYLE}{_STYLE}</style><body>{''.join(parts)}</body></html>\n"
    )


def _facts(data: ReportData) -> str:
    homes = sorted({home_name(row.home) for row in data.rows})
    versions = sorted({row.version for row in data.rows})
    first = data.rows[0]
    shown = ", ".join(homes[:6]) + (f" … {homes[-1]}" if len(homes) > 6 else "")
    return (
        f"<p>{len(data.rows)} episodes in {len(homes)} homes ({escape(shown)}); robot "
        f"{escape(first.robot)}, images {first.image_width} × {first.image_height}.<br>"
        f'<span class="dim">{"<br>".join(escape(v) for v in versions)}</span></p>'
    )


def _warnings(data: ReportData) -> Iterable[str]:
    if data.errors:
        listed = ", ".join(data.errors[:5])
        yield (
            f'<p class="warn">{len(data.errors)} episodes failed with an error and are not '
            f"included below: {escape(listed)}.</p>"
        )
    for method, share in data.unruled.items():
        if share > 0.0:
            style = "warn" if share > MOSTLY else "dim"
            yield f'<p class="{style}">{escape(rule_note(method, share))}.</p>'
    if min(s.episodes for s in data.summaries) < ENOUGH_EPISODES:
        yield (
            f'<p class="warn">Small sample: fewer than {ENOUGH_EPISODES} episodes for some '
            "method. Read the intervals, not the means.</p>"
        )
    if min(s.homes for s in data.summaries) < ENOUGH_HOMES:
        yield (
            f'<p class="warn">Fewer than {ENOUGH_HOMES} homes for some method: its intervals over '
            "homes are too narrow.</p>"
        )
    if len({s.episodes for s in data.summaries}) > 1:
        yield (
            '<p class="warn">Methods ran different numbers of episodes; only the paired table '
            "compares the same ones.</p>"
        )
    if data.other_settings:
        listed = "; ".join(data.other_settings)
        yield f'<p class="warn">Folders with other settings: {escape(listed)}.</p>'
    if len({program_of(row.version) for row in data.rows}) > 1:
        yield '<p class="warn">Rows were made by different versions of the program.</p>'


def _methods_table(summaries: Sequence[MethodSummary]) -> str:
    head = (
        "method", "episodes", "success", "SPL", "SoftSPL", "find, s", "contacts", "time, s",
        "path, m",
        "planner p95, ms", "× real time",
    )  # fmt: skip
    body = [
        (
            s.method,
            str(s.episodes),
            _with_interval(s.success, s.success_ci95),
            _with_interval(s.spl, s.spl_ci95),
            _with_interval(s.soft_spl, s.soft_spl_ci95),
            "–" if s.find_s is None else f"{s.find_s:.0f}",
            f"{s.hits:.2f}",
            f"{s.time_s:.0f}",
            f"{s.path_length_m:.1f}",
            f"{s.planner_ms_p95:.0f}",
            f"{s.realtime_factor:.1f}",
        )
        for s in summaries
    ]
    names = "; ".join(f"{s.method}: {_summary_of(s.method)}" for s in summaries)
    return _table(head, body) + (
        '<p class="dim">Brackets: 95 % intervals, of success by Wilson\'s formula, else by a '
        'bootstrap over homes. "Find" is the median time '
        "to the find, a search without success counting as endless; it and the mean time are "
        f"simulated. The planner's is processor time of one core. {escape(names)}.</p>"
    )


def _summary_of(method: str) -> str:
    """Return the description of a method; rows may come from a version with other methods."""
    try:
        return method_named(method.partition(" (")[0]).summary
    except ValueError:
        return "unknown to this version"


def _pairs_table(data: ReportData) -> str:
    head = (
        "less", "pairs", "SPL difference", "p", "SPL ratio", "success difference", "p",
        "time to the find, ratio",
    )  # fmt: skip
    body = [
        (
            c.method,
            str(c.spl.pairs),
            _difference(c.spl),
            f"{c.spl.p:.3f}",
            _ratio(c.spl_ratio),
            _difference(c.success),
            f"{c.success_p:.3f}",
            _ratio(c.find_s_ratio),
        )
        for c in data.comparisons
    ]
    return _table(head, body) + (
        '<p class="dim">p of SPL: sign-flip test over homes; p of success: exact McNemar test; '
        "ratio of times: its finds over those of the reference, where both succeed.</p>"
    )


def _effects_table(effects: Sequence[Effect]) -> str:
    head = ("method", "pairs", "SPL with", "SPL without", "ratio", "difference", "p")
    body = [
        (
            e.method,
            str(e.difference.pairs),
            f"{e.spl_with:.3f}",
            f"{e.spl_without:.3f}",
            _ratio(e.ratio),
            _difference(e.difference),
            f"{e.difference.p:.3f}",
        )
        for e in effects
    ]
    return _table(head, body)


def _parts_table(parts: Sequence[Part]) -> str:
    body = [(p.name, p.method, str(p.episodes), f"{p.success:.2f}", f"{p.spl:.3f}") for p in parts]
    return _table(("episodes with", "method", "number", "success", "SPL"), body)


def _losses(losses: Sequence[Losses]) -> Iterable[str]:
    if not losses:
        return
    head = (
        "method", "episodes", "before the first view", "until it is in the map",
        "until a stop would count", "until the stop", "false stops", "other failures",
    )  # fmt: skip
    body = [
        (one.method, str(one.episodes), *(f"{x:.3f}" for x in losses_in_order(one)))
        for one in losses
    ]
    yield "<h2>Where SPL is lost</h2>"
    yield _table(head, body)
    yield (
        '<p class="dim">Shares of an SPL of 1. A straight way to the object from the end of each '
        "stage would have had an SPL of 1 less all losses so far; what a failure could still have "
        "had counts as lost by it.</p>"
    )


def losses_in_order(one: Losses) -> tuple[float, ...]:
    """Return the losses in the order in which a search passes them."""
    return (
        one.before_view, one.to_map, one.to_reach, one.to_stop, one.false_stops, one.other_failures,
    )  # fmt: skip


def _causes() -> str:
    listed = "; ".join(f"{cause.replace('_', ' ')}: {_CAUSES[cause]}" for cause in FAILURES)
    return f'<p class="dim">{escape(listed)}.</p>'


def _episodes(data: ReportData) -> Iterable[str]:
    """List every episode with its recordings and the command that records it."""
    groups = {
        "failed episodes": [r for r in data.rows if not r.success],
        "episodes that found the object": [r for r in data.rows if r.success],
        "searches for a second object, and their counterparts": data.later,
    }
    for what, rows in groups.items():
        if rows:
            lines = "".join(_episode(data, row) for row in rows)
            yield (
                f"<details><summary>{len(rows)} {what}, with the commands to record them</summary>"
                f"<table>{lines}</table></details>"
            )


def _episode(data: ReportData, row: EpisodeRow) -> str:
    folder = data.folders[row.episode_id, row.method]
    away = f"{row.distance_to_goal_m:.1f} m away"
    if math.isinf(row.distance_to_goal_m):
        away = "without a path to it"
    how = f"SPL {row.spl:.2f}" if row.success else away
    watch = f"<code>{escape(replay_command(folder, row))}</code>"
    if row.kind == "second":
        watch = "starts with the map of the search before it: record that one, or the fresh one"
    sessions = sorted((folder / SESSIONS / f"{row.episode_id}.{row.method}").glob(_RECORDING))
    links = " ".join(_link(data.folder, path.parent, "recording") for path in sessions)
    return (
        f"<tr><td>{escape(row.episode_id)}</td><td>{escape(row.method)}</td>"
        f"<td>{'found' if row.success else row.failure}</td><td>{how}</td>"
        f'<td>{links}</td><td class="wide">{watch}</td></tr>'
    )


def _link(folder: Path, session: Path, text: str) -> str:
    to = "/".join(quote(part) for part in Path(os.path.relpath(session, folder)).parts)
    return f'<a href="{to}/">{escape(text)}</a>'


def replay_command(folder: Path, row: EpisodeRow) -> str:
    """Return the command that runs an episode again and records it."""
    words = ["ippon", "eval", "replay", str(folder), row.episode_id, "--method", row.method]
    return shlex.join(words)


def _recorded(data: ReportData) -> Iterable[str]:
    """List the recordings of `ippon eval replay`."""
    folders = dict.fromkeys(data.folders.values())
    sessions = [p for one in folders for p in sorted((one / SESSIONS).glob(f"*/{_RECORDING}"))]
    if not sessions:
        yield ('<p class="dim">The command beside an episode records it for ippon review.</p>')
        return
    yield "<h2>Recorded episodes</h2><table>"
    for path in sessions:
        command = shlex.join(["ippon", "review", str(path.parent)])
        yield (
            f"<tr><td>{_link(data.folder, path.parent, path.parents[1].name)}</td>"
            f'<td class="wide"><code>{escape(command)}</code></td></tr>'
        )
    yield "</table>"


def _table(head: Sequence[str], body: Iterable[Sequence[str]]) -> str:
    top = "".join(f"<th>{escape(h)}</th>" for h in head)
    lines = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in line) + "</tr>" for line in body
    )
    return f"<table><tr>{top}</tr>{lines}</table>"


def _with_interval(value: float, interval: tuple[float, float] | None) -> str:
    return f"{value:.3f}" + ("" if interval is None else " [{:.2f}, {:.2f}]".format(*interval))


def _ratio(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _difference(d: PairedDifference) -> str:
    return f"{d.mean:+.3f}" + ("" if d.ci95 is None else " [{:+.2f}, {:+.2f}]".format(*d.ci95))
