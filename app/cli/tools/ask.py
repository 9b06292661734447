"""`ippon ask`: sends a query to a navigator from any terminal."""

import queue
import sys
import time
from collections.abc import Callable
from functools import partial

import msgspec
import zenoh
from rich.console import Console

from app.cli.exit_status import EXIT_NOT_FOUND
from app.cli.options.tools import Ask
from app.cli.tools.feedback import feedback_of, give_feedback
from app.cli.tools.follow import SILENT_S, follow
from app.cli.tools.levels import check_query
from app.cli.tools.levels_table import as_json, print_levels, print_question, printable, said_by
from app.cli.tools.navigator_address import check_timeout, find_navigator
from app.cli.tools.nearest import check_options, give, reader
from app.cli.tools.picture import read_jpeg
from app.cli.tools.read import print_reading
from app.errors import UsageError
from app.links.language_model.sentence_reading import search_of
from app.links.network.request_credential import request_credential
from app.links.network.requests import RequestRefusedError, ask
from app.links.network.session import LinkError, open_client
from app.links.network.subscription import is_alive, subscribe
from app.messages import keys
from app.messages.control import (
    Accepted,
    PictureRequest,
    SearchAccepted,
    SearchRequest,
    SentenceReading,
    SentenceRequest,
    VocabularyRequest,
    decode,
)
from app.messages.status import LevelTable
from ippon.guidance.language.requests.sentence import MAX_SENTENCE_CHARS, is_name
from ippon.guidance.levels import Level
from ippon.vocabulary import in_words

READ_S = 12.0
"""Time for reading a sentence; rules replace a language model after 8 s."""
PICTURE_S = 25.0
"""Time for naming what a picture shows; the navigator gives its language model 20 s."""
ANSWER_S = 150.0
"""Time for up to three requests to a language model."""
NAME = "ippon ask"

Wanted = tuple[SearchRequest, bool]
"""A search, and whether it is to be done in one tour with the one before."""


def run_ask(command: Ask) -> int:
    """Send the query; with `--follow` stay until the search is over."""
    check_timeout(command.timeout_s)
    if command.picture is not None and (command.object or command.add_label is not None):
        raise UsageError(
            "--picture stands in place of the object; what you know of its place goes to --context"
        )
    feedback = feedback_of(command)
    searches = command.context or command.explain or command.follow
    if command.add_label is not None and not command.object and searches:
        raise UsageError(
            "--context, --explain and --follow are about a search: name an object, too, or leave "
            "them out"
        )
    asks = feedback is None and command.picture is None
    if asks and (command.add_label is None or command.object):
        check_query(command.object[:80], command.context)
    jpeg = None if command.picture is None else read_jpeg(command.picture)
    if command.show_prompt and not command.explain:
        raise UsageError("--show-prompt goes with --explain")
    if command.nearest:
        check_options(command)
    endpoint, robot = find_navigator(command.connect, command.robot, any_of=command.nearest)
    if command.robot is None and not command.nearest:
        print(f"asking the robot {robot} at {endpoint}", file=sys.stderr, flush=True)
    try:
        with open_client(endpoint, command.timeout_s) as session:
            if command.nearest:
                robot = reader(session, robot)
            else:
                # A navigator that compiles is at its endpoint already, and takes no request yet.
                # Where it cannot be determined, the request itself fails.
                _presence(session, robot, command.timeout_s)()
            if feedback is not None:
                give_feedback(session, robot, command, feedback, NAME)
                return 0
            if command.add_label is not None:
                _add_label(session, robot, command)
                if not command.object:
                    return 0
            requests = (
                _read(session, robot, command) if jpeg is None
                else _read_picture(session, robot, command, jpeg)
            )  # fmt: skip
            if command.nearest:
                return _give(session, command, requests)
            return _search(session, robot, command, requests)
    except (LinkError, RequestRefusedError) as error:
        raise UsageError(str(error)) from error
    except msgspec.DecodeError as error:
        raise UsageError(f"the navigator of {robot} is of another version: {error}") from error


