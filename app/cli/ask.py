"""`ippon ask`: a query from any terminal that reaches the navigator."""

import json
import queue
import sys

import msgspec
import zenoh

from app.cli.errors import UsageError
from app.cli.levels import check_query
from app.cli.options import Ask
from app.links.registry import running_navigators
from app.links.requests import RequestRefusedError, ask
from app.links.session import LinkError, open_client
from app.messages import keys
from app.messages.control import GoalStatus, SearchAccepted, SearchRequest, Status, decode
from ippon.guidance.sentence import read_query

SILENT_S = 10.0
EXIT_NOT_FOUND = 1


def run_ask(command: Ask) -> int:
    """Send the query; with `--follow` stay until the search is over."""
    if not command.timeout_s > 0.0:
        raise UsageError(f"--timeout-s is a positive number of seconds; got {command.timeout_s:g}")
    wanted, context = _read(command)
    check_query(wanted, context)
    endpoint, robot = find_navigator(command.connect, command.robot)
    try:
        session = open_client(endpoint, command.timeout_s)
    except LinkError as error:
        raise UsageError(str(error)) from error
    try:
        updates: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        session.declare_subscriber(
            f"{robot}/{keys.STATUS}", lambda sample: updates.put(sample.payload.to_bytes())
        )
        request = SearchRequest(object=wanted, context=context, requester="ippon ask")
        accepted = ask(
            session, f"{robot}/{keys.SEARCH}", request, SearchAccepted, command.timeout_s
        )
        _show_accepted(accepted, command)
        return _follow(updates, accepted.goal_id, command) if command.follow else 0
    except (LinkError, RequestRefusedError) as error:
        raise UsageError(str(error)) from error
    finally:
        _close(session)


def find_navigator(connect: str | None, robot: str | None) -> tuple[str, str]:
    """Return endpoint and key prefix of the navigator that is meant.

    Raises:
        UsageError: None runs on this machine, or several do and none is named.
    """
    if connect is not None:
        return connect, robot or "ippon"
    running = [n for n in running_navigators() if robot is None or n.robot == robot]
    if len(running) == 1:
        return running[0].endpoint, running[0].robot
    if not running:
        raise UsageError(
            "no navigator runs on this machine; start one with `ippon demo`, or name one elsewhere "
            "with --connect tcp/ADDRESS:PORT --robot PREFIX"
        )
    choices = "\n".join(f"  --robot {n.robot}   ({n.endpoint})" for n in running)
    raise UsageError(f"several navigators run on this machine; choose one:\n{choices}")


def _read(command: Ask) -> tuple[str, str]:
    """Take a sentence apart, where the object is one."""
    if command.context or len(command.object.split()) < 3:
        return command.object, command.context
    query = read_query(command.object)
    return query.object or command.object, query.context


def _show_accepted(accepted: SearchAccepted, command: Ask) -> None:
    if command.json:
        print(msgspec.json.encode(accepted).decode(), flush=True)
        return
    place = "" if accepted.position == 0 else f", {accepted.position} before it"
    print(f"searching for {accepted.object.replace('_', ' ')} (goal {accepted.goal_id}{place})")
    for note in accepted.notes:
        print(f"note: {note}")
    sys.stdout.flush()


def _follow(updates: "queue.SimpleQueue[bytes]", goal_id: int, command: Ask) -> int:
    shown = ""
    while True:
        try:
            status = decode(updates.get(timeout=SILENT_S), Status)
        except queue.Empty:
            raise LinkError(f"the navigator has been silent for {SILENT_S:g} s") from None
        goal = known_goal(status, goal_id)
        if goal is None or goal.outcome == "queued":
            continue
        line = f"{status.state}: {status.why}"
        if command.json:
            print(json.dumps(_as_dict(status, goal)), flush=True)
        elif line != shown:
            print(f"{status.elapsed_s:7.1f} s  {line}", flush=True)
        shown = line
        if goal.outcome != "active":
            return 0 if goal.outcome == "found" else EXIT_NOT_FOUND


def known_goal(status: Status, goal_id: int) -> GoalStatus | None:
    """Return a goal that is active, waits or is over; None when the navigator does not say it."""
    known = [status.goal, *status.queue, *status.history]
    return next((goal for goal in known if goal is not None and goal.goal_id == goal_id), None)


def _as_dict(status: Status, goal: GoalStatus) -> dict[str, object]:
    return {
        "goal_id": goal.goal_id,
        "object": goal.object,
        "outcome": goal.outcome,
        "state": status.state,
        "why": status.why,
        "elapsed_s": round(status.elapsed_s, 2),
        "path_length_m": round(status.path_length_m, 3),
        "position_world": status.find.position_world if status.find is not None else None,
    }


def _close(session: zenoh.Session) -> None:
    session.close()  # pyright: ignore[reportUnknownMemberType]
