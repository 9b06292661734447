"""`ippon demo`: robot, navigator and console on this machine, one command, one search."""

import json
import os
import queue
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import httpx
import msgspec
import numpy as np
import zenoh
from rich.console import Console

from app.cli.children import Child, free_port, port_is_free, wait_for_end
from app.cli.errors import UsageError
from app.cli.homes import load_home
from app.cli.levels import check_query
from app.cli.options import Demo
from app.links.requests import RequestRefusedError, ask, last_message
from app.links.session import LinkError, open_client
from app.messages import keys
from app.messages.control import SearchAccepted, SearchRequest, Status, decode

if TYPE_CHECKING:
    from ippon.simulation.scene import Scene

DEFAULT_CONTEXT: Final = {"hat": "I think I left it on the sofa"}
FIRST_PAGE_PORT: Final = 8080
FIRST_LINK_PORT: Final = 7447
READY_S: Final = 300.0
"""The first start compiles every kernel."""
PAGE_S: Final = 30.0
SILENT_S: Final = 20.0
EXIT_NOT_FOUND: Final = 1
EXIT_FAILED: Final = 3


class DemoError(Exception):
    """A part of the demo failed; the text says which and what to look at."""


@dataclass(slots=True, kw_only=True)
class _Running:
    """What was started so far, in the order in which it must end."""

    robot: str
    endpoint: str
    children: list[Child] = field(default_factory=list)
    session: zenoh.Session | None = None
    updates: "queue.SimpleQueue[bytes]" = field(default_factory=queue.SimpleQueue)

    def key(self, topic: str) -> str:
        return f"{self.robot}/{topic}"

    def close(self) -> None:
        if self.session is not None:
            self.session.close()  # pyright: ignore[reportUnknownMemberType]
        for child in reversed(self.children):
            child.stop()


def run_demo(command: Demo) -> int:
    """Start everything, search, and end with Ctrl-C or, if asked, with the search."""
    context = command.context
    if context is None:
        context = DEFAULT_CONTEXT.get(command.object, "")
    check_query(command.object, context)
    page_port = _page_port(command)
    scene = load_home(command.home)
    _end_on(signal.SIGTERM)
    screen = Console(file=sys.stderr)
    running = _Running(
        robot=f"ippon/{scene.name.replace(' ', '_')}-{os.getpid()}",
        endpoint=f"tcp/127.0.0.1:{free_port(FIRST_LINK_PORT)}",
    )
    try:
        _start_navigator(running, command)
        if page_port is not None:
            _start_console(running, page_port)
            screen.print(f"\n  IPPON is at [bold]http://127.0.0.1:{page_port}[/bold]\n")
        goal_id = None if command.no_search else _search(running, command.object, context)
        robot = _start_robot(running, command)
        if command.exit_when_done and goal_id is not None:
            return _finish(running, goal_id, scene, command)
        _supervise(running, robot, screen)
    except DemoError as error:
        screen.print(f"[red]ippon demo: {error}[/red]")
        return EXIT_FAILED
    except KeyboardInterrupt:
        screen.print("ending")
    finally:
        _end_on(signal.SIGTERM, lambda *_: None)
        running.close()
    return 0


def _page_port(command: Demo) -> int | None:
    if command.headless:
        return None
    if command.port is None:
        return free_port(FIRST_PAGE_PORT)
    if not 1 <= command.port <= 65535:
        raise UsageError(f"a port lies in 1 to 65535; got {command.port}")
    if not port_is_free(command.port):
        raise UsageError(
            f"port {command.port} is taken; name another with --port, or leave --port away for the "
            "first free one"
        )
    return command.port


def _end_on(number: int, handler: Callable[..., None] | None = None) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    signal.signal(number, handler or interrupt)