def _add_label(session: zenoh.Session, robot: str, command: Ask) -> None:
    try:
        request = VocabularyRequest(label=command.add_label or "", requester="ippon ask")
        msgspec.json.decode(msgspec.json.encode(request), type=VocabularyRequest)
    except msgspec.ValidationError as error:
        raise UsageError(f"a common object has 1 to 40 characters ({error})") from error
    limit_s = command.timeout_s
    with request_credential(session, robot, NAME, limit_s, take=command.take) as who:
        done = ask(session, f"{robot}/{keys.VOCABULARY}", request, Accepted, limit_s, who)
    print(done.detail, file=sys.stderr if command.json else sys.stdout, flush=True)


def _search(session: zenoh.Session, robot: str, command: Ask, requests: list[Wanted]) -> int:
    for request, _ in requests:
        check_query(request.object, request.context)
    updates: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    tables: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    for topic, received in ((keys.STATUS, updates), (keys.LEVELS, tables)):
        subscribe(session, f"{robot}/{topic}", received.put)
    limit_s = command.timeout_s
    goals: list[SearchAccepted] = []
    with request_credential(session, robot, NAME, limit_s, take=command.take) as who:
        for wanted, joins in requests:
            first = goals[-1].goal_id if joins and goals else None
            request = msgspec.structs.replace(wanted, joins=first)
            accepted = ask(session, f"{robot}/{keys.SEARCH}", request, SearchAccepted, limit_s, who)
            _show_accepted(accepted, command)
            goals.append(accepted)
    if command.explain:
        for accepted in goals:
            _explain(tables, accepted, command)
    if not command.follow:
        return 0
    ids = [accepted.goal_id for accepted in goals]
    return follow(updates, ids, command, _presence(session, robot, limit_s))


def _give(session: zenoh.Session, command: Ask, requests: list[Wanted]) -> int:
    """Give the search to the nearest free robot; with `--follow` stay until it is over."""
    given = give(session, [search for search, _ in requests], command)
    if given is None:
        return EXIT_NOT_FOUND
    if not command.follow:
        return 0
    robot, accepted = given
    updates: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    subscribe(session, f"{robot}/{keys.STATUS}", updates.put)
    is_there = _presence(session, robot, command.timeout_s)
    return follow(updates, [accepted.goal_id], command, is_there)


def _presence(session: zenoh.Session, robot: str, timeout_s: float) -> Callable[[], bool]:
    """Return what tells whether a navigator takes requests.

    Its token stays while its threads are busy, and is gone with its process.
    """
    return partial(is_alive, session, f"{robot}/{keys.NAVIGATOR_ALIVE}", timeout_s)


def _read(session: zenoh.Session, robot: str, command: Ask) -> list[Wanted]:
    """Have the navigator take a sentence apart, where the object is one.

    Raises:
        UsageError: It holds no object, or what was read is doubtful, and nobody said yes to it.
    """
    if is_name(command.object):
        plain = SearchRequest(object=command.object, context=command.context, requester=NAME)
        return [(plain, False)]
    if len(command.object) > MAX_SENTENCE_CHARS:
        raise UsageError(
            f"a sentence has at most {MAX_SENTENCE_CHARS} characters; yours has "
            f"{len(command.object)}: say what to look for in a few words"
        )
    request = SentenceRequest(sentence=command.object)
    reading = ask(session, f"{robot}/{keys.SENTENCE}", request, SentenceReading, READ_S)
    return [
        (msgspec.structs.replace(one, context=_both(one.context, command.context)), joins)
        for one, joins in _agreed_searches(reading, command)
    ]


def _both(one: str, other: str) -> str:
    return ", ".join(filter(None, (one, other)))


