"""`ippon demo`: robot, navigator and console on this machine, one command, one search."""

import json
import os
import queue
import re
import shlex
import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

import httpx
import zenoh
from rich.console import Console
from rich.text import Text

from app.cli.nodes.demo_result import await_outcome, end_recording, measured_result
from app.cli.options.nodes import Demo
from app.cli.tools.ask import exit_status
from app.cli.tools.language_model import as_arguments, make_model
from app.cli.tools.levels import check_query
from app.errors import DemoError, UsageError
from app.homes import load_home
from app.links.network.requests import RequestRefusedError, ask, last_message
from app.links.network.session import LinkError, open_client
from app.messages import keys
from app.messages.control import SearchAccepted, SearchRequest, decode
from app.messages.recording import RecordingStatus
from app.process.children import PROGRAM, Child, free_port, port_is_free, wait_for_end

if TYPE_CHECKING:
    from ippon.robot import RobotProfile

DEFAULT_CONTEXT: Final = {"hat": "I think I left it on the sofa"}
FIRST_PAGE_PORT: Final = 8080
FIRST_LINK_PORT: Final = 7447
TRIES: Final = 10
"""Ports that are tried when others take each one between the look at it and the use of it."""
READY_S: Final = 300.0
"""The first start compiles every kernel."""
PAGE_S: Final = 60.0
LONGEST_NAME: Final = 60
EXIT_USAGE: Final = 2
EXIT_FAILED: Final = 3
EXIT_INTERRUPTED: Final = 130


class _PortTakenError(Exception):
    """Another program took the port after the look at it."""


@dataclass(slots=True, kw_only=True)
class _Running:
    """What was started so far, in the order in which it must end."""

    robot: str
    endpoint: str = ""
    page_port: int = 0
    children: list[Child] = field(default_factory=list)
    session: zenoh.Session | None = None
    recorded: str | None = None
    """Folder of the recording."""

    def key(self, topic: str) -> str:
        return f"{self.robot}/{topic}"

    def start(self, name: str, arguments: Sequence[str]) -> Child:
        child = Child(name, [*arguments, "--robot", self.robot])
        self.children.append(child)
        return child

    def leave(self) -> None:
        if self.session is not None:
            self.session.close()  # pyright: ignore[reportUnknownMemberType]
            self.session = None

    def close(self) -> None:
        self.leave()
        for child in reversed(self.children):
            child.stop()


def run_demo(command: Demo) -> int:
    """Start everything, search, and end with Ctrl-C or, if asked, with the search."""
    context = command.context
    if context is None:
        context = DEFAULT_CONTEXT.get(command.object, "")
    profile = _check(command, context)
    scene = load_home(command.home)
    _end_on(signal.SIGTERM)
    # A shell starts what runs in its background with this one ignored.
    _end_on(signal.SIGINT)
    screen = Console(file=sys.stderr)
    running = _Running(robot=f"ippon/{prefix_part(scene.name)}-{os.getpid()}")
    try:
        _start_navigator(running, command)
        if not command.headless:
            _start_console(running, command.port)
            page = f"http://127.0.0.1:{running.page_port}"
            screen.print(f"\n  IPPON is at [bold]{page}[/bold]\n")
        recorder = _start_recorder(running, command.record_to, screen) if command.record else None
        updates = _listen(running) if command.exit_when_done else None
        goal_id = None if command.no_search else _search(running, command.object, context)
        robot = _start_robot(running, command)
        if updates is not None and goal_id is not None:
            assert running.session is not None
            status, goal = await_outcome(running.children, updates, goal_id)
            result = measured_result(running.session, running.robot, profile, status, goal, scene)
            result["session"] = end_recording(recorder, running.recorded, result)
            print(json.dumps({"object": command.object, **result}), flush=True)
            return exit_status(goal)
        _supervise(running, robot, screen)
    except DemoError as error:
        screen.print(Text(f"ippon demo: {error}", style="red"))
        return EXIT_FAILED
    except KeyboardInterrupt:
        screen.print("ending")
        # Who waits for a result must not take an interrupted search for one that found something.
        return EXIT_INTERRUPTED if command.exit_when_done else 0
    finally:
        _end_on(signal.SIGTERM, lambda *_: None)
        running.close()
    return 0