def _start_navigator(running: _Running, command: Demo) -> None:
    arguments = ("navigate", "--listen", running.endpoint, "--robot", running.robot)
    child = Child("navigator", [*arguments, "--seed", str(command.seed)])
    running.children.append(child)
    deadline = time.monotonic() + READY_S
    while time.monotonic() < deadline:
        if wait_for_end([child], 0.1) is not None:
            raise DemoError("the navigator ended while it was starting; its log stands above")
        try:
            running.session = running.session or open_client(running.endpoint, 0.5)
        except LinkError:
            continue
        if last_message(running.session, running.key(keys.LABELS), 0.5) is not None:
            running.session.declare_subscriber(
                running.key(keys.STATUS), lambda s: running.updates.put(s.payload.to_bytes())
            )
            return
    raise DemoError(f"the navigator was not ready within {READY_S:g} s")


def _start_console(running: _Running, port: int) -> None:
    arguments = ("console", "--connect", running.endpoint, "--robot", running.robot)
    child = Child("console", [*arguments, "--port", str(port)])
    running.children.append(child)
    deadline = time.monotonic() + PAGE_S
    while time.monotonic() < deadline:
        if wait_for_end([child], 0.1) is not None:
            raise DemoError("the console ended while it was starting; its log stands above")
        try:
            if httpx.get(f"http://127.0.0.1:{port}/health", timeout=1.0).is_success:
                return
        except httpx.TransportError:
            continue
    raise DemoError(f"the console did not answer at port {port} within {PAGE_S:g} s")


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
    child = Child(
        "robot",
        [
            *("sim", "--home", command.home, "--connect", running.endpoint),
            *("--robot", running.robot, "--speed", command.speed, "--seed", str(command.seed)),
        ],
    )
    running.children.append(child)
    return child


def _supervise(running: _Running, robot: Child, screen: Console) -> None:
    """Wait for Ctrl-C; a part that dies on its own is an error, except for the console."""
    watched = list(running.children)
    while True:
        ended = wait_for_end(watched, 1.0)
        if ended is None:
            continue
        if ended.name == "console":
            screen.print(
                "[yellow]the console ended; navigator and robot go on; to start it again:[/yellow]"
                f"\n  ippon console --connect {running.endpoint} --robot {running.robot}"
            )
            watched.remove(ended)
            continue
        what = "the robot" if ended is robot else f"the {ended.name}"
        raise DemoError(f"{what} ended with status {ended.ended()}; its log stands above")


def _finish(running: _Running, goal_id: int, scene: "Scene", command: Demo) -> int:
    """Wait for the end of the search and print its result."""
    status = _await_outcome(running, goal_id)
    result = _result(running, status, scene, command)
    print(json.dumps(result), flush=True)
    return 0 if result["found"] else EXIT_NOT_FOUND


def _await_outcome(running: _Running, goal_id: int) -> Status:
    heard = time.monotonic()
    while True:
        ended = wait_for_end(running.children, 0.0)
        if ended is not None:
            raise DemoError(
                f"the {ended.name} ended with status {ended.ended()}; see its log above"
            )
        try:
            status = decode(running.updates.get(timeout=0.2), Status)
        except queue.Empty:
            if time.monotonic() - heard > SILENT_S:
                raise DemoError(f"the navigator has been silent for {SILENT_S:g} s") from None
            continue
        heard = time.monotonic()
        goal = status.goal
        if goal is not None and goal.goal_id == goal_id and goal.outcome != "active":
            return status


def _result(running: _Running, status: Status, scene: "Scene", command: Demo) -> dict[str, Any]:
    from app.nodes.robot_sim import Truth
    from ippon.evaluation.metrics import Judge
    from ippon.robot import ZED

    assert running.session is not None
    assert status.goal is not None
    payload = last_message(running.session, running.key(keys.SIM_TRUTH), 5.0)
    if payload is None:
        raise DemoError("the simulated robot does not say where it went")
    truth = msgspec.json.decode(payload, type=Truth)
    found = status.goal.outcome == "found"
    judge = Judge(scene, ZED, status.goal.object)
    metrics = judge.metrics(np.array(truth.trajectory, np.float64), stopped=found)
    return {
        "object": command.object,
        "found": found,
        "correct": metrics.success,
        "time_s": round(status.elapsed_s, 3),
        "path_length_m": round(metrics.path_length_m, 4),
        "spl": round(metrics.spl, 4),
        "soft_spl": round(metrics.soft_spl, 4),
        "frames": status.frames,
        "session": None,
    }
