"""`ippon control`: what a robot does now, and Stop, Pause, Resume and Cancel."""

import time
from collections.abc import Iterator
from typing import Any, Final

import msgspec
import zenoh

from app.cli.options.tools import Control
from app.cli.tools.follow import doing, place_text
from app.cli.tools.levels_table import printable
from app.cli.tools.navigator_address import check_timeout, find_navigator
from app.errors import UsageError
from app.links.network.request_credential import request_credential
from app.links.network.requests import (
    RequestRefusedError,
    ask,
    ask_until_answered,
    last_message,
)
from app.links.network.session import LinkError, open_client
from app.links.network.subscription import is_alive
from app.messages import keys
from app.messages.control import Accepted, ControlReply, ControlRequest, QueueRequest, decode
from app.messages.status import GoalStatus, Status, awaited_find, name_of
from ippon.vocabulary import in_words

NAME = "ippon control"
_ENDED = {
    "found": "found",
    "out_of_reach": "found, out of reach",
    "exhausted": "not found",
    "cancelled": "cancelled",
}
_LOOK_S: Final = 0.5
"""Time after which the token of a navigator that is ready counts as absent."""


def run_control(command: Control) -> int:
    """Print the status, or send a request and print the answer."""
    check_timeout(command.timeout_s)
    if command.goal is not None and command.action != "cancel":
        raise UsageError("--goal goes with cancel: the other actions are about the robot")
    endpoint, robot = find_navigator(command.connect, command.robot)
    run = _show if command.action == "show" else _send
    try:
        with open_client(endpoint, command.timeout_s) as session:
            if command.action not in ("stop", "pause"):  # They are sent at once.
                _await_navigator(session, robot, command.timeout_s)
            run(session, robot, command)
    except (LinkError, RequestRefusedError) as error:
        raise UsageError(str(error)) from error
    except msgspec.DecodeError as error:
        raise UsageError(f"the navigator of {robot} is of another version: {error}") from error
    return 0


def status_lines(status: Status) -> Iterator[str]:
    """Yield what a robot does, one line a goal, as it is printed."""
    yield f"{status.robot}: {doing(status)}"
    if status.lease.state != "free":
        yield f"in control: {status.lease.holder}"
    now = status.tour or ([status.goal] if status.goal is not None else [])
    for goal in now:
        state = _ENDED.get(goal.outcome) or (
            f"searching for {status.elapsed_s:.0f} s, {status.path_length_m:.1f} m driven"
        )
        yield f"  {_named(goal)}: {state}{_place(goal)}"
    for goal in status.queue:
        yield f"  {_named(goal)}: waits"
    for goal in status.history:
        yield f"  {_named(goal)}: {_ENDED.get(goal.outcome, goal.outcome)}{_place(goal)}"
    find = awaited_find(status)
    if find is not None:
        name = in_words(find.object)
        yield f"is this the {name}? `ippon ask --confirm last`, or `ippon ask --reject last`"


def answer_text(robot: str, command: Control, reply: ControlReply) -> str:
    """Return an answer of the navigator as it is printed."""
    if command.action == "cancel" and reply.detail:
        # The state is that of the robot, which may search for the next goal already.
        return f"{robot}: {reply.detail}"
    return "; ".join(filter(None, (f"{robot}: {reply.state.replace('_', ' ')}", reply.detail)))


def _await_navigator(session: zenoh.Session, robot: str, timeout_s: float) -> None:
    """Wait while the robot's navigator compiles; whether one answers at all, the request tells.

    Raises:
        LinkError: It still compiles.
    """
    deadline = time.monotonic() + timeout_s
    while not is_alive(session, f"{robot}/{keys.NAVIGATOR_ALIVE}", min(timeout_s, _LOOK_S)):
        tokens: Any = session.liveliness().get(f"{robot}/{keys.NAVIGATOR_STARTING}", timeout=1.0)
        if all(reply.ok is None for reply in tokens):
            return
        if time.monotonic() >= deadline:
            raise LinkError(
                f"the navigator of {robot} still compiles its program, at the first start for a "
                "minute or more: ask again then, or wait with a longer --timeout-s"
            )


def _named(goal: GoalStatus) -> str:
    context = f", {goal.context}" if goal.context else ""
    return f"goal {goal.goal_id}, {name_of(goal)}{context}"


def _place(goal: GoalStatus) -> str:
    if goal.position_world is None:
        return ""
    confirmed = ", confirmed" if goal.confirmed else ""
    return f" {place_text(goal.position_world)}{confirmed}"


def _show(session: zenoh.Session, robot: str, command: Control) -> None:
    status = _status(session, robot, command)
    if command.json:
        print(msgspec.json.encode(status).decode(), flush=True)
        return
    for line in status_lines(status):
        print(printable(line), flush=True)


def _send(session: zenoh.Session, robot: str, command: Control) -> None:
    assert command.action != "show"
    limit_s = command.timeout_s
    take = command.take and command.action != "stop"
    waits = command.goal is not None and any(
        goal.goal_id == command.goal for goal in _status(session, robot, command).queue
    )
    with request_credential(session, robot, NAME, limit_s, take=take) as who:
        if waits and command.goal is not None:
            queued = QueueRequest(goal_id=command.goal, action="remove")
            taken = ask(session, f"{robot}/{keys.QUEUE}", queued, Accepted, limit_s, who)
            said = taken.detail or f"goal {command.goal} is cancelled"
            answer = msgspec.json.encode(taken)
        else:
            asked = ControlRequest(action=command.action, goal_id=command.goal, requester=NAME)
            key = f"{robot}/{keys.CONTROL}"
            if command.action == "stop":
                # Of anybody, and at any time: also while the line breaks.
                reply = ask_until_answered(session, key, asked, ControlReply, limit_s)
            else:
                reply = ask(session, key, asked, ControlReply, limit_s, who)
            said, answer = answer_text(robot, command, reply), msgspec.json.encode(reply)
    print(answer.decode() if command.json else printable(said), flush=True)


def _status(session: zenoh.Session, robot: str, command: Control) -> Status:
    message = last_message(session, f"{robot}/{keys.STATUS}", command.timeout_s)
    if message is None:
        raise LinkError(f"no navigator of {robot} answered within {command.timeout_s:g} s")
    return decode(message, Status)