def _read_picture(session: zenoh.Session, robot: str, command: Ask, jpeg: bytes) -> list[Wanted]:
    """Have the navigator's language model name what a picture shows.

    Raises:
        UsageError: It names nothing, or is not sure, and nobody said yes to it.
    """
    request = PictureRequest(jpeg=jpeg)
    reading = ask(session, f"{robot}/{keys.PICTURE}", request, SentenceReading, PICTURE_S)
    return [
        (msgspec.structs.replace(one, context=command.context), joins)
        for one, joins in _agreed_searches(reading, command)
    ]


def _agreed_searches(reading: SentenceReading, command: Ask) -> list[Wanted]:
    """Show what was read; return the searches that follow, where it is certain or agreed to.

    Raises:
        UsageError: No object was read, or what was read is doubtful, and nobody said yes to it.
    """
    if reading.note:
        print(f"note: read by rules: {printable(reading.note)}", file=sys.stderr)
    if not reading.goals:
        raise UsageError(printable(reading.because))
    print_reading(reading, Console(stderr=True))
    if reading.doubtful and not command.yes and not _agreed():
        raise UsageError(
            f"what was read is doubtful: {printable(reading.because)}; add --yes to search for it, "
            'or say it in two parts: ippon ask "hat" --context "on the sofa"'
        )
    return [
        (search_of(goal, NAME), place > 0 and goal.order == "and")
        for place, goal in enumerate(reading.goals)
    ]


def _agreed() -> bool:
    """Ask whoever sits at the terminal whether to search; False where nobody does."""
    if not sys.stdin.isatty():
        return False
    print("search for that? [y/N] ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _explain(tables: "queue.SimpleQueue[bytes]", accepted: SearchAccepted, command: Ask) -> None:
    """Print the goal's levels, after the answer of the language model if one is used."""
    if accepted.position > 0:
        print("levels are available when the search for this goal starts", file=sys.stderr)
        return
    if accepted.joined is not None:
        # The levels of one goal of a tour are published: of that which the plan is for.
        print("levels are available when the tour leads to this goal", file=sys.stderr)
        return
    table = _final_table(tables, accepted.goal_id)
    rated = [(Level.parse(row.level), row) for row in table.rows]
    if command.json:
        told: dict[str, object] = {
            "goal_id": table.goal_id,
            "provider": table.provider,
            "elapsed_ms": round(table.elapsed_ms, 2),
            "from_cache": table.from_cache,
            "notes": table.notes,
        }
        if command.show_prompt:
            told |= {"prompt": table.prompt, "reply": table.reply}
        print(as_json(told, rated), flush=True)
        return
    source = said_by(table.provider, table.elapsed_ms, from_cache=table.from_cache)
    print_levels(table.object, rated, table.notes, source)
    if command.show_prompt:
        print_question(table.prompt, table.reply)


def _final_table(tables: "queue.SimpleQueue[bytes]", goal_id: int) -> LevelTable:
    deadline, asked = time.monotonic() + ANSWER_S, ""
    while True:
        try:
            left = max(0.0, deadline - time.monotonic())
            table = decode(tables.get(timeout=left if asked else min(left, SILENT_S)), LevelTable)
        except queue.Empty:
            raise LinkError("the navigator did not publish the levels of this goal") from None
        if table.goal_id != goal_id:
            continue
        if not table.asking:
            return table
        if not asked:
            print(f"asking {printable(table.asking)} …", file=sys.stderr, flush=True)
        asked = table.asking


def _show_accepted(accepted: SearchAccepted, command: Ask) -> None:
    if command.json:
        print(msgspec.json.encode(accepted).decode(), flush=True)
        return
    place = "" if accepted.position == 0 else f", {accepted.position} before it"
    tour = "" if accepted.joined is None else f", in one tour with goal {accepted.joined}"
    name = in_words(accepted.object)
    print(f"searching for {name} (goal {accepted.goal_id}{place}{tour})")
    for note in accepted.notes:
        print(f"note: {note}")
    sys.stdout.flush()
