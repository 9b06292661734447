"""Reads the command line and runs the command, importing only what that command needs."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import assert_never

import tyro

from app.cli.options import commands as options
from app.cli.options.evaluation import EvalRun
from app.errors import UsageError
from app.process.environment import prepare_process

EXIT_USAGE = 2
EXIT_INTERRUPTED = 130


def run(arguments: Sequence[str]) -> int:
    """Run one command and return its exit status."""
    command = _parse(arguments)
    try:
        prepare_process()
        return _dispatch(_with_config_file(command, arguments))
    except UsageError as error:
        print(f"ippon: {error}", file=sys.stderr)
        return EXIT_USAGE
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED


def _parse(arguments: Sequence[str], default: options.Command | None = None) -> options.Command:
    return tyro.cli(
        options.Command,  # pyright: ignore[reportArgumentType]
        args=list(arguments),
        default=tyro.MISSING if default is None else default,
        prog="ippon",
        description=(
            "Find things with a robot: a live 3D map of object probabilities, common sense, and "
            "informative path planning, steered from the browser."
        ),
        config=(tyro.conf.OmitSubcommandPrefixes,),
    )  # pyright: ignore[reportReturnType]


def _with_config_file(command: options.Command, arguments: Sequence[str]) -> options.Command:
    """Return the command with its configuration file below the flags that were given."""
    target = command.command if isinstance(command, options.Eval) else command
    if getattr(target, "config", None) is None:
        return command
    from app.cli.config_file import with_file

    match command:
        case options.Navigate() | options.Demo():
            return _parse(arguments, with_file(command))
        case options.Eval(command=EvalRun() as run):
            return _parse(arguments, replace(command, command=with_file(run)))
        case _:
            return command


def _dispatch(command: options.Command) -> int:
    match command:
        case options.Demo():
            from app.cli.processes.demo import run_demo

            return run_demo(command)
        case options.Sim():
            from app.cli.processes.sim import run_sim

            return run_sim(command)
        case options.Navigate():
            from app.cli.processes.navigate import run_navigate

            return run_navigate(command)
        case options.Segment():
            from app.cli.processes.segment import run_segment_command

            return run_segment_command(command)
        case options.Console():
            from app.cli.processes.console import run_console_command

            return run_console_command(command)
        case options.User():
            from app.cli.tools.user import run_user

            return run_user(command)
        case options.Record():
            from app.cli.processes.record import run_record

            return run_record(command)
        case options.Review():
            from app.cli.processes.review import run_review_command

            return run_review_command(command)
        case options.Export():
            from app.cli.tools.export import run_export

            return run_export(command)
        case options.Replay():
            from app.cli.processes.replay import run_replay_command

            return run_replay_command(command)
        case options.Recognise():
            from app.cli.tools.recognise import run_recognise

            return run_recognise(command)
        case options.Calibrate():
            from app.cli.tools.calibrate import run_calibrate

            return run_calibrate(command)
        case options.Ask():
            from app.cli.tools.ask import run_ask

            return run_ask(command)
        case options.Levels():
            from app.cli.tools.levels import run_levels

            return run_levels(command)
        case options.Eval():
            from app.cli.evaluation.dispatch import run_eval

            return run_eval(command.command)
        case options.Ros2():
            from app.cli.processes.ros2 import run_ros2

            return run_ros2(command)
        case options.Profile():
            from app.cli.tools.profile import run_profile

            return run_profile(command)
        case options.Certificates():
            from app.cli.setup.certificates import run_certificates

            return run_certificates(command)
        case options.Config():
            from app.cli.tools.config import run_config

            return run_config(command)
        case options.Doctor():
            from app.cli.tools.doctor import run_doctor

            return run_doctor(command)
        case _:
            assert_never(command)
