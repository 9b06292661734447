"""Report of sessions as a self-contained HTML page: figures, map, pictures, plots, events."""

import base64
import io
import shlex
import time
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib import resources
from pathlib import Path
from typing import Final

import msgspec
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from app.export.line_plot import line_plot
from app.export.map_picture import draw_map, extent_of
from app.export.search_table import (
    efforts_of,
    is_found,
    outcome_text,
    places_of,
    places_text,
    search_table,
    table,
    table_row,
    total_effort,
)
from app.export.session_data import SessionData
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.control import decode
from app.messages.images import decode_color
from app.messages.status import GoalStatus
from app.recording.notes import readable_notes
from app.recording.session_goals import SessionSearch, runs_of, searches_of
from app.recording.timeline import MARKS
from app.view.colors import GREEN, ORANGE, SKY, hex_of
from app.view.model.attribute_colors import AttributeColor
from app.view.words import ENGLISH, Words

RESULT_FILE: Final = "result.json"
REVIEW_URL: Final = "http://127.0.0.1:8080/"
"""Address of `ippon review` with its default port."""
MAP_PX: Final = 900
MOST_PICTURES: Final = 10
_PICTURED: Final = ("found", "rejected", "detection", "contact")
"""Marks that pictures are shown for, the most important first. When a find of a tour is confirmed
the camera may look at something else."""
_PLOTS: Final = (
    (1, "report.best", "", hex_of(GREEN)),
    (2, "report.explored", "m²", hex_of(SKY)),
    (3, "report.path", "m", hex_of(SKY)),
    (4, "report.step", "ms", hex_of(ORANGE)),
)


@dataclass(frozen=True, slots=True)
class _Moment:
    title: str
    time_ns: int


class _Truth(msgspec.Struct, frozen=True, kw_only=True):
    correct: bool
    spl: float
    soft_spl: float


def write_report(session: SessionData, path: Path, say: Words = ENGLISH) -> None:
    """Write the page of one session."""
    write_reports([part_of(session, say)], path, say)


@dataclass(frozen=True, slots=True)
class ReportPart:
    """One session of a report."""

    title: str
    row: str
    """Row of the table of sessions."""
    found: int
    goals: int
    body: str


def part_of(session: SessionData, say: Words = ENGLISH) -> ReportPart:
    """Return what a report says of one session."""
    searches, driven_m = searches_of(session.timeline), session.driven_m()
    goals = [one.goal for one in searches]
    title = _title(session, goals, say)
    sections = [
        f"<p class=when>{escape(_when(session, goals, say))}</p>",
        _figures(session, searches, say),
        search_table(session.timeline, searches, say),
        _map(session, goals, say),
        _pictures(session, say),
        _plots(session, say),
        _events(session, say),
        _provenance(session, say),
    ]
    return ReportPart(
        title=title,
        row=table_row(
            escape(_started(session)),
            escape(session.name),
            escape(title),
            _seconds(session.recording.duration_s, say),
            "" if driven_m is None else f"{say.number(driven_m, 1)} m",
        ),
        found=sum(is_found(goal) for goal in goals),
        goals=len(goals),
        body="".join(sections),
    )


def write_reports(parts: Sequence[ReportPart], path: Path, say: Words = ENGLISH) -> None:
    """Write the page of several sessions: a table of them, then each; one stands by itself."""
    style = (resources.files("web_assets") / "report.css").read_text("utf-8")
    if len(parts) == 1:
        title = parts[0].title
        body = f"<h1>{escape(title)}</h1>{parts[0].body}"
    else:
        found, goals = sum(part.found for part in parts), sum(part.goals for part in parts)
        title = say("report.sessions", n=len(parts), found=found, all=goals)
        names = ("start", "session", "result", "recorded", "path")
        overview = table(names, [part.row for part in parts], say)
        body = f"<h1>{escape(title)}</h1>{overview}" + "".join(
            f"<h1>{escape(part.title)}</h1>{part.body}" for part in parts
        )
    page = (
        f'<!doctype html><html lang="{say.language}"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title>"
        f"<style>{style}</style></head><body><main>{body}</main></body></html>"
    )
    path.write_text(page, "utf-8")


def _title(session: SessionData, goals: Sequence[GoalStatus], say: Words) -> str:
    if not goals:
        return session.name
    if len(goals) == 1:
        (goal,) = goals
        return say("report.search", name=say.goal(goal), outcome=outcome_text(goal, say))
    return say("report.searches", n=len(goals), found=sum(is_found(goal) for goal in goals))


def _started(session: SessionData) -> str:
    start = time.localtime(session.recording.start_ns * 1e-9)
    return time.strftime("%Y-%m-%d %H:%M:%S", start)


def _when(session: SessionData, goals: Sequence[GoalStatus], say: Words) -> str:
    context = goals[0].context if len(goals) == 1 else ""
    said = f" · {say('report.said', context=context)}" if context else ""
    return f"{_started(session)} · {session.name}{said}"


def _figures(session: SessionData, searches: Sequence[SessionSearch], say: Words) -> str:
    last, goals = session.timeline.last, [one.goal for one in searches]
    runs = runs_of(session.timeline)
    cells = [("recorded", _seconds(session.recording.duration_s, say))]
    if goals:
        seconds, way = total_effort(efforts_of(runs, searches))
        cells += [
            ("time", f"{say.number(seconds, 1)} s"),
            ("path", f"{say.number(way, 1)} m"),
        ]
    if last is not None:
        cells += [
            ("explored", f"{say.number(last.explored_m2, 1)} m²"),
            # The status says it of its present search alone.
            *([("best", f"{say.percent(last.best_ooi)}")] if len(goals) < 2 else []),
            ("frames", f"{sum(run.last.frames for run in runs)}"),
        ]
    place = places_text(goals[0], say) if len(goals) == 1 else ""
    if place:
        cells.append(("place", escape(place)))
    truth = _truth(session)
    if truth is not None:
        right = say("report.yes" if truth.correct else "report.no")
        cells += [
            ("right", right),
            ("spl", say.number(truth.spl, 2)),
            ("soft_spl", say.number(truth.soft_spl, 2)),
        ]
    body = "".join(
        f"<div><dt>{escape(say(f'report.{name}'))}</dt><dd>{value}</dd></div>"
        for name, value in cells
    )
    return f"<dl>{body}</dl>"


