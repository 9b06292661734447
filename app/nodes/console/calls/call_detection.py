"""Notices what needs a person, from the status and the events of the navigator."""

from collections import deque
from collections.abc import Sequence
from typing import Final

from app.messages.recording import RecordingStatus
from app.messages.status import Event, Status, goal_of, name_of
from app.nodes.console.calls.call import CallKind, Occasion
from app.view.model.unfound_goals import UnfoundGoals
from app.view.words import ENGLISH, Words

LASTS_S: Final = 5.0
"""Time that contact or position must be lost: shorter gaps need nobody."""
STUCK_TIMES: Final = 4
STUCK_S: Final = 60.0
"""So many times in this time the robot touched something or made no progress."""


_FINDS: Final[frozenset[CallKind]] = frozenset({"found", "perhaps", "out_of_reach"})

_Key = tuple[CallKind, object]


class CallDetection:
    """Compares what holds now with what held before; one thread calls it."""

    def __init__(self, say: Words = ENGLISH) -> None:
        self._words = say
        self._began_s: dict[_Key, float] = {}
        """Since when each condition holds."""
        self._told: set[_Key] = set()
        self._contacts_s: deque[float] = deque(maxlen=STUCK_TIMES)
        # The next goal may begin before the state of the end is seen.
        self._unfound = UnfoundGoals()

    @property
    def holding(self) -> frozenset[CallKind]:
        """Kinds of the occasions that have come up and hold still, or are finds."""
        return frozenset(kind for kind, _ in self._told)

    def hear(self, event: Event, now_s: float) -> None:
        """Take an event of the navigator."""
        if event.kind == "contact":
            self._contacts_s.append(now_s)

    def step(
        self,
        status: Status | None,
        recordings: Sequence[RecordingStatus],
        silence_s: float,
        now_s: float,
    ) -> list[Occasion]:
        """Return the occasions that have come up since the last call.

        Args:
            status: Last status of the navigator; None before the first.
            recordings: Last status of each recorder.
            silence_s: Time since the navigator was heard.
            now_s: Monotonic time.
        """
        if status is not None:
            self._unfound.follow(status, tuple)
        present: dict[_Key, tuple[Occasion, float]] = {
            (one.kind, key): (one, after_s)
            for one, key, after_s in self._conditions(status, recordings, silence_s, now_s)
        }
        self._began_s = {key: self._began_s.get(key, now_s) for key in present}
        # A find that waits while another one is judged has been called for.
        self._told = {key for key in self._told if key in present or key[0] in _FINDS}
        due: list[_Key] = [
            key
            for key, (_, after_s) in present.items()
            if key not in self._told and now_s - self._began_s[key] >= after_s
        ]
        self._told.update(due)
        return [present[key][0] for key in due]

    def _conditions(
        self,
        status: Status | None,
        recordings: Sequence[RecordingStatus],
        silence_s: float,
        now_s: float,
    ) -> list[tuple[Occasion, object, float]]:
        """Return what holds now, what tells it from others of its kind, and how long it must."""
        if status is None:
            return []
        found: list[tuple[Occasion, object, float]] = []
        if silence_s > LASTS_S:
            text = self._words("call.silent.text", n=f"{LASTS_S:g}")
            found.append((Occasion(kind="contact", text=text), "silence", 0.0))
        elif status.localization:
            lost = Occasion(kind="lost", text=status.localization)
            found.append((lost, None, LASTS_S))
        told = silence_s > LASTS_S or (status.localization and status.localization in status.why)
        if status.state == "lost" and not told:
            found.append((Occasion(kind="contact", text=status.why), "streams", LASTS_S))
        last = _find(status, self._words)
        found += [
            (find, (find.goal_id, find.position_world), 0.0)
            for find in (*_counted(status, self._words), *filter(None, (last,)))
        ]
        lost = self._unfound.latest
        if lost is not None:
            names = ", ".join(map(self._words.goal, lost.goals))
            text = self._words("call.not_found.text", name=names)
            number = lost.goal.goal_id
            ended = Occasion(kind="not_found", text=text, goal_id=number, object=name_of(lost.goal))
            found.append((ended, number, 0.0))
        recent = [at_s for at_s in self._contacts_s if now_s - at_s < STUCK_S]
        if len(recent) >= STUCK_TIMES:
            text = self._words("call.stuck.text", n=STUCK_TIMES, s=f"{STUCK_S:g}")
            found.append((Occasion(kind="stuck", text=text), None, 0.0))
        for one in recordings:
            if one.warning or one.state == "failed":
                text = one.warning or one.text
                which = (one.session, one.state)
                found.append((Occasion(kind="disk", text=text), which, 0.0))
        return found


def _counted(status: Status, say: Words) -> list[Occasion]:
    """Return the finds that wait for a verdict while the search goes on for more."""
    goals = status.tour or [goal for goal in (status.goal,) if goal is not None]
    return [
        Occasion(
            kind="found",
            text=say("call.found.text", name=say.numbered(goal, find.number)),
            goal_id=goal.goal_id,
            object=name_of(goal),
            position_world=find.position_world,
            find=find.number,
        )
        for goal in goals
        for find in goal.counted
        if not find.confirmed
    ]


def _find(status: Status, say: Words) -> Occasion | None:
    """Return the find that waits for a verdict; None without one."""
    find = status.find
    if find is None:
        return None
    goal = goal_of(status, find.goal_id)
    if goal is None or goal.confirmed or goal.outcome not in ("found", "out_of_reach"):
        return None
    name = say.find(goal, find.number)
    kind: CallKind = "perhaps" if find.perhaps else "found"
    text = say("call.found.text", name=name)
    if find.out_of_reach_m is not None:
        kind = "out_of_reach"
        text = say("call.out_of_reach.text", name=name, m=say.number(find.out_of_reach_m, 1))
    elif find.perhaps:
        text = say("call.perhaps.text", name=name)
    return Occasion(
        kind=kind,
        text=text,
        goal_id=find.goal_id,
        object=name_of(goal),
        position_world=find.position_world,
        find=find.number,
    )
