"""Reads the command line and runs the command, importing only what that command needs."""

import importlib.metadata
import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, assert_never

import tyro

from app.cli.exit_status import EXIT_INTERRUPTED, EXIT_USAGE
from app.cli.options import nodes, tools
from app.cli.options.certificates import Certificates
from app.cli.options.commands import BY_NAME, Command
from app.cli.options.evaluation import Eval, EvalRun
from app.cli.options.recognition import Calibrate, Recognise
from app.cli.options.ros2 import Ros2
from app.cli.options.viewers import Foxglove, Rerun
from app.errors import UsageError
from app.process.environment import prepare_process

_ROBOT: Final = ("robot",)
_ASKS: Final = ("requester", "console")
_WATCHES: Final = ("recorder", "console", "requester")
_ROLES: Final[dict[type, tuple[str, ...]]] = {
    nodes.Sim: _ROBOT,
    nodes.Replay: _ROBOT,
    nodes.Segment: _ROBOT,
    Ros2: _ROBOT,
    nodes.Navigate: ("navigator",),
    nodes.Console: ("console",),
    nodes.Record: _WATCHES,
    Foxglove: _WATCHES,
    Rerun: _WATCHES,
    tools.Ask: _ASKS,
    tools.Control: _ASKS,
    tools.Memory: _ASKS,
    tools.Doctor: _WATCHES,
    tools.Profile: _WATCHES,
}
"""Roles of certificates with which a command works."""


def run(arguments: Sequence[str]) -> int:
    """Run one command and return its exit status."""
    if list(arguments) == ["--version"]:
        print(f"ippon {importlib.metadata.version('ippon')}")
        return 0
    try:
        # Without a command, its list.
        command = parse(arguments or ["--help"])
        prepare_process()
        _warn_of_role(command)
        return _dispatch(_with_config_file(command, arguments))
    except UsageError as error:
        print(f"ippon: {error}", file=sys.stderr)
        return EXIT_USAGE
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED


def _warn_of_role(command: Command) -> None:
    """Say that this process has the certificate of another role; without certificates, nothing."""
    match command:
        case tools.Doctor(robot=None, connect=None) | tools.Profile(from_robot=None):
            return  # It connects to no robot.
        case _:
            pass
    accepted = next((roles for kind, roles in _ROLES.items() if isinstance(command, kind)), ())
    if not accepted:
        return
    from app.links.network.session import PROFILE

    if not os.environ.get(PROFILE):
        return
    from app.certificates.own_role import role_mismatch

    if mismatch := role_mismatch(accepted):
        print(f"ippon: {mismatch}", file=sys.stderr)


def parse(arguments: Sequence[str], default: Command | None = None) -> Command:
    """Return the command that the arguments name, with their values over those of a default."""
    initial = tyro.MISSING_NONPROP if default is None else default
    config = (tyro.conf.OmitSubcommandPrefixes,)
    kind = BY_NAME.get(arguments[0])
    if kind is not None:
        # The parser of one command, and not of all, finds what was meant among its own options.
        rest, program = list(arguments[1:]), f"ippon {arguments[0]}"
        return tyro.cli(kind, args=rest, default=initial, prog=program, config=config)
    return tyro.cli(
        Command,  # pyright: ignore[reportArgumentType]
        args=list(arguments),
        default=initial,
        prog="ippon",
        description=(
            "Search for objects with a robot: a live 3D map of object probabilities, common "
            "sense, and informative path planning, operated from the browser. "
            "`ippon --version` prints the version."
        ),
        config=config,
    )  # pyright: ignore[reportReturnType]


def _with_config_file(command: Command, arguments: Sequence[str]) -> Command:
    """Return the command with the values of its configuration file; flags override them."""
    target = command.command if isinstance(command, Eval) else command
    if getattr(target, "config", None) is None:
        return command
    from app.cli.config_file import with_file

    match command:
        case nodes.Navigate() | nodes.Demo():
            return parse(arguments, with_file(command))
        case Eval(command=EvalRun() as run):
            return parse(arguments, replace(command, command=with_file(run)))
        case _:
            return command


def _dispatch(command: Command) -> int:
    match command:
        case Eval():
            from app.cli.evaluation.dispatch import run_eval

            return run_eval(command.command)
        case Recognise():
            from app.cli.tools.recognise import run_recognise

            return run_recognise(command)
        case Calibrate():
            from app.cli.tools.calibrate import run_calibrate

            return run_calibrate(command)
        case Foxglove():
            from app.cli.nodes.foxglove import run_foxglove_command

            return run_foxglove_command(command)
        case Rerun():
            from app.cli.nodes.rerun import run_rerun_command

            return run_rerun_command(command)
        case Ros2():
            from app.cli.nodes.ros2 import run_ros2

            return run_ros2(command)
        case Certificates():
            from app.cli.setup.certificates import run_certificates

            return run_certificates(command)
        case _:
            if isinstance(command, nodes.Node):
                return _run_node(command)
            return _run_tool(command)


def _run_node(command: nodes.Node) -> int:
    match command:
        case nodes.Demo():
            from app.cli.nodes.demo import run_demo

            return run_demo(command)
        case nodes.Sim():
            from app.cli.nodes.sim import run_sim

            return run_sim(command)
        case nodes.Navigate():
            from app.cli.nodes.navigate import run_navigate

            return run_navigate(command)
        case nodes.Segment():
            from app.cli.nodes.segment import run_segment_command

            return run_segment_command(command)
        case nodes.Console():
            from app.cli.nodes.console import run_console_command

            return run_console_command(command)
        case nodes.Record():
            from app.cli.nodes.record import run_record

            return run_record(command)
        case nodes.Review():
            from app.cli.nodes.review import run_review_command

            return run_review_command(command)
        case nodes.Replay():
            from app.cli.nodes.replay import run_replay_command

            return run_replay_command(command)
        case _:
            assert_never(command)


def _run_tool(command: tools.Tool) -> int:
    match command:
        case tools.User():
            from app.cli.setup.user import run_user

            return run_user(command)
        case tools.Export():
            from app.cli.tools.export import run_export

            return run_export(command)
        case tools.Ask():
            from app.cli.tools.ask import run_ask

            return run_ask(command)
        case tools.Control():
            from app.cli.questions.control import run_control

            return run_control(command)
        case tools.Read():
            from app.cli.tools.read import run_read

            return run_read(command)
        case tools.Memory():
            from app.cli.questions.memory import run_memory

            return run_memory(command)
        case tools.Levels():
            from app.cli.tools.levels import run_levels

            return run_levels(command)
        case tools.Profile():
            from app.cli.setup.profile import run_profile

            return run_profile(command)
        case tools.Config():
            from app.cli.setup.config import run_config

            return run_config(command)
        case tools.Doctor():
            from app.cli.setup.doctor import run_doctor

            return run_doctor(command)
        case _:
            assert_never(command)