def prefix_part(name: str) -> str:
    """Return a name as a key prefix takes it: letters, digits, '_', '.' and '-'."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", name)[:LONGEST_NAME] or "home"


def _check(command: Demo, context: str) -> "RobotProfile":
    """Refuse what cannot work before anything starts; returns the robot's profile."""
    if not command.object.strip():
        raise UsageError("no object given; for example: ippon demo --object hat")
    check_query(command.object, context)
    if command.no_search and command.exit_when_done:
        raise UsageError(
            "--exit-when-done ends with the search, and --no-search starts none; leave one away"
        )
    if command.port is not None and not 1 <= command.port <= 65535:
        raise UsageError(f"a port lies in 1 to 65535; got {command.port}")
    if command.port is not None and not command.headless and not port_is_free(command.port):
        raise UsageError(
            f"port {command.port} is taken; name another with --port, or leave --port away for the "
            "first free one"
        )
    model = make_model(command.llm, os.environ)
    if model is not None:
        model.close()  # The navigator makes its own; here a mistake is told before anything starts.
    from app.robot_file import map_config, read_profile

    try:
        profile = read_profile(command.profile)
        map_config(profile, command.voxel_size_m)
    except ValueError as error:
        raise UsageError(str(error)) from error
    return profile


def _end_on(number: int, handler: Callable[..., None] | None = None) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    signal.signal(number, handler or interrupt)


def _start_navigator(running: _Running, command: Demo) -> None:
    first = FIRST_LINK_PORT
    for _ in range(TRIES):
        port = free_port(first)
        try:
            _try_navigator(running, command, port)
        except _PortTakenError:
            running.leave()
            first = port + 1
        else:
            return
    raise DemoError(f"no port for the navigator: {TRIES} were taken one after the other")


def _try_navigator(running: _Running, command: Demo, port: int) -> None:
    running.endpoint = f"tcp/127.0.0.1:{port}"
    child = running.start("navigator", navigator_arguments(command, running.endpoint))
    deadline = time.monotonic() + READY_S
    while time.monotonic() < deadline:
        _refuse_ended(running, child, port)
        try:
            running.session = running.session or open_client(running.endpoint, 0.5)
        except LinkError:
            continue
        # Another navigator at this endpoint does not answer for our robot.
        if last_message(running.session, running.key(keys.LABELS), 0.5) is not None:
            return
    raise DemoError(f"the navigator was not ready within {READY_S:g} s")


def navigator_arguments(command: Demo, endpoint: str) -> list[str]:
    """Return what starts the demo's navigator."""
    sizes = ("--seed", str(command.seed), "--voxel-size-m", str(command.voxel_size_m))
    body = ("--profile", command.profile)
    model = as_arguments(command.llm)
    # Nobody waits for a robot in lock-step, and its search must repeat itself.
    pace = ("--step-budget-s", "0") if command.speed == "max" else ()
    file = () if command.config is None else ("--config", str(command.config.absolute()))
    return ["navigate", "--listen", endpoint, *body, *sizes, *model, *pace, *file]


def _refuse_ended(running: _Running, child: Child, port: int) -> None:
    if wait_for_end([child], 0.1) is None:
        return
    if child.ended() == EXIT_USAGE and not port_is_free(port):
        running.children.remove(child)
        raise _PortTakenError
    raise DemoError(f"the {child.name} ended while it was starting; its log stands above")


def _start_console(running: _Running, wanted: int | None) -> None:
    first = wanted or FIRST_PAGE_PORT
    for _ in range(TRIES):
        # Looked for only now, because others may have started while the navigator compiled.
        running.page_port = wanted or free_port(first)
        try:
            _try_console(running, running.page_port)
        except _PortTakenError:
            if wanted is not None:
                raise DemoError(f"port {wanted} was taken in the meantime") from None
            first = running.page_port + 1
        else:
            return
    raise DemoError(f"no port for the page: {TRIES} were taken one after the other")


