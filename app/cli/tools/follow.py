"""`ippon ask --follow`: prints how searches go on until they are over."""

import json
import queue
import re
import sys
import time
from collections.abc import Callable, Sequence

import msgspec

from app.cli.exit_status import exit_status
from app.cli.options.tools import Ask
from app.links.network.session import LinkError
from app.messages.control import decode
from app.messages.status import GoalStatus, Status, goal_of, name_of
from ippon.vocabulary import in_words

SILENT_S = 10.0
"""Time without a status after which it is checked whether the navigator is still there."""
HANGS_S = 120.0
"""Time without a status after which a navigator that is there hangs. The thread that reports also
maps and plans: on an overloaded machine a step, or a kernel that is compiled, takes long."""
NUMBERS_EVERY_S = 5.0
"""How often it prints what a search does where only its numbers have changed."""


def follow(
    updates: "queue.SimpleQueue[bytes]",
    goals: list[int],
    command: Ask,
    is_there: Callable[[], bool],
) -> int:
    """Print how the searches go on until all are over; return the highest exit status.

    Args:
        updates: The statuses of the navigator.
        goals: The searches.
        command: How they are printed.
        is_there: Asked after silence: whether the navigator is connected.

    Raises:
        LinkError: The navigator is gone, hangs, or does not list a goal any more.
        msgspec.DecodeError: It is of another version.
    """
    left, worst = set(goals), 0
    progress = _Progress()
    listed_at = dict.fromkeys(goals, time.monotonic())
    counted: set[tuple[int, int]] = set()
    while left:
        status = decode(_next(updates, is_there), Status)
        listed = [goal_of(status, goal_id) for goal_id in goals if goal_id in left]
        _check_listed(listed, left, listed_at)
        begun = [goal for goal in listed if goal is not None and goal.outcome != "queued"]
        ended = [goal for goal in begun if goal.outcome != "active"]
        if not begun:
            if not command.json:
                progress.show_before(status, goals)
            continue
        if command.json:
            lead = status.goal.goal_id if status.goal is not None else None
            for goal in begun:
                if goal in ended or goal.goal_id == lead:
                    print(json.dumps(_as_dict(status, goal)), flush=True)
        else:
            progress.show(status)
            _show_counted(begun, counted)
        for goal in ended:
            if len(goals) > 1 and not command.json:
                print(_end_of(goal), flush=True)
            left.remove(goal.goal_id)
            worst = max(worst, exit_status(goal))
    return worst


def _next(updates: "queue.SimpleQueue[bytes]", is_there: Callable[[], bool]) -> bytes:
    """Return the next status; it may be long in coming while the navigator is there.

    Raises:
        LinkError: The navigator is gone or hangs.
    """
    silent_s = 0.0
    while silent_s < HANGS_S:
        try:
            return updates.get(timeout=SILENT_S)
        except queue.Empty:
            if not is_there():
                raise LinkError(
                    f"the navigator is gone: it has been silent for {SILENT_S:g} s"
                ) from None
        if silent_s == 0.0:
            print(
                f"the navigator is connected but has reported nothing for {SILENT_S:g} s: it is "
                "busy, or its machine is overloaded; waiting",
                file=sys.stderr,
                flush=True,
            )
        silent_s += SILENT_S
    raise LinkError(
        f"the navigator is connected but has reported nothing for {HANGS_S:g} s: its log may say "
        "why"
    )


def _check_listed(
    listed: Sequence[GoalStatus | None], left: set[int], listed_at: dict[int, float]
) -> None:
    """Note which goals the navigator lists.

    Raises:
        LinkError: One was not listed for a while.
    """
    now = time.monotonic()
    listed_at |= {goal.goal_id: now for goal in listed if goal is not None}
    for goal_id in sorted(left):
        if now - listed_at[goal_id] > SILENT_S:
            raise LinkError(
                f"the navigator does not list goal {goal_id}: it was perhaps started again; "
                "`ippon control` shows its goals"
            )


class _Progress:
    """Prints what a search does when that changes; numbers alone change too often to read."""

    def __init__(self) -> None:
        self._line = ""
        self._at_s = -NUMBERS_EVERY_S

    def show_before(self, status: Status, goals: list[int]) -> None:
        """Print what the robot does for the search that the goals wait for."""
        before = status.goal
        if before is None or before.goal_id in goals:
            return
        line = f"waits for goal {before.goal_id}, {name_of(before)}: {status.why}"
        if _words(line) != _words(self._line):
            self._line = line
            print(line, flush=True)

    def show(self, status: Status) -> None:
        line = doing(status)
        is_soon = abs(status.elapsed_s - self._at_s) < NUMBERS_EVERY_S
        if line == self._line or (is_soon and _words(line) == _words(self._line)):
            return
        self._line, self._at_s = line, status.elapsed_s
        print(f"{status.elapsed_s:7.1f} s  {line}", flush=True)


def doing(status: Status) -> str:
    """Return state and reason, without the state where the reason begins with it."""
    state = status.state.replace("_", " ")
    return status.why if status.why.startswith(state) else f"{state}: {status.why}"


def _words(line: str) -> str:
    return re.sub(r"[0-9.]+", "", line)


def _show_counted(goals: list[GoalStatus], shown: set[tuple[int, int]]) -> None:
    """Print the number and the place of each find of several, once."""
    for goal in goals:
        for find in goal.counted:
            if (goal.goal_id, find.number) not in shown:
                shown.add((goal.goal_id, find.number))
                place = place_text(find.position_world)
                print(f"{name_of(goal)}: find {find.number} {place}", flush=True)


def place_text(position_world: tuple[float, float, float]) -> str:
    """Return a position as it is printed after what is there."""
    x, y, z = position_world
    return f"at ({x:.1f}, {y:.1f}) m, z = {z:.1f} m"


def _end_of(goal: GoalStatus) -> str:
    """Return how the search for one of several goals ended, in one line."""
    place = ""
    if goal.position_world is not None:
        place = f" {place_text(goal.position_world)}"
    before = f", and {len(goal.counted)} before" if goal.counted else ""
    return f"{in_words(goal.object)}: {goal.outcome.replace('_', ' ')}{place}{before}"


def _as_dict(status: Status, goal: GoalStatus) -> dict[str, object]:
    find = status.find
    if find is not None and find.goal_id != goal.goal_id:
        find = None
    return {
        "goal_id": goal.goal_id,
        "object": goal.object,
        "outcome": goal.outcome,
        "state": status.state,
        "why": status.why,
        "elapsed_s": round(status.elapsed_s, 2),
        "path_length_m": round(status.path_length_m, 3),
        "position_world": goal.position_world if find is None else find.position_world,
        "out_of_reach_m": None if find is None else find.out_of_reach_m,
        "find": None if find is None else find.number,
        "counted": msgspec.to_builtins(goal.counted),
        "attributes": [] if find is None else msgspec.to_builtins(find.attributes),
    }
