"""What a search for several has found so far, each to be confirmed or rejected by itself."""

from dataclasses import dataclass
from typing import Any, Final

from app.messages.status import CountedFind, FindReport, GoalStatus, Status
from app.nodes.console.link.commands import Actions, CommandError
from app.nodes.console.panels.find_markup import counted_find, counted_head
from app.nodes.console.panels.markup import Try
from app.view.colors import QUIET
from app.view.words import Words

LISTED: Final = 6
"""Finds with buttons; a find that is confirmed makes room for the next one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedFind:
    """A find with its goal."""

    goal_id: int
    name: str
    find: CountedFind


class VerdictButtons:
    """Confirm and reject the find that is shown."""

    def __init__(self, gui: Any, box: Any, actions: Actions, attempt: Try) -> None:
        self._gui, self._box, self._actions, self._attempt = gui, box, actions, attempt
        self._judged: tuple[int, int | None] | None = None
        """Numbers of goal and find that the buttons are about."""
        self._buttons: tuple[Any, ...] = ()

    def show(self, find: FindReport | None, *, waits: bool) -> None:
        """Offer the verdict on a find while it waits for one."""
        judged = None if find is None else (find.goal_id, find.number or None)
        if judged is not None and judged != self._judged and not self._actions.recorded:
            self._build(judged)
        for button in self._buttons:
            button.visible = waits

    def _build(self, judged: tuple[int, int | None]) -> None:
        """Build the buttons of a find anew: a press that is under way judges no other."""
        for button in self._buttons:
            button.remove()
        self._judged, actions, say = judged, self._actions, self._actions.say
        with self._box:
            confirm = self._gui.add_button(say("panel.search.confirm"), color=(0, 121, 90))
            reject = self._gui.add_button(say("panel.search.reject"), color=QUIET)
        confirm.on_click(lambda _: self._attempt(lambda: actions.confirm_find(*judged)))
        reject.on_click(lambda _: self._attempt(lambda: actions.reject_find(*judged)))
        self._buttons = (confirm, reject)


class CountedFindsPanel:
    """Builds this list inside the Search tab."""

    def __init__(self, gui: Any, actions: Actions, attempt: Try) -> None:
        self._actions = actions
        say = self._words = actions.say
        self._shown: list[JudgedFind | None] = [None] * LISTED
        self._free = list(range(LISTED))
        """Rows without a find, the one that has been free longest first."""
        self._head = gui.add_html("", visible=False)
        self._rows: list[tuple[Any, Any]] = []
        for n in range(LISTED):
            text = gui.add_html("", visible=False)
            buttons = gui.add_button_group(
                say("panel.counted.find", n=n + 1),
                (say("panel.counted.confirm"), say("panel.counted.reject")),
                visible=False,
            )
            buttons.on_click(lambda event, n=n: attempt(lambda: self._judge(n, event.target.value)))
            self._rows.append((text, buttons))

    def show(self, status: Status) -> None:
        """List the finds that wait to be judged, and name the confirmed ones."""
        finds = judged_finds(status, self._words)
        waiting = [one for one in reversed(finds) if not one.find.confirmed]
        self._place(waiting)
        self._head.visible = bool(finds)
        confirmed = [one.name for one in finds if one.find.confirmed]
        self._head.content = counted_head(confirmed, len(waiting) - LISTED, self._words)
        for one, (text, buttons) in zip(self._shown, self._rows, strict=True):
            text.visible = one is not None
            buttons.visible = one is not None and not self._actions.recorded
            if one is not None:
                buttons.label = self._words("panel.counted.find", n=one.find.number)
                text.content = counted_find(one.name, one.find.position_world, self._words)

    def _place(self, waiting: list[JudgedFind]) -> None:
        """Give each find a row, the latest the first one; a find that has a row keeps it.

        A press is for what was read in its row, also where the list changes meanwhile.
        """
        left = {(one.goal_id, one.find.number): one for one in waiting}
        for n, one in enumerate(self._shown):
            if one is not None:
                self._shown[n] = left.pop((one.goal_id, one.find.number), None)
                if self._shown[n] is None:
                    self._free.append(n)
        if len(self._free) == LISTED:
            self._free.sort()
        for n, one in zip(self._free, left.values(), strict=False):
            self._shown[n] = one
        self._free = [n for n in self._free if self._shown[n] is None]

    def _judge(self, n: int, word: str) -> str:
        one = self._shown[n]
        if one is None:
            raise CommandError(self._words("panel.counted.gone"))
        is_one = word == self._words("panel.counted.confirm")
        judge = self._actions.confirm_find if is_one else self._actions.reject_find
        return judge(one.goal_id, one.find.number)


def judged_finds(status: Status, say: Words) -> list[JudgedFind]:
    """Return what the present goals have found before their last finds, by goal and number."""
    return [
        JudgedFind(goal_id=goal.goal_id, name=say.numbered(goal, find.number), find=find)
        for goal in _present(status)
        for find in goal.counted
    ]


def find_name(find: FindReport, status: Status, say: Words) -> str:
    """Return the name of the find that waits, where there are several; empty for the only one."""
    goal = next((one for one in _present(status) if one.goal_id == find.goal_id), None)
    if goal is not None and goal.count != 1:
        return say.numbered(goal, find.number)
    return say.name(find.object) if status.tour else ""


def _present(status: Status) -> list[GoalStatus]:
    return status.tour or [goal for goal in (status.goal,) if goal is not None]
