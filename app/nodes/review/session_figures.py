"""What the page of a review tells of its sessions: figures, marks, notes, and where to begin."""

from typing import Final

import msgspec

from app.nodes.review.player import Player
from app.recording.notes import Note, readable_notes
from app.recording.reading.recording import Recording
from app.recording.session_goals import SessionGoal, goals_of, session_goal
from app.recording.timeline import SessionTimeline
from app.view.words import ENGLISH, Words

SHOWN_AFTER_S: Final = 0.3
"""Time after an event at which its effect is visible."""


class SessionFigures(msgspec.Struct, frozen=True, kw_only=True):
    """Key figures of a session."""

    name: str
    duration_s: float = 0.0
    path_length_m: float = 0.0
    explored_m2: float = 0.0
    best_ooi: float | None = 0.0
    """Probability of the best match; None for a session of several searches."""
    goals: list[SessionGoal] = []


class TimelineMark(msgspec.Struct, frozen=True, kw_only=True):
    """A mark, note or event on the timeline."""

    at_s: float
    kind: str
    text: str
    lane: int = 0
    """Session: 0 for the first, 1 for the second."""


class ReviewSession(msgspec.Struct, frozen=True, kw_only=True):
    """Sessions on the timeline."""

    sessions: list[SessionFigures]
    duration_s: float
    marks: list[TimelineMark]
    notes: list[TimelineMark]
    problems: list[str]
    has_list: bool = False
    """Whether there is a page that lists the sessions."""
    link: str = "/"
    """Path of the page that shows these sessions; `#t=SECONDS` after it opens a moment."""


def review_session(players: list[Player], say: Words = ENGLISH) -> ReviewSession:
    """Describe sessions on one timeline; notes that cannot be read are one of its problems.

    Args:
        players: The sessions; at least one.
        say: The words for what was said in them.
    """
    notes = [readable_notes(player.recording.path) for player in players]
    return ReviewSession(
        sessions=[figures_of(_name(p.recording), p.recording, p.timeline) for p in players],
        duration_s=max(p.recording.duration_s for p in players),
        marks=[
            _placed(mark.time_ns, mark.kind, say.said(mark.text), lane, player)
            for lane, player in enumerate(players)
            for mark in player.timeline.marks
        ],
        notes=[
            _placed(note.time_ns, note.kind, _signed(note), lane, player)
            for lane, player in enumerate(players)
            for note in notes[lane][0]
        ],
        problems=[
            say.said(one)
            for player, (_, unread) in zip(players, notes, strict=True)
            for one in (*player.recording.index.problems, *player.timeline.problems(), *unread)
        ],
    )


def opening_s(session: ReviewSession) -> float:
    """Return the moment at which a review opens: the last find, or else the end, in seconds."""
    finds = [mark.at_s for mark in session.marks if mark.kind == "found"]
    return min(max(finds) + SHOWN_AFTER_S, session.duration_s) if finds else session.duration_s


def figures_of(name: str, recording: Recording, timeline: SessionTimeline) -> SessionFigures:
    """Return the key figures of a session."""
    last = timeline.last
    if last is None:
        return SessionFigures(name=name, duration_s=recording.duration_s)
    goals = [session_goal(goal) for goal in goals_of(timeline)]
    return SessionFigures(
        name=name,
        duration_s=recording.duration_s,
        path_length_m=timeline.driven_m(),
        explored_m2=last.explored_m2,
        # The status says it of its present search alone.
        best_ooi=last.best_ooi if len(goals) < 2 else None,
        goals=goals,
    )


def _name(recording: Recording) -> str:
    path = recording.path
    return path.parent.name if path.name == "session_0.mcap" else path.stem


def _placed(time_ns: int, kind: str, text: str, lane: int, player: Player) -> TimelineMark:
    at_s = (time_ns - player.recording.start_ns) * 1e-9
    return TimelineMark(at_s=round(at_s, 3), kind=kind, text=text, lane=lane)


def _signed(note: Note) -> str:
    return f"{note.text} ({note.author})" if note.author not in {"", "review"} else note.text
