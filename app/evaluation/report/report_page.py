"""The report of an evaluation as a self-contained HTML page."""

import json
import math
import os
import shlex
from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path
from typing import Final
from urllib.parse import quote

from app.evaluation.report.plots import failure_plot, goal_plot, interval_plot, success_curves
from app.evaluation.report.report_data import ReportData
from app.evaluation.report.report_tables import (
    effects_table,
    losses_table,
    methods_table,
    pairs_table,
    parts_table,
)
from app.evaluation.report.report_warnings import warnings_of
from app.evaluation.results_folder import SESSIONS
from app.report_style import REPORT_STYLE
from ippon.evaluation.episode_generation import home_name
from ippon.evaluation.outcome import FAILURES, Failure
from ippon.evaluation.row import EpisodeRow
from ippon.evaluation.summary import by_method, spl_by_goal

_RECORDING: Final = "*/metadata.yaml"
"""Pattern of an episode's recordings, each in a folder named by its time."""

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
        methods_table(data.summaries),
        interval_plot(data.summaries),
    ]
    if data.comparisons:
        parts += [
            f"<h2>{escape(data.reference)} against each, on the same episodes</h2>",
            pairs_table(data),
        ]
    if data.contexts:
        parts += ["<h2>Effect of a correct sentence</h2>", effects_table(data.contexts)]
    if data.seconds:
        parts += ["<h2>Effect of a known home</h2>", effects_table(data.seconds), _SECOND]
    parts += [
        "<h2>Success against path length</h2>",
        success_curves(groups),
        "<h2>SPL by goal</h2>",
        goal_plot(spl_by_goal(data.compared), list(groups)),
        "<h2>Why searches failed</h2>",
        failure_plot(data.summaries),
        _causes(),
        *_given_up(data),
        "<h2>By shortest path and by object</h2>",
        parts_table(data.parts),
        *losses_table(data.losses),
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
    for text, minor in warnings_of(data):
        yield f'<p class="{"dim" if minor else "warn"}">{escape(text)}.</p>'


def _causes() -> str:
    listed = "; ".join(f"{cause.replace('_', ' ')}: {_CAUSES[cause]}" for cause in FAILURES)
    return f'<p class="dim">{escape(listed)}.</p>'


def _given_up(data: ReportData) -> Iterable[str]:
    """Say how many failures were no lack of time."""
    counts = [
        f"{s.method} {sum(s.given_up.values())} of {sum(s.failures.values())}"
        for s in data.summaries
        if s.failures
    ]
    if counts:
        yield (
            '<p class="dim">Failures that ended before their time, with nothing left to look at: '
            f"{escape(', '.join(counts))}.</p>"
        )


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
    ended = "nothing left to look at" if row.ending == "exhausted" else "ended"
    how = f"SPL {row.spl:.2f}" if row.success else f"{away}, {ended} after {row.time_s:.0f} s"
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
