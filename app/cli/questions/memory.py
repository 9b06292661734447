"""`ippon memory`: where is, or was last, what somebody names?"""

import sys
import time
from pathlib import Path

import msgspec
from rich.console import Console
from rich.table import Table
from rich.text import Text

from app.cli.options.tools import Memory
from app.cli.tools.levels_table import printable
from app.cli.tools.navigator_address import check_timeout, find_navigator
from app.errors import MemoryFileError, UsageError
from app.links.network.requests import RequestRefusedError, ask
from app.links.network.session import LinkError, open_client
from app.memory.memory_file import SUFFIX, memory_path, read_memory, read_picture
from app.memory.wording import said_place, said_time
from app.messages import keys
from app.messages.memory import MemoryReply, MemoryRequest, RememberedThing
from app.nodes.navigator.services.memory_service import thing_of
from ippon.atomic_file import replace_file
from ippon.memory.lookup import find_instances
from ippon.vocabulary import MATTERPORT_40, in_words

EXIT_NOT_THERE = 1


def run_memory(command: Memory) -> int:
    """Print what is remembered; 0 where something is still there, else 1."""
    check_timeout(command.timeout_s)
    if len(command.find) > 80:
        raise UsageError(f"--find takes at most 80 characters; got {len(command.find)}")
    if not 1 <= command.limit <= 10_000:
        raise UsageError(f"--limit is a number from 1 to 10,000; got {command.limit}")
    reply = _from_file(command) if command.file is not None else _from_navigator(command)
    if command.json:
        print(msgspec.json.encode(msgspec.structs.replace(reply, picture=b"")).decode())
    else:
        _print(reply, command.find)
    if command.picture is not None:
        _save_picture(reply, command.picture)
    return 0 if any(thing.gone_ns == 0 for thing in reply.things) else EXIT_NOT_THERE


def _from_file(command: Memory) -> MemoryReply:
    assert command.file is not None
    path = command.file if command.file.name.endswith(SUFFIX) else memory_path(command.file)
    try:
        matches = find_instances(read_memory(path), command.find, MATTERPORT_40)
        things = [thing_of(match) for match in matches[: command.limit]]
        wanted = _pictured(things)
        picture = b""
        if command.picture is not None and wanted is not None:
            picture = read_picture(path, wanted.instance_id) or b""
    except (MemoryFileError, ValueError) as error:
        raise UsageError(str(error)) from error
    return MemoryReply(things=things, count=len(matches), picture=picture)


def _from_navigator(command: Memory) -> MemoryReply:
    endpoint, robot = find_navigator(command.connect, command.robot)
    key, limit_s = f"{robot}/{keys.MEMORY}", command.timeout_s
    try:
        with open_client(endpoint, limit_s) as session:
            request = MemoryRequest(find=command.find, limit=command.limit)
            reply = ask(session, key, request, MemoryReply, limit_s)
            wanted = _pictured(reply.things)
            if command.picture is None or wanted is None:
                return reply
            again = msgspec.structs.replace(request, picture=wanted.instance_id)
            return ask(session, key, again, MemoryReply, limit_s)
    except (LinkError, RequestRefusedError) as error:
        raise UsageError(str(error)) from error


def _pictured(things: list[RememberedThing]) -> RememberedThing | None:
    """Return the first thing that has a picture."""
    return next((thing for thing in things if thing.has_picture), None)


def _save_picture(reply: MemoryReply, path: Path) -> None:
    if not reply.picture:
        raise UsageError("none of these things has a picture")
    try:
        replace_file(path, reply.picture)
    except OSError as error:
        raise UsageError(f"cannot write the picture to {path}: {error.strerror}") from error
    thing = _pictured(reply.things)
    name = "" if thing is None else f" of the {in_words(thing.label)}"
    print(f"ippon: the picture{name} is in {path}", file=sys.stderr)


def _print(reply: MemoryReply, find: str) -> None:
    console = Console()
    if reply.note:
        print(f"ippon: {printable(reply.note)}", file=sys.stderr)
    if not reply.things:
        print(f"nothing that answers {find!r} is remembered" if find else "nothing is remembered")
        return
    table = Table()
    for heading in ("what", "where", "how sure", "last seen", "or else"):
        table.add_column(heading)
    now_ns = time.time_ns()
    for thing in reply.things:
        others = ", ".join(f"{in_words(label)} {p:.0%}" for label, p in thing.alternatives)
        seen = said_time(thing.last_seen_ns, now_ns)
        if thing.gone_ns:
            seen = f"{seen}; not there any more since {said_time(thing.gone_ns, now_ns)}"
        cells = (
            _what(thing),
            said_place(thing.room, thing.position_world),
            f"{thing.probability:.0%}", seen, others,
        )  # fmt: skip
        table.add_row(*(Text(printable(cell)) for cell in cells))
    console.print(table)
    if reply.count > len(reply.things):
        print(f"{reply.count - len(reply.things)} more; --limit shows them")


def _what(thing: RememberedThing) -> str:
    """Return name and kind of a thing, and what a person said that it is not."""
    kind = " ".join([*thing.attributes, in_words(thing.label) or "unknown thing"])
    denied = "".join(f", not {in_words(label)}" for label in thing.denied)
    return (f"{thing.name} ({kind})" if thing.name else kind) + denied
