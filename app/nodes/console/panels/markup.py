"""HTML for the panels; `escape` makes every text from outside safe.

viser inserts HTML into the page unchanged, handlers included, so no other module builds HTML.
"""

import base64
from collections import defaultdict
from collections.abc import Iterable, Sequence
from html import escape as _escape

from app.messages.control import SentenceReading
from app.messages.driving import DriveStatus
from app.messages.status import Event, GoalStatus, LevelTable, Status, StreamStatus
from app.view.colors import LEVEL_COLORS, Legend, Rgb, hex_of
from app.view.model.candidates import Candidate
from ippon.guidance.language.requests.goals import Goal
from ippon.guidance.language.words import with_article
from ippon.guidance.levels import Level

LEVEL_ORDER: tuple[Level, ...] = (Level.CERTAIN, Level.NEAR, Level.AVERAGE, Level.FAR)

NAMED = 12
"""Labels of one level that are listed in full."""

GOALS_SHOWN = 8
"""Goals of a sentence that are shown in full."""

EXPORTS = (
    '<p class="ip-exports"><a href="/api/export/map.ply" download>Map (PLY)</a>'
    '<a href="/api/export/trail.csv" download>Trail (CSV)</a>'
    '<a href="/api/export/figures.csv" download>Plots (CSV)</a></p>'
    '<p class="ip-muted">The current state. For a mesh, video, report or scene of a recording: '
    "<code>ippon export</code></p>"
)

STATE_WORDS: dict[str, str] = {
    "starting": "Starting",
    "looking_around": "Looking around",
    "searching": "Searching",
    "approaching": "Approaching",
    "found": "Found",
    "exhausted": "Not found",
    "paused": "Paused",
    "manual": "Manual",
    "stopped": "Stopped",
    "lost": "Waiting for a stream",
    "ended": "The replay has ended",
}


def escape(text: str, limit: int = 400) -> str:
    """Make text safe inside HTML: markup escaped, control characters dropped, length bounded."""
    clean = "".join(c for c in text if c.isprintable() or c == " ")
    if len(clean) > limit:
        clean = clean[: limit - 1] + "…"
    return _escape(clean, quote=True)


def words(label: str) -> str:
    """Return a label with spaces for underscores, escaped."""
    return escape(label.replace("_", " "))


def swatch(color: Rgb) -> str:
    """Return a small square of a colour."""
    return f'<i class="ip-swatch" style="background:{hex_of(color)}"></i>'


def now(status: Status | None) -> str:
    """Return the state of the robot and the reason for it."""
    if status is None:
        return '<div class="ip-now"><p class="ip-muted">No data from the navigator yet.</p></div>'
    state = STATE_WORDS[status.state]
    if status.find is not None and status.find.out_of_reach_m is not None:
        state = "Found, out of reach:" if status.state == "found" else state
    goal = f" <b>{words(status.goal.object)}</b>" if status.goal is not None else ""
    return (
        f'<div class="ip-now" data-state="{status.state}">'
        f'<p class="ip-state">{state}{goal}</p>'
        f'<p class="ip-why">{escape(status.why)}</p></div>'
    )


def answer(text: str, *, ok: bool) -> str:
    """Return the result of the last command."""
    if not text:
        return ""
    kind = "ok" if ok else "bad"
    return f'<p class="ip-answer ip-{kind}">{escape(text)}</p>'


def understood(reading: SentenceReading) -> str:
    """Return a line of chips for each goal, and below them what is doubtful or not used."""
    lines = [_line(goal, number) for number, goal in enumerate(reading.goals[:GOALS_SHOWN])]
    if len(reading.goals) > GOALS_SHOWN:
        lines.append(f'<p class="ip-muted">and {len(reading.goals) - GOALS_SHOWN} more</p>')
    told = [f"“{words}” was not understood" for words in reading.unused]
    told += reading.notes
    if reading.note:
        told.append(f"Read by rules: {reading.note}")
    lines += [f'<p class="ip-muted">{escape(text)}</p>' for text in told]
    if reading.doubtful:
        lines.append(f'<p class="ip-answer ip-bad">{escape(reading.because)}</p>')
    return "".join(lines)


def _line(goal: Goal, number: int) -> str:
    order = goal.order if number else "Look for"
    chips = [f"<b>{_chip(goal.object)}</b>"]
    if goal.count != 1:
        chips.append(_chip(f"× {goal.count}"))
    if goal.refers_to:
        chips.append(_chip(goal.refers_to))
    chips += [_chip(f"not {one.value}" if one.negated else one.value) for one in goal.attributes]
    chips += [_chip(place.text) for place in goal.relations]
    return f'<p class="ip-understood">{order} {" ".join(chips)}</p>'


