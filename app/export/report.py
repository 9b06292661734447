"""Report of a session as a self-contained HTML page: pictures, map, plots, events, figures."""

import base64
import io
import json
import time
from dataclasses import dataclass
from html import escape
from importlib import resources
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from app.export.line_plot import line_plot
from app.export.map_picture import draw_map, extent_of
from app.export.session_data import SessionData
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.images import decode_color
from app.recording.notes import read_notes
from app.view.colors import GREEN, ORANGE, SKY, hex_of

RESULT_FILE: Final = "result.json"
REVIEW_URL: Final = "http://127.0.0.1:8080/"
"""Address of `ippon review` with its default port."""
MAP_PX: Final = 900
MOST_PICTURES: Final = 10
OUTCOMES: Final = {
    "found": "found",
    "out_of_reach": "found, out of reach",
    "exhausted": "not found",
}
_PICTURED: Final = ("found", "rejected", "confirmed", "detection", "contact")
"""Marks that pictures are shown for, the most important first."""
_PLOTS: Final = (
    (1, "Best match", "", hex_of(GREEN)),
    (2, "Explored", "m²", hex_of(SKY)),
    (3, "Path", "m", hex_of(SKY)),
    (4, "Planner and map", "ms", hex_of(ORANGE)),
)


@dataclass(frozen=True, slots=True)
class _Moment:
    title: str
    time_ns: int


def write_report(session: SessionData, path: Path) -> None:
    """Write the page."""
    title = _title(session)
    parts = [
        f"<h1>{escape(title)}</h1><p class=when>{escape(_when(session))}</p>",
        _figures(session),
        _searches(session),
        _map(session),
        _pictures(session),
        _plots(session),
        _events(session),
        _provenance(session),
    ]
    style = (resources.files("web_assets") / "report.css").read_text("utf-8")
    page = (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{style}</style></head><body><main>{''.join(parts)}</main></body></html>"
    )
    path.write_text(page, "utf-8")


def _title(session: SessionData) -> str:
    last = session.timeline.last
    if last is None or last.goal is None:
        return session.name
    name = last.goal.object.replace("_", " ")
    outcome = OUTCOMES.get(last.goal.outcome, "not finished")
    return f"Search for {name}: {outcome}"


def _when(session: SessionData) -> str:
    start = time.localtime(session.recording.start_ns * 1e-9)
    last = session.timeline.last
    context = last.goal.context if last is not None and last.goal is not None else ""
    said = f" · “{context}”" if context else ""
    return f"{time.strftime('%Y-%m-%d %H:%M:%S', start)} · {session.name}{said}"


def _figures(session: SessionData) -> str:
    last = session.timeline.last
    cells = [("Recorded", f"{session.recording.duration_s:.0f} s")]
    if last is not None and last.goal is not None:
        seconds, way = _effort(session, last.goal.goal_id)
        cells += [("Search time", f"{seconds:.1f} s"), ("Path", f"{way:.1f} m")]
    if last is not None:
        cells += [
            ("Explored", f"{last.explored_m2:.1f} m²"),
            ("Best match", f"{last.best_ooi:.0%}"),
            ("Frames", f"{last.frames}"),
        ]
    truth = _truth(session)
    if truth is not None:
        right = "yes" if truth.get("correct") else "no"
        cells += [
            ("Right object", right),
            ("SPL", f"{float(truth.get('spl', 0.0)):.2f}"),
            ("SoftSPL", f"{float(truth.get('soft_spl', 0.0)):.2f}"),
        ]
    body = "".join(f"<div><dt>{name}</dt><dd>{value}</dd></div>" for name, value in cells)
    return f"<dl>{body}</dl>"


def _searches(session: SessionData) -> str:
    """Return a table of the searches if there are several."""
    last = session.timeline.last
    goals = [*last.history, *([last.goal] if last.goal else [])] if last is not None else []
    if len(goals) < 2:
        return ""
    rows: list[str] = []
    for goal in goals:
        seconds, way = _effort(session, goal.goal_id)
        cells = (
            escape(goal.object.replace("_", " ")),
            escape(goal.context),
            escape(goal.outcome.replace("_", " ")),
            f"{seconds:.1f} s",
            f"{way:.1f} m",
        )
        rows.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    names = ("Object", "Context", "Outcome", "Time", "Path")
    head = "".join(f"<th>{name}</th>" for name in names)
    return f"<h2>Searches</h2><table><tr>{head}</tr>{''.join(rows)}</table>"


def _effort(session: SessionData, goal_id: int) -> tuple[float, float]:
    """Return duration in seconds and path length in metres of one search, up to its end."""
    during = [
        s.status
        for s in session.timeline.statuses
        if s.status.goal is not None and s.status.goal.goal_id == goal_id
    ]
    # The clock of a search continues while its find waits for an answer.
    active = [s for s in during if s.goal is not None and s.goal.outcome == "active"] or during[:1]
    seconds = max((status.elapsed_s for status in active), default=0.0)
    return seconds, max((status.path_length_m for status in during), default=0.0)