def _try_console(running: _Running, port: int) -> None:
    child = running.start(
        "console", ["console", "--connect", running.endpoint, "--port", str(port)]
    )
    deadline = time.monotonic() + PAGE_S
    while time.monotonic() < deadline:
        _refuse_ended(running, child, port)
        if _page_is_of(running.robot, port):
            return
    raise DemoError(f"the console did not answer at port {port} within {PAGE_S:g} s")


def _page_is_of(robot: str, port: int) -> bool:
    """Tell whether the page shows this robot: another demo's console may have taken the port."""
    try:
        answer = httpx.get(f"http://127.0.0.1:{port}/health", timeout=1.0)
        return answer.is_success and answer.json()["state"].get("robot") == robot
    except (httpx.HTTPError, ValueError, KeyError, AttributeError, TypeError):
        return False


def _listen(running: _Running) -> "queue.SimpleQueue[bytes]":
    """Collect the navigator's reports; only for one who reads them, because they pile up."""
    assert running.session is not None
    updates: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    running.session.declare_subscriber(
        running.key(keys.STATUS), lambda sample: updates.put(sample.payload.to_bytes())
    )
    return updates


def _search(running: _Running, wanted: str, context: str) -> int:
    assert running.session is not None
    request = SearchRequest(object=wanted, context=context, requester="ippon demo")
    try:
        accepted = ask(
            running.session, running.key(keys.SEARCH), request, SearchAccepted, timeout_s=10.0
        )
    except (LinkError, RequestRefusedError) as error:
        raise DemoError(str(error)) from error
    return accepted.goal_id


def _start_robot(running: _Running, command: Demo) -> Child:
    place = ("--home", command.home, "--profile", command.profile)
    arguments = ("sim", *place, "--connect", running.endpoint)
    return running.start(
        "robot", [*arguments, "--speed", command.speed, "--seed", str(command.seed)]
    )


def _start_recorder(running: _Running, root: Path | None, screen: Console) -> Child | None:
    """Start recording, before there is anything to record; without a disk the demo goes on."""
    where = () if root is None else ("--out", str(root.absolute()))
    child = running.start("recorder", ["record", "--connect", running.endpoint, *where])
    assert running.session is not None
    deadline = time.monotonic() + PAGE_S
    while time.monotonic() < deadline and wait_for_end([child], 0.0) is None:
        payload = last_message(running.session, running.key(keys.RECORDING), 0.5)
        if payload is not None:
            status = decode(payload, RecordingStatus)
            if status.state == "recording":
                running.recorded = status.session
                screen.print(Text(f"  recording to {status.session}\n"), soft_wrap=True)
                return child
            if status.state == "failed":
                break
        time.sleep(0.05)
    screen.print("[yellow]this session is not recorded; the log above says why[/yellow]")
    return child


def _supervise(running: _Running, robot: Child, screen: Console) -> None:
    """Wait for Ctrl-C; a part that dies on its own is an error, except for the console."""
    watched = list(running.children)
    while True:
        ended = wait_for_end(watched, 1.0)
        if ended is None:
            continue
        if ended.name == "recorder":
            screen.print("[yellow]the recorder ended; the session goes on unrecorded[/yellow]")
            watched.remove(ended)
            continue
        if ended.name == "console":
            screen.print(
                "[yellow]the console ended; navigator and robot go on; to start it again:[/yellow]"
            )
            # Never broken into lines: it is there to be copied.
            screen.print(Text(f"  {restart_command(running)}"), soft_wrap=True)
            watched.remove(ended)
            continue
        what = "the robot" if ended is robot else f"the {ended.name}"
        raise DemoError(f"{what} ended with status {ended.ended()}; its log stands above")


def restart_command(running: _Running) -> str:
    """Return what starts the console again, from any folder."""
    where = ("--connect", running.endpoint, "--robot", running.robot)
    return shlex.join([*PROGRAM, "console", *where, "--port", str(running.page_port)])