def _chip(text: str) -> str:
    return f'<span class="ip-chip">{escape(text, 80)}</span>'


def choice(chosen: str, text: str) -> str:
    """Return the description of a choice; the style sheet highlights the button it names."""
    return f'<p class="ip-choice" data-choice="{escape(chosen)}">{escape(text)}</p>'


def intervention(drive: DriveStatus) -> str:
    """Return the safety filter's intervention, or the waypoint that the robot drives to."""
    if drive.intervention:
        return f'<p class="ip-answer ip-bad">{escape(drive.intervention)}</p>'
    if drive.waypoint is not None:
        x, y = drive.waypoint
        return f'<p class="ip-answer ip-ok">Driving to ({x:.1f}, {y:.1f}).</p>'
    return ""


def goals(queue: Iterable[GoalStatus], history: Iterable[GoalStatus]) -> str:
    """List the goals of a tour and the waiting ones, and the last four finished ones."""
    rows = [
        f"<li><b>{words(goal.object)}</b> <span>{words(goal.outcome)}</span></li>"
        for goal in (*queue, *list(history)[::-1][:4])
    ]
    if not rows:
        return ""
    hint = (
        '<p class="ip-muted">Change the order, repeat, save: press <b>Goals</b> on the map (G).</p>'
    )
    return f'<ul class="ip-goals">{"".join(rows)}</ul>{hint}'


def not_found(count: int) -> str:
    """Return the heading of the candidate list after a search without a find."""
    text = (
        "Most likely places, best first:"
        if count
        else "Nothing in the map looks like the object. Try another name or add context."
    )
    return f'<p class="ip-not-found">{text}</p>'


def candidate(
    number: int, place: Candidate, picture: bytes | None, label: str, start_ns: int
) -> str:
    """Return one candidate: image, probability, position, and when it was seen."""
    x, y, z = place.point_world
    image = '<span class="ip-no-picture">no image</span>'
    seen = "no image available"
    if picture is not None and place.picture is not None:
        data = base64.b64encode(picture).decode()
        image = f'<img alt="" src="data:image/jpeg;base64,{data}">'
        since_ns = place.picture.picture.stamp_ns - start_ns
        when = "before this search" if since_ns < 0 else f"at {_clock(since_ns)}"
        seen = f"seen {when} from {place.picture.depth_m:.1f} m"
    taken_for = f"classified as: {words(label)}<br>" if label else ""
    return (
        f'<div class="ip-candidate">{image}<p><b>{number}</b> {place.probability:.0%} likely<br>'
        f"{taken_for}<span>at ({x:.1f}, {y:.1f}) m, {z:.1f} m high<br>{seen}</span></p></div>"
    )


def levels(table: LevelTable | None) -> str:
    """Return the table of labels by level, the nearest first."""
    if table is None:
        return (
            '<div class="ip-levels"><p class="ip-muted">Start a search to see how near '
            "to it each kind of object is likely to be.</p></div>"
        )
    by_level: dict[str, list[str]] = defaultdict(list)
    for row in table.rows:
        by_level[row.level].append(words(row.label))
    rows = "".join(
        f"<tr><th>{swatch(LEVEL_COLORS[level])}{name}</th><td>{_some(by_level[name])}</td></tr>"
        for level in LEVEL_ORDER
        for name in (level.text,)
    )
    sought = escape(with_article(table.object.replace("_", " ")))
    asking = f"waiting for {table.asking}; using for now: " if table.asking else ""
    lines = [asking + table.provider, *table.notes[:3]] if asking else table.notes[:3]
    notes = "".join(f'<p class="ip-muted">{escape(note)}</p>' for note in lines)
    cached = ", cached" if table.from_cache else ""
    return (
        f'<div class="ip-levels"><p class="ip-title">Levels for {sought}'
        f"<span>{escape(table.provider, 40)}, {_milliseconds(table.elapsed_ms)}{cached}</span></p>"
        f"<table>{rows}</table>{notes}</div>"
    )


def _some(labels: list[str]) -> str:
    """Join labels; a long list is cut, because the reasons below list every label."""
    if len(labels) <= NAMED:
        return ", ".join(labels) or "–"
    return f"{', '.join(labels[: NAMED - 2])} <i>and {len(labels) - NAMED + 2} more</i>"


def conversation(table: LevelTable) -> str:
    """Return the exact prompt to the language model and its reply."""
    when = "cached from an earlier search" if table.from_cache else "asked for this search"
    return (
        f'<div class="ip-chat"><p class="ip-title">Question<span>{when}</span></p>'
        f"<div>{_paragraphs(table.prompt)}</div>"
        f'<p class="ip-title">Answer<span>{_milliseconds(table.elapsed_ms)}</span></p>'
        f"<div>{_paragraphs(table.reply or 'none')}</div></div>"
    )