def _truth(session: SessionData) -> dict[str, Any] | None:
    """Return the simulation's ground truth of the search, None without one."""
    try:
        truth = json.loads((session.recording.path.parent / RESULT_FILE).read_text("utf-8"))
    except (OSError, ValueError):
        return None
    return truth if isinstance(truth, dict) else None


def _map(session: SessionData) -> str:
    indices, _ = session.scene.voxels.all_voxels()
    voxel_m = session.scene.voxel_size_m
    if voxel_m is None or not len(indices):
        return "<h2>Map</h2><p>No map was recorded.</p>"
    frame = extent_of(indices, voxel_m, MAP_PX)
    pictures = [
        ("Camera colours, with the robot's trajectory", draw_map(session.scene, frame)),
        ("Probability of the object", draw_map(session.scene, frame, "ooi")),
        ("Proximity to the object", draw_map(session.scene, frame, "proximity")),
    ]
    body = "".join(
        f'<figure><img alt="" src="{_png(image)}"><figcaption>{text}</figcaption></figure>'
        for text, image in pictures
    )
    return f"<h2>Map from above</h2><div class=pictures>{body}</div>"


def _pictures(session: SessionData) -> str:
    first = session.recording.first(keys.COLOR)
    if first is None:
        return ""
    moments = [_Moment("Start", first.time_ns)]
    marks = [mark for mark in session.timeline.marks if mark.kind in _PICTURED]
    # If there are many, the most important ones; in the order of the session.
    marks.sort(key=lambda mark: _PICTURED.index(mark.kind))
    marks = sorted(marks[:MOST_PICTURES], key=lambda mark: mark.time_ns)
    moments += [_Moment(mark.text, mark.time_ns) for mark in marks]
    moments.append(_Moment("End", session.recording.end_ns))
    figures: list[str] = []
    for moment in moments:
        message = session.recording.latest(keys.COLOR, moment.time_ns)
        if message is None:
            continue
        try:
            encoded = decode_color(message.payload).encoded
        except MessageError:
            # A damaged picture is skipped.
            continue
        kind = "jpeg" if encoded.startswith(b"\xff\xd8") else "png"
        source = f"data:image/{kind};base64,{base64.b64encode(encoded).decode()}"
        at = _clock(moment.time_ns - session.recording.start_ns)
        text = f"{at} {escape(moment.title)}"
        figures.append(
            f'<figure><img alt="" src="{source}"><figcaption>{text}</figcaption></figure>'
        )
    return f"<h2>Camera images</h2><div class=pictures>{''.join(figures)}</div>"


def _plots(session: SessionData) -> str:
    statuses = session.timeline.statuses
    if len(statuses) < 2:
        return ""
    start = session.recording.start_ns
    rows = np.array(
        [
            (
                (s.time_ns - start) * 1e-9,
                s.status.best_ooi,
                s.status.explored_m2,
                s.status.path_length_m,
                s.status.timings.step_ms,
            )
            for s in statuses
        ],
        np.float64,
    ).T
    body = "".join(
        line_plot(rows[0], rows[k], name, unit, color) for k, name, unit, color in _PLOTS
    )
    return f"<h2>Over time</h2><div class=plots>{body}</div>"


def _events(session: SessionData) -> str:
    start = session.recording.start_ns
    rows = [(e.time_ns, e.event.kind, e.event.text) for e in session.timeline.events]
    rows += [(n.time_ns, n.kind, n.text) for n in read_notes(session.recording.path)]
    body = "".join(
        f"<tr><td>{_moment(at - start)}</td><th>{escape(kind.replace('_', ' '))}</th>"
        f"<td>{escape(text)}</td></tr>"
        for at, kind, text in sorted(rows)
    )
    name = escape(session.recording.path.name)
    hint = (
        f"<p class=when>A time opens that moment while <code>ippon review {name}</code> runs.</p>"
    )
    return f"<h2>Events</h2>{hint}<table>{body}</table>" if body else ""


def _moment(nanoseconds: int) -> str:
    """Return a time that links to its moment in a review on this machine."""
    seconds = max(0.0, nanoseconds * 1e-9)
    return f"<a href='{REVIEW_URL}#t={seconds:.1f}'>{_clock(nanoseconds)}</a>"


def _provenance(session: SessionData) -> str:
    versions = session.recording.index.metadata.get("ippon/versions", {})
    words = ", ".join(f"{escape(k)} {escape(v)}" for k, v in versions.items())
    problems = "".join(f"<p>{escape(text)}</p>" for text in session.recording.index.problems)
    return f"<h2>Recorded with</h2><p class=when>{words}</p>{problems}"


def _png(image: NDArray[np.uint8]) -> str:
    out = io.BytesIO()
    Image.fromarray(image).save(out, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(out.getvalue()).decode()}"


def _clock(nanoseconds: int) -> str:
    minutes, tenths = divmod(max(0, round(nanoseconds * 1e-8)), 600)
    return f"{minutes}:{tenths / 10:04.1f}"