def _seconds(seconds: float, say: Words) -> str:
    return f"{say.number(seconds)} s"


def _truth(session: SessionData) -> _Truth | None:
    """Return the simulation's ground truth of the search; None without one.

    A file of another program may have the same name.
    """
    try:
        return decode((session.recording.path.parent / RESULT_FILE).read_bytes(), _Truth)
    except (OSError, msgspec.DecodeError):
        return None


def _map(session: SessionData, goals: Sequence[GoalStatus], say: Words) -> str:
    indices, _ = session.scene.voxels.all_voxels()
    voxel_m = session.scene.voxel_size_m
    if voxel_m is None or not len(indices):
        return f"<h2>{escape(say('report.map'))}</h2><p>{escape(say('report.map.none'))}</p>"
    frame = extent_of(indices, voxel_m, MAP_PX)
    places = [position for goal in goals for _, position in places_of(goal)]
    modes: tuple[AttributeColor, ...] = ("camera", "ooi", "proximity")
    pictures = [(mode, draw_map(session.scene, frame, mode, places)) for mode in modes]
    body = "".join(
        f'<figure><img alt="" src="{_png(image)}"><figcaption>'
        f"{escape(say(f'report.map.{name}'))}</figcaption></figure>"
        for name, image in pictures
    )
    return f"<h2>{escape(say('report.map'))}</h2><div class=pictures>{body}</div>"


def _pictures(session: SessionData, say: Words) -> str:
    first = session.recording.first(keys.COLOR)
    if first is None:
        return ""
    moments = [_Moment(say("report.start"), first.time_ns)]
    marks = [mark for mark in session.timeline.marks if mark.kind in _PICTURED]
    # If there are many, the most important ones; in the order of the session.
    marks.sort(key=lambda mark: _PICTURED.index(mark.kind))
    marks = sorted(marks[:MOST_PICTURES], key=lambda mark: mark.time_ns)
    moments += [_Moment(say.said(mark.text), mark.time_ns) for mark in marks]
    moments.append(_Moment(say("report.end"), session.recording.end_ns))
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
        at = _clock(moment.time_ns - session.recording.start_ns, say)
        text = f"{at} {escape(moment.title)}"
        figures.append(
            f'<figure><img alt="" src="{source}"><figcaption>{text}</figcaption></figure>'
        )
    return f"<h2>{escape(say('report.images'))}</h2><div class=pictures>{''.join(figures)}</div>"


def _plots(session: SessionData, say: Words) -> str:
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
        line_plot(rows[0], rows[k], say(name), unit, color, decimal=say("number.decimal"))
        for k, name, unit, color in _PLOTS
    )
    return f"<h2>{escape(say('report.plots'))}</h2><div class=plots>{body}</div>"


def _events(session: SessionData, say: Words) -> str:
    start = session.recording.start_ns
    rows = [
        (e.time_ns, MARKS.get(e.event.kind, ""), say.said(e.event.text))
        for e in session.timeline.events
    ]
    rows += [(n.time_ns, "note", n.text) for n in readable_notes(session.recording.path)[0]]
    body = "".join(
        f"<tr><td>{_moment(at - start, say)}</td><th>{escape(_kind(kind, say))}</th>"
        f"<td>{escape(text)}</td></tr>"
        for at, kind, text in sorted(rows)
    )
    path = shlex.quote(str(session.path.absolute()))
    hint = say("report.events.hint", command=f"<code>ippon review {escape(path)}</code>")
    head = f"<h2>{escape(say('report.events'))}</h2><p class=when>{hint}</p>"
    return f"{head}<table>{body}</table>" if body else ""


def _kind(kind: str, say: Words) -> str:
    key = f"review.kind.{kind}"
    return say(key) if say.knows(key) else ""


def _moment(nanoseconds: int, say: Words) -> str:
    """Return a time that links to its moment in a review on this machine."""
    seconds = max(0.0, nanoseconds * 1e-9)
    return f"<a href='{REVIEW_URL}#t={seconds:.1f}'>{_clock(nanoseconds, say)}</a>"


def _provenance(session: SessionData, say: Words) -> str:
    versions = session.recording.index.metadata.get("ippon/versions", {})
    words = ", ".join(f"{escape(k)} {escape(v)}" for k, v in versions.items())
    problems = "".join(
        f"<p>{escape(say.said(text))}</p>"
        for text in (
            *session.recording.index.problems,
            *session.timeline.problems(),
            *readable_notes(session.recording.path)[1],
        )
    )
    return f"<h2>{escape(say('report.versions'))}</h2><p class=when>{words}</p>{problems}"


def _png(image: NDArray[np.uint8]) -> str:
    out = io.BytesIO()
    Image.fromarray(image).save(out, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(out.getvalue()).decode()}"


def _clock(nanoseconds: int, say: Words) -> str:
    minutes, tenths = divmod(max(0, round(nanoseconds * 1e-8)), 600)
    return f"{minutes}:{say.number(tenths / 10, 1).rjust(4, '0')}"