def _paragraphs(text: str, most: int = 500) -> str:
    """Escape a text of many lines; after `most` lines it is cut, with a note."""
    lines = text.splitlines()
    cut = [f"… {len(lines) - most} more lines"] if len(lines) > most else []
    return "".join(f"<p>{escape(line, 4000)}</p>" for line in (*lines[:most], *cut))


def reasons(table: LevelTable | None) -> str:
    """List every label with its level and the reason for it."""
    if table is None:
        return '<p class="ip-muted">No levels yet.</p>'
    order = {level.text: n for n, level in enumerate(LEVEL_ORDER)}
    rows = "".join(
        f"<tr><td>{swatch(LEVEL_COLORS[Level.parse(row.level)])}</td>"
        f"<th>{words(row.label)}</th><td>{escape(row.reason)}</td></tr>"
        for row in sorted(table.rows, key=lambda row: order[row.level])
    )
    return f'<div class="ip-reasons"><table>{rows}</table></div>'


def legend(shown: Legend, mode: str = "") -> str:
    """Return a legend; the style sheet highlights the button named in `data-mode`."""
    ramp = ""
    if shown.ramp is not None:
        stops = ",".join(hex_of((r, g, b)) for r, g, b in shown.ramp[::17].tolist())
        ramp = (
            f'<div class="ip-ramp"><span>{escape(shown.low)}</span>'
            f'<i style="background:linear-gradient(90deg,{stops})"></i>'
            f"<span>{escape(shown.high)}</span></div>"
        )
    entries = "".join(
        f"<span>{swatch(entry.color)}{escape(entry.text)}</span>" for entry in shown.entries
    )
    return (
        f'<div class="ip-legend" data-mode="{escape(mode)}">'
        f'<p class="ip-title">{escape(shown.title)}</p>{ramp}'
        f'<div class="ip-entries">{entries}</div></div>'
    )


def warnings(notes: Sequence[str]) -> str:
    """Return the current warnings."""
    return "".join(
        f'<p class="ip-warning">{escape(note[:1].upper() + note[1:])}</p>' for note in notes
    )


def figures(status: Status | None, voxels: int) -> str:
    """Show the key figures of the session."""
    if status is None:
        return '<p class="ip-muted">No figures yet.</p>'
    timings = status.timings
    first = "–" if timings.first_motion_s is None else f"{timings.first_motion_s:.1f} s"
    cells = [
        ("Best match", f"{status.best_ooi:.0%}"),
        ("Explored", f"{status.explored_m2:.1f} m²"),
        ("Path", f"{status.path_length_m:.1f} m"),
        ("Frames", f"{status.frames}"),
        ("Surface voxels", f"{voxels:,}".replace(",", "\u2009")),
        ("First motion", first),
        ("Step", _milliseconds(timings.step_ms)),
        ("Map", _milliseconds(timings.map_ms)),
        ("Plan", _milliseconds(timings.plan_ms)),
    ]
    body = "".join(f"<div><dt>{name}</dt><dd>{value}</dd></div>" for name, value in cells)
    return f'<dl class="ip-figures">{body}</dl>'


def streams(rows: Iterable[StreamStatus]) -> str:
    """Show the health of the robot's streams."""
    body = "".join(
        f'<tr data-late="{int(row.age_s is None or row.age_s > 1.0)}"><th>{escape(row.name)}</th>'
        f"<td>{row.rate_hz:.1f} Hz</td><td>{_age(row.age_s)}</td>"
        f"<td>{row.dropped + row.rejected or ''}</td></tr>"
        for row in rows
    )
    if not body:
        return '<p class="ip-muted">No streams yet.</p>'
    head = "<tr><th>Stream</th><td>rate</td><td>age</td><td>lost</td></tr>"
    return (
        f'<div class="ip-streams"><table><thead>{head}</thead><tbody>{body}</tbody></table></div>'
    )


def event_log(events: Iterable[Event], start_ns: int) -> str:
    """List the latest events, the newest first."""
    rows = "".join(
        f'<li data-kind="{event.kind}"><time>{_clock(event.stamp_ns - start_ns)}</time>'
        f"<span>{escape(event.text)}</span></li>"
        for event in list(events)[-14:][::-1]
    )
    return f'<ol class="ip-log">{rows}</ol>' if rows else '<p class="ip-muted">No events yet.</p>'


def _milliseconds(value: float) -> str:
    return f"{value:.0f} ms" if value >= 10.0 else f"{value:.1f} ms"


def _age(age_s: float | None) -> str:
    return "never" if age_s is None else f"{age_s:.1f} s"


def _clock(nanoseconds: int) -> str:
    seconds = max(0, nanoseconds // 1_000_000_000)
    return f"{seconds // 60}:{seconds % 60:02d}"
