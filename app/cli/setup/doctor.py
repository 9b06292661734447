"""`ippon doctor`: checks the installation, connections, speed, or a recording."""

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Final

import zenoh
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from app.cli.nodes.segment import config_of, models_folder
from app.cli.options.tools import Doctor
from app.cli.setup.licences import run_licences
from app.cli.tools.navigator_address import find_navigator
from app.datasets.bag_robot import read_bag_robot
from app.datasets.messages import is_bag
from app.doctor.checks import check_machine, check_segmentation
from app.doctor.finding import Finding, Verdict
from app.doctor.robot.checkup import check_robot
from app.doctor.robot.recorded import SECONDS as CHECKED_S
from app.doctor.robot.recorded import check_bag
from app.doctor.robot.ros_graph import RosGraph
from app.doctor.robot.samples import SECONDS, Samples, listen
from app.errors import UsageError
from app.links.fleet.navigators import live_navigators
from app.links.network.session import LinkError, open_client
from app.recording.errors import RecordingError
from app.recording.reading.repair import RecordingCheck, check
from app.robot_file import RobotFileError, read_robot

COLORS: Final[dict[Verdict, str]] = {
    "ok": "green",
    "warning": "yellow",
    "missing": "red",
    "failed": "red",
}
EXIT_UNWELL: Final = 1


def run_doctor(command: Doctor) -> int:
    """Run the checks and print their results; exit status 1 when something is missing."""
    _check_options(command)
    if command.licences:
        return run_licences(as_json=command.json)
    if command.recording is not None:
        return _run_file_doctor(command)
    if command.robot is not None or command.connect is not None:
        return _report(_robot_findings(command), as_json=command.json)
    findings = check_machine(_tell)
    if command.segmentation:
        _tell("segmentation network")
        network = command.network
        try:
            config = config_of(network)
        except ValueError as error:
            raise UsageError(str(error)) from error
        findings.append(check_segmentation(config, network.models or models_folder()))
    return _report(findings, as_json=command.json)


def _check_options(command: Doctor) -> None:
    """Refuse options that would have no effect.

    Raises:
        UsageError: There is one.
    """
    is_robot = command.robot is not None or command.connect is not None
    if is_robot and command.recording is not None:
        raise UsageError("a recording and a robot are checked one at a time")
    is_machine = not is_robot and command.recording is None
    if command.licences and (command.segmentation or not is_machine):
        raise UsageError("--licences lists packages and checks nothing: only --json goes with it")
    if command.segmentation and not is_machine:
        raise UsageError(
            "--segmentation measures this machine: check the robot or the recording in another "
            "command"
        )
    if command.profile is not None and is_machine:
        raise UsageError(
            "--profile is of a robot or of a recording: name one, for example with --robot ippon"
        )


def _tell(what: str) -> None:
    """Print what is checked next, on standard error: the table comes when all is done."""
    print(f"checking {what} …", file=sys.stderr, flush=True)


def _report(findings: Sequence[Finding], *, as_json: bool) -> int:
    """Print findings; return the exit status."""
    if as_json:
        print(json.dumps([asdict(finding) for finding in findings]))
    else:
        _print_table(findings, "ippon doctor")
    return EXIT_UNWELL if any(f.verdict in ("missing", "failed") for f in findings) else 0


def _robot_findings(command: Doctor) -> list[Finding]:
    """Listen to a robot and check what it sends.

    Raises:
        UsageError: The profile cannot be read, or no navigator is named, running or answering.
    """
    try:
        named = None if command.profile is None else read_robot(command.profile)
    except RobotFileError as error:
        raise UsageError(str(error)) from error
    endpoint, robot = find_navigator(command.connect, command.robot)
    try:
        session = open_client(endpoint)
    except LinkError as error:
        raise UsageError(str(error)) from error
    ros2 = None if named is None else named.rmw_zenoh
    graph = None if ros2 is None else RosGraph(session, ros2)
    try:
        _tell(f"{robot} at {endpoint}, {SECONDS:g} s of its messages")
        samples = listen(session, robot)
        found = _check_name(session, robot, samples)
        if graph is not None:
            # It says whether the robot's nodes take commands.
            samples.onlookers = False
            found += graph.check()
        if named is None:
            return [*found, *check_robot(samples, None, 0.0)]
        return [*found, *check_robot(samples, named.profile, named.clock_offset_s)]
    finally:
        if graph is not None:
            graph.close()
        session.close()  # pyright: ignore[reportUnknownMemberType]


