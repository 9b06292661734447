"""`ippon demo`: robot, navigator, console and recorder on this machine, for one search."""

import json
import os
import queue
import signal
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rich.console import Console
from rich.padding import Padding
from rich.text import Text

from app.cli.exit_status import EXIT_FAILED, EXIT_INTERRUPTED, exit_status
from app.cli.options.nodes import Demo
from app.cli.tools.language_model import as_arguments, make_model
from app.cli.tools.levels import check_query
from app.demo.processes import DemoProcesses, prefix_part
from app.errors import DemoError, UsageError
from app.homes import load_home
from app.process.children import port_is_free
from app.process.stop_signal import interrupt
from app.view.words import Words
from ippon.seed import check_seed

if TYPE_CHECKING:
    from ippon.robot import RobotProfile
    from ippon.simulation.scene import Scene

DEFAULT_CONTEXT: Final = {"hat": "I think I left it on the sofa"}


def run_demo(command: Demo) -> int:
    """Start everything and search, until Ctrl-C or, if requested, the end of the search."""
    context = command.context
    if context is None:
        context = DEFAULT_CONTEXT.get(command.object, "")
    profile = _check(command, context)
    scene = load_home(command.home)
    signal.signal(signal.SIGTERM, interrupt)
    # A shell starts background processes with SIGINT ignored.
    signal.signal(signal.SIGINT, interrupt)
    screen = Console(file=sys.stderr)
    robot = f"ippon/{prefix_part(scene.name)}-{os.getpid()}"
    processes = DemoProcesses(robot, language=Words(command.language).language)
    try:
        beside = None if command.headless else partial(processes.begin_console, command.port)
        processes.start_navigator(navigator_arguments(command), beside)
        if not command.headless:
            page = processes.start_console(command.port)
            screen.print(f"\n  IPPON is at [bold]{page}[/bold]\n")
        if command.record:
            _start_recorder(processes, command.record_to, screen)
        updates = processes.status_updates() if command.exit_when_done else None
        goal_id = processes.search(command.object, context) if command.search else None
        told = f"  searching for {command.object}" if command.search else "  waiting for a search"
        screen.print(Text(f"{told}; Ctrl-C ends the demo\n"))
        processes.start_robot(robot_arguments(command))
        _say_contents(screen, command, scene)
        if updates is not None and goal_id is not None:
            return _report_result(processes, command.object, updates, goal_id, profile, scene)
        _supervise(processes, screen)
    except DemoError as error:
        screen.print(Text(f"ippon demo: {error}", style="red"))
        return EXIT_FAILED
    except KeyboardInterrupt:
        screen.print(f"ending{'; `ippon review` shows what happened' if command.record else ''}")
        # With --exit-when-done, status 0 would mean that the object was found.
        return EXIT_INTERRUPTED if command.exit_when_done else 0
    finally:
        signal.signal(signal.SIGTERM, lambda *_: None)
        processes.close()
    return 0


def navigator_arguments(command: Demo) -> list[str]:
    """Return the arguments of the demo's navigator, without endpoint and prefix."""
    sizes = ("--seed", str(command.seed), "--voxel-size-m", str(command.voxel_size_m))
    body = ("--profile", command.profile)
    model = as_arguments(command.llm)
    # In lock-step, planning may take its time, and the search must be repeatable.
    pace = ("--step-budget-s", "0") if command.speed == "max" else ()
    file = () if command.config is None else ("--config", str(command.config.absolute()))
    return [*body, "--no-connect-robot", *sizes, *model, *pace, *file]


def robot_arguments(command: Demo) -> list[str]:
    """Return the arguments of the demo's robot, without endpoint and prefix."""
    place = ("--home", command.home, "--profile", command.profile)
    return [*place, "--speed", command.speed, "--seed", str(command.seed)]


def _check(command: Demo, context: str) -> "RobotProfile":
    """Check the options before anything starts; return the robot's profile."""
    if not command.object.strip():
        raise UsageError("no object given; for example: ippon demo --object hat")
    check_query(command.object, context)
    if command.exit_when_done and not command.search:
        raise UsageError(
            "--exit-when-done ends with the search, but --no-search starts none; remove one"
        )
    try:
        check_seed(command.seed)
    except ValueError as error:
        raise UsageError(str(error)) from error
    if command.port is not None and not 1 <= command.port <= 65535:
        raise UsageError(f"a port lies in 1 to 65535; got {command.port}")
    if command.port is not None and not command.headless and not port_is_free(command.port):
        raise UsageError(
            f"port {command.port} is taken; choose another with --port, or omit --port for the "
            "first free one"
        )
    model = make_model(command.llm, os.environ)
    if model is not None:
        model.close()  # The navigator makes its own; this call only checks the options.
    from app.robot_file import map_config, read_profile

    try:
        profile = read_profile(command.profile)
        map_config(profile, command.voxel_size_m)
    except ValueError as error:
        raise UsageError(str(error)) from error
    return profile


def _say_contents(screen: Console, command: Demo, scene: "Scene") -> None:
    from app.demo.contents import holds, said_contents

    if command.search and not holds(scene, command.object):
        text = f"  there is no {command.object} in this home, so that it cannot be found\n"
        screen.print(Text(text, style="yellow"))
    screen.print(Padding(Text(said_contents(scene), style="dim"), (0, 0, 1, 2)))


def _start_recorder(processes: DemoProcesses, root: Path | None, screen: Console) -> None:
    folder = processes.start_recorder(root)
    if folder is not None:
        screen.print(Text(f"  recording to {folder}\n"), soft_wrap=True)
    else:
        screen.print("[yellow]this session is not recorded; see the log above[/yellow]")


def _report_result(
    processes: DemoProcesses,
    wanted: str,
    updates: "queue.SimpleQueue[bytes]",
    goal_id: int,
    profile: "RobotProfile",
    scene: "Scene",
) -> int:
    """Wait for the end of the search, print its result as JSON, and return the exit status."""
    from app.demo.result import await_outcome, end_recording, measured_result

    status, goal = await_outcome(processes.children, updates, goal_id)
    result = measured_result(processes.session, processes.robot, profile, status, goal, scene)
    result["session"] = end_recording(processes.recorder, processes.recorded, result)
    print(json.dumps({"object": wanted, **result}), flush=True)
    return exit_status(goal)


def _supervise(processes: DemoProcesses, screen: Console) -> None:
    """Wait for Ctrl-C or the end of an essential process; report the end of others."""
    for name in processes.supervise():
        if name == "recorder":
            screen.print("[yellow]the recorder ended; the session is no longer recorded[/yellow]")
        else:
            screen.print(
                "[yellow]the console ended; the search continues; to restart the console:[/yellow]"
            )
            # Without line breaks, so that it can be copied.
            screen.print(Text(f"  {processes.console_command()}"), soft_wrap=True)
