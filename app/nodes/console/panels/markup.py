"""HTML for the panels; `escape` makes every text from outside safe.

viser inserts HTML into the page unchanged, handlers included, so no other module builds HTML.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from html import escape as _escape
from typing import Any

from app.messages.control import SentenceReading
from app.messages.status import Event, GoalStatus, LevelTable, Status, StreamStatus
from app.nodes.console.link.commands import CommandError
from app.view.colors import LEVEL_COLORS, Legend, Rgb, hex_of
from app.view.shown_state import shown_state
from app.view.words import Words
from ippon.guidance.language.goals.goal import Goal
from ippon.guidance.language.words import with_article
from ippon.guidance.levels import Level

Try = Callable[[Callable[[], str]], None]
"""Runs a command of a part of a panel."""

LEVEL_ORDER: tuple[Level, ...] = (Level.CERTAIN, Level.NEAR, Level.AVERAGE, Level.FAR)

NAMED = 12
"""Labels of one level that are listed in full."""

FINDS = ("found", "perhaps")
"""States with a find that waits for a verdict."""

GOALS_SHOWN = 8
"""Goals of a sentence that are shown in full."""


def escape(text: str, limit: int = 400) -> str:
    """Make text safe inside HTML: markup escaped, control characters dropped, length bounded."""
    clean = "".join(c for c in text if c.isprintable() or c == " ")
    if len(clean) > limit:
        clean = clean[: limit - 1] + "…"
    return _escape(clean, quote=True)


def swatch(color: Rgb) -> str:
    """Return a small square of a colour."""
    return f'<i class="ip-swatch" style="background:{hex_of(color)}"></i>'


def exports(say: Words) -> str:
    """Return the links to what can be exported now, relative to the page of the scene."""
    links = [("map.ply", "map"), ("trail.csv", "trail"), ("figures.csv", "plots")]
    body = "".join(
        f'<a href="../api/export/{file}" download>{escape(say(f"panel.export.{name}"))}</a>'
        for file, name in links
    )
    hint = escape(say("panel.export.hint"))
    return f'<p class="ip-exports">{body}</p>{muted(f"{hint} <code>ippon export</code>")}'


def muted(html: str) -> str:
    """Return a paragraph of quiet text; `html` is escaped already."""
    return f'<p class="ip-muted">{html}</p>'


def now(status: Status | None, say: Words) -> str:
    """Return the state of the robot and the reason for it."""
    if status is None:
        return f'<div class="ip-now">{muted(escape(say("panel.no_data")))}</div>'
    shown = shown_state(status)
    state = say(f"panel.state.{shown}")
    if status.find is not None and status.find.out_of_reach_m is not None:
        state = say("panel.state.unreachable") if shown in FINDS else state
    head = escape(state)
    if status.goal is not None:
        head = say("panel.now", state=head, goal=f"<b>{escape(say.goal(status.goal))}</b>")
    return (
        f'<div class="ip-now" data-state="{shown}">'
        f'<p class="ip-state">{head}</p>'
        f'<p class="ip-why">{escape(status.why)}</p></div>'
    )


def answer(text: str, *, ok: bool) -> str:
    """Return the result of the last command."""
    if not text:
        return ""
    kind = "ok" if ok else "bad"
    return f'<p class="ip-answer ip-{kind}">{escape(text)}</p>'


def attempt(line: Any, command: Callable[[], str]) -> bool:
    """Run a command and show its result in a line; return whether it was carried out."""
    try:
        line.content = answer(command(), ok=True)
    except CommandError as error:
        line.content = answer(str(error), ok=False)
        return False
    return True


def understood(reading: SentenceReading, say: Words) -> str:
    """Return a line of chips for each goal, and below them what is doubtful or not used."""
    lines = [_line(goal, number, say) for number, goal in enumerate(reading.goals[:GOALS_SHOWN])]
    if len(reading.goals) > GOALS_SHOWN:
        more = say("panel.understood.more", n=len(reading.goals) - GOALS_SHOWN)
        lines.append(muted(escape(more)))
    told = [say("panel.understood.unused", words=words) for words in reading.unused]
    told += reading.notes
    if reading.note:
        told.append(say("panel.understood.rules", note=reading.note))
    asked = reading.because.casefold() if reading.doubtful else ""
    lines += [muted(escape(text)) for text in told if text.casefold() not in asked]
    if reading.doubtful:
        lines.append(f'<p class="ip-answer ip-bad">{escape(reading.because)}</p>')
    return "".join(lines)


def _line(goal: Goal, number: int, say: Words) -> str:
    order = escape(say(f"panel.understood.{goal.order if number else 'look'}"))
    chips = [f"<b>{_chip(say.name(goal.object))}</b>"]
    if goal.count != 1:
        count = say("panel.understood.all") if goal.count == "all" else f"× {goal.count}"
        chips.append(_chip(count))
    if goal.refers_to:
        chips.append(_chip(say(f"panel.understood.{goal.refers_to}")))
    for one in goal.attributes:
        value = say.attribute(one.value)
        chips.append(_chip(say("panel.understood.not", value=value) if one.negated else value))
    chips += [_chip(place.text) for place in goal.relations]
    return f'<p class="ip-understood">{order} {" ".join(chips)}</p>'


def _chip(text: str) -> str:
    return f'<span class="ip-chip">{escape(text, 80)}</span>'


def choice(chosen: str, text: str) -> str:
    """Return the description of a choice; the style sheet highlights the button it names."""
    return f'<p class="ip-choice" data-choice="{escape(chosen)}">{escape(text)}</p>'


def goals(
    queue: Iterable[GoalStatus],
    history: Iterable[GoalStatus],
    say: Words,
    *,
    recorded: bool = False,
) -> str:
    """List the goals of a tour and the waiting ones, and the last four finished ones.

    Args:
        queue: The goals of the tour and the waiting ones.
        history: The finished ones.
        say: The words.
        recorded: Nothing can be changed about them.
    """
    rows = [
        f"<li><b>{escape(say.goal(goal))}</b> <span>{escape(outcome)}</span></li>"
        for goal in (*queue, *list(history)[::-1][:4])
        for outcome in (_outcome(goal, say),)
    ]
    if not rows:
        return ""
    hint = "" if recorded else muted(escape(say("panel.goals.hint")))
    return f'<ul class="ip-goals">{"".join(rows)}</ul>{hint}'


def _outcome(goal: GoalStatus, say: Words) -> str:
    """Return how far a goal is, and how many are found where several are wanted."""
    is_find = goal.outcome in ("found", "out_of_reach")
    parts = [say(f"panel.outcome.{goal.outcome}")]
    if is_find:
        parts.append(say(f"panel.outcome.{'confirmed' if goal.confirmed else 'unconfirmed'}"))
    if goal.count != 1:
        found = len(goal.counted) + is_find
        key = "goals.count.all" if goal.count == "all" else "goals.count.some"
        parts.append(say(key, found=found, count=goal.count))
    return ", ".join(parts)


def levels(table: LevelTable | None, say: Words) -> str:
    """Return the table of labels by level, the nearest first."""
    if table is None:
        return f'<div class="ip-levels">{muted(escape(say("panel.levels.none")))}</div>'
    by_level: dict[str, list[str]] = defaultdict(list)
    for row in table.rows:
        by_level[row.level].append(escape(say.name(row.label)))
    rows = "".join(
        f"<tr><th>{swatch(LEVEL_COLORS[level])}{escape(say(f'panel.level.{level.text}'))}</th>"
        f"<td>{_some(by_level[level.text], say)}</td></tr>"
        for level in LEVEL_ORDER
    )
    sought = say.name(table.object)
    sought = with_article(sought) if say.language == "en" else sought
    title = escape(say("panel.levels.title", object=sought))
    lines = list(table.notes[:3])
    if table.asking:
        asking = say("panel.levels.asking", asking=table.asking, provider=table.provider)
        lines.insert(0, asking)
    notes = "".join(muted(escape(note)) for note in lines)
    source = say(
        "panel.levels.cached" if table.from_cache else "panel.levels.fresh",
        provider=table.provider[:40],
        time=_milliseconds(table.elapsed_ms, say),
    )
    return (
        f'<div class="ip-levels"><p class="ip-title">{title}<span>{escape(source)}</span></p>'
        f"<table>{rows}</table>{notes}</div>"
    )


def _some(labels: list[str], say: Words) -> str:
    """Join labels; a long list is cut, because the reasons below list every label."""
    if len(labels) <= NAMED:
        return ", ".join(labels) or "–"
    more = escape(say("panel.levels.more", n=len(labels) - NAMED + 2))
    return f"{', '.join(labels[: NAMED - 2])} <i>{more}</i>"


def conversation(table: LevelTable, say: Words) -> str:
    """Return the exact prompt to the language model and its reply."""
    when = escape(say("panel.chat.cached" if table.from_cache else "panel.chat.asked"))
    question, reply = escape(say("panel.chat.question")), escape(say("panel.chat.answer"))
    return (
        f'<div class="ip-chat"><p class="ip-title">{question}<span>{when}</span></p>'
        f"<div>{_paragraphs(table.prompt, say)}</div>"
        f'<p class="ip-title">{reply}<span>{_milliseconds(table.elapsed_ms, say)}</span></p>'
        f"<div>{_paragraphs(table.reply or say('panel.chat.none'), say)}</div></div>"
    )


def _paragraphs(text: str, say: Words, most: int = 500) -> str:
    """Escape a text of many lines; after `most` lines it is cut, with a note."""
    lines = text.splitlines()
    cut = [say("panel.chat.more", n=len(lines) - most)] if len(lines) > most else []
    return "".join(f"<p>{escape(line, 4000)}</p>" for line in (*lines[:most], *cut))


def reasons(table: LevelTable | None, say: Words) -> str:
    """List every label with its level and the reason for it."""
    if table is None:
        return muted(escape(say("panel.levels.no_reasons")))
    order = {level.text: n for n, level in enumerate(LEVEL_ORDER)}
    rows = "".join(
        f"<tr><td>{swatch(LEVEL_COLORS[Level.parse(row.level)])}</td>"
        f"<th>{escape(say.name(row.label))}</th><td>{escape(row.reason)}</td></tr>"
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


def figures(status: Status | None, voxels: int, say: Words) -> str:
    """Show the key figures of the session."""
    if status is None:
        return muted(escape(say("panel.figures.none")))
    timings = status.timings
    first_s = timings.first_motion_s
    cells = [
        ("best", say.percent(status.best_ooi)),
        ("explored", f"{say.number(status.explored_m2, 1)} m²"),
        ("path", f"{say.number(status.path_length_m, 1)} m"),
        ("frames", f"{status.frames}"),
        ("voxels", f"{voxels:,}".replace(",", "\u2009")),
        ("first", "–" if first_s is None else f"{say.number(first_s, 1)} s"),
        ("step", _milliseconds(timings.step_ms, say)),
        ("map", _milliseconds(timings.map_ms, say)),
        ("plan", _milliseconds(timings.plan_ms, say)),
    ]
    body = "".join(
        f"<div><dt>{escape(say(f'panel.figures.{name}'))}</dt><dd>{value}</dd></div>"
        for name, value in cells
    )
    return f'<dl class="ip-figures">{body}</dl>'


def streams(rows: Iterable[StreamStatus], say: Words) -> str:
    """Show the health of the robot's streams."""
    body = "".join(
        f'<tr data-late="{int(row.age_s is None or row.age_s > 1.0)}"><th>{escape(row.name)}</th>'
        f"<td>{say.number(row.rate_hz, 1)} Hz</td><td>{_age(row.age_s, say)}</td>"
        f"<td>{row.dropped + row.rejected or ''}</td></tr>"
        for row in rows
    )
    if not body:
        return muted(escape(say("panel.streams.none")))
    names = [escape(say(f"panel.streams.{name}")) for name in ("rate", "age", "lost")]
    cells = "".join(f"<td>{name}</td>" for name in names)
    head = f"<tr><th>{escape(say('panel.streams.stream'))}</th>{cells}</tr>"
    return (
        f'<div class="ip-streams"><table><thead>{head}</thead><tbody>{body}</tbody></table></div>'
    )


def event_log(events: Iterable[Event], start_ns: int, say: Words) -> str:
    """List the latest events, the newest first."""
    rows = "".join(
        f'<li data-kind="{event.kind}"><time>{clock(event.stamp_ns - start_ns)}</time>'
        f"<span>{escape(event.text)}</span></li>"
        for event in list(events)[-14:][::-1]
    )
    return f'<ol class="ip-log">{rows}</ol>' if rows else muted(escape(say("panel.events.none")))


def _milliseconds(value: float, say: Words) -> str:
    return f"{say.number(value, 0 if value >= 10.0 else 1)} ms"


def _age(age_s: float | None, say: Words) -> str:
    return escape(say("panel.streams.never")) if age_s is None else f"{say.number(age_s, 1)} s"


def clock(nanoseconds: int) -> str:
    """Return a time as minutes and seconds."""
    seconds = max(0, nanoseconds // 1_000_000_000)
    return f"{seconds // 60}:{seconds % 60:02d}"