def _check_name(session: zenoh.Session, robot: str, samples: Samples) -> list[Finding]:
    """Return a line where the router has navigators, and none of this name."""
    names = [] if samples.navigator else live_navigators(session)
    if not names or robot in names:
        return []
    return [
        Finding(
            # A robot may have its messages carried by the navigator of another one.
            what="navigator", verdict="warning" if samples.arrivals else "missing",
            detail=f"no navigator of {robot} on this router; there is {', '.join(names[:6])}",
            do=f"name the robot, for example with --robot {names[0]}",
        )
    ]  # fmt: skip


def _print_table(findings: Sequence[Finding], title: str) -> None:
    table = Table(title=title, title_justify="left", title_style="bold")
    for column in ("", "what", "found"):
        table.add_column(column)
    for finding in findings:
        mark = Text("● " + finding.verdict, style=COLORS[finding.verdict])
        text = Text(finding.detail)
        if finding.do:
            text.append(f"\n→ {finding.do}", style="bold")
        table.add_row(mark, finding.what, text)
    Console().print(table)


def _run_file_doctor(command: Doctor) -> int:
    """Check and repair a recording, and print what is missing; exit status 1 for what is wrong."""
    path = command.recording
    assert path is not None
    if path.is_dir() and not is_bag(path):
        raise UsageError(
            f"{path} is not a recording: it holds no .mcap or .db3 file. A dataset of images is "
            "checked by `ippon recognise`, which says what it lacks"
        )
    try:
        robot = read_bag_robot(command.profile, command.base_frame)
        checkup = check(
            path,
            repair=True,
            names=robot.names,
            mount=robot.T_base_camera is not None,
            clock_offset_s=robot.clock_offset_s,
            base=robot.base,
        )
        profile = None if command.profile is None else read_robot(command.profile).profile
    except (RecordingError, RobotFileError) as error:
        raise UsageError(str(error)) from error
    # A session of ours holds fewer depth images than came, and was checked when they came.
    streams = [] if checkup.ours else check_bag(path, robot, profile, checkup.duration_s)
    if command.json:
        print(json.dumps(asdict(checkup) | {"streams": [asdict(one) for one in streams]}))
    else:
        _print_checkup(path, checkup)
        if streams:
            _print_table(streams, f"Streams, at most {CHECKED_S:g} s from the middle")
    is_unwell = checkup.problems and not checkup.repaired
    return EXIT_UNWELL if is_unwell or any(one.verdict == "failed" for one in streams) else 0


def _print_checkup(path: Path, checkup: RecordingCheck) -> None:
    screen = Console(highlight=False)
    screen.print(f"[bold]{escape(str(path))}[/bold]", soft_wrap=True)
    used = " of known topics" if checkup.others else ""
    screen.print(f"  {checkup.messages} messages{used}, {checkup.duration_s:.1f} s")
    for problem in checkup.problems:
        screen.print(f"  [yellow]{escape(problem)}[/yellow]", soft_wrap=True)
    if checkup.repaired:
        screen.print("  [green]repaired: index, timeline and metadata.yaml were rewritten[/green]")
        if checkup.kept:
            screen.print(f"  the file as it was is kept: {escape(checkup.kept)}", soft_wrap=True)
    elif checkup.complete and not checkup.problems:
        screen.print("  [green]whole[/green]")
    if checkup.missing:
        screen.print(f"  without: {', '.join(checkup.missing)}", soft_wrap=True)
    if checkup.others:
        screen.print("  topics that are not used:")
    for one in checkup.others:
        line = f"    {one.topic} ({one.type or 'no type'}), {one.messages} messages"
        screen.print(escape(line), soft_wrap=True)
