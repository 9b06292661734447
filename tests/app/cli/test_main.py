"""What the command line says to those who ask for the impossible."""

import dataclasses
import importlib
import json
import os
import pkgutil
import re
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from app.cli import options
from app.cli.main import run
from app.cli.nodes.demo import navigator_arguments
from app.cli.options.nodes import Demo
from app.homes import load_home
from app.links.network.registry import RunningNavigator, register
from app.robot_file import template
from ippon.mission.mission import Mission
from ippon.robot import ZED
from tests.locations import ROOT

LONG = "x" * 10_000


@pytest.fixture(autouse=True)
def own_runtime(runtime, monkeypatch):
    for name, value in runtime.items():
        monkeypatch.setenv(name, value)


def test_the_version(capsys):
    assert run(["--version"]) == 0
    assert re.fullmatch(r"ippon \d+\.\d+\.\d+\n", capsys.readouterr().out)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["demo", "--home", "nosuch"], "no home 'nosuch': give a seed"),
        (["demo", "--home", ""], "no home '': give a seed"),
        (["demo", "--home", "-3"], "no home '-3': give a seed"),
        (["demo", "--home", "99999999999"], "a home's seed is at most 2147483647"),
        (["demo", "--object", ""], "no object given"),
        (["demo", "--object", "   "], "for example: ippon demo --object hat"),
        (["demo", "--no-search", "--exit-when-done"], "--no-search starts none; remove one"),
        (["demo", "--voxel-size-m", "0"], "voxel_size_m must be positive"),
        (["demo", "--home", "²"], "no home '²': give a seed"),
        (["demo", "--object", LONG], "at most 80 and a context at most 2000 characters"),
        (["demo", "--context", LONG], "yours have 3 and 10000"),
        (["demo", "--port", "99999"], "a port lies in 1 to 65535; got 99999"),
        (["demo", "--seed", "-1"], "a seed is a whole number from 0 to 2^63 - 1; got -1"),
        (["sim", "--home", "nosuch"], "no home 'nosuch'"),
        (["sim", "--seed", "-1"], "a seed is a whole number from 0 to 2^63 - 1; got -1"),
        (["sim", "--start", "99"], "start poses 0 to 7; got 99"),
        (["sim", "--width", "0"], "images are 32 to 1920 pixels wide; got 0"),
        (["sim", "--rate-hz", "0"], "0.5 to 50 frames a second; got 0"),
        (["sim", "--robot", "a b"], "a robot's key prefix is letters"),
        (["sim", "--connect", "nonsense"], "'nonsense' is not a zenoh endpoint, such as"),
        (["sim", "--picture", "/nosuch/home.png"], "the folder /nosuch does not exist"),
        (["navigate", "--robot", "a/**"], "got 'a/**'"),
        (["navigate", "--seed", "-1"], "a seed is a whole number from 0 to 2^63 - 1; got -1"),
        (["navigate", "--listen", "foo"], "'foo' is not a zenoh endpoint"),
        (["navigate", "--voxel-size-m", "0"], "voxel_size_m must be positive"),
        (["navigate", "--step-budget-s", "-1"], "0 for a limit on evaluations instead; got -1"),
        (["navigate", "--step-budget-s", "inf"], "0 for a limit on evaluations instead; got inf"),
        (["console", "--port", "99999"], "a port lies in 0 to 65535"),
        (["console", "--host", "0.0.0.0"], "requires a login"),
        (["ask", ""], "no object given"),
        (["ask", "hat"], "no navigator runs on this machine, or it still prepares"),
        (["ask", "hat", "--timeout-s", "-1"], "--timeout-s is a positive number"),
        (["ask", "hat", "--context", LONG], "yours have 3 and 10000"),
        (
            ["ask", "hat", "--connect", "tcp/127.0.0.1:1", "--timeout-s", "0.5"],
            "no navigator answers at tcp/127.0.0.1:1 within 0.5 s",
        ),
        (["levels", ""], "no object given"),
        (["levels", "?!"], "no object in"),
        (["levels", "hat", "--llm.base-url", "http://127.0.0.1:1/v1"], "need a model: name it"),
        (
            ["levels", "hat", "--llm.model", "m", "--llm.base-url", "ftp://x"],
            "base_url 'ftp://x' is no HTTP address",
        ),
        (["levels", "hat", "--llm.look-every-s", "-1"], "is 0 or more seconds; got -1"),
        (["doctor", "--profile", "nosuch.yaml"], "--profile is of a robot or of a recording"),
        (["doctor", "--robot", "r", "--segmentation"], "--segmentation measures this machine"),
        (["doctor", "a.mcap", "--segmentation"], "--segmentation measures this machine"),
        (["doctor", "a.mcap", "--robot", "r"], "checked one at a time"),
        (["profile", "--from-robot", "r", "--picture", "r.png"], "write that of the robot to"),
        (["sim", "--picture", "a.png", "--export", "b"], "--picture or --export, not both"),
        (["review", "a", "--out", "b"], "add --recompute"),
        (["ask", "--add-label", "bookcase", "--follow"], "are about a search: name an object"),
        (["ask", "--add-label", "bookcase", "--context", "here"], "are about a search"),
        (["ask", "--add-label", "bookcase", "--explain"], "are about a search: name an object"),
        (["ask", "hat", "--show-prompt"], "--show-prompt goes with --explain"),
    ],
    ids=lambda value: " ".join(value)[:60] if isinstance(value, list) else "",
)
def test_the_impossible_is_refused_in_one_line(arguments, text, capsys):
    assert run(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert text in err
    assert len(err) < 1000
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("arguments", "budget_s"),
    [([], 0.04), (["--step-budget-s", "0.02"], 0.02), (["--step-budget-s", "0"], None)],
)
def test_the_seconds_of_planning_reach_the_planner(arguments, budget_s, monkeypatch):
    configs = []
    monkeypatch.setattr(
        "app.cli.nodes.navigate.run_navigator", lambda config, *_, **__: configs.append(config)
    )
    assert run(["navigate", *arguments]) == 0
    assert configs[0].mission.planner.step_budget_s == budget_s
    assert Mission(configs[0].mission, ZED, configs[0].labels, 0, clock=lambda: 0.0)


@pytest.mark.parametrize(("flags", "domain"), [([], 7), (["--no-connect-robot"], None)])
def test_a_profile_with_rmw_zenoh_reaches_the_navigator(flags, domain, tmp_path, monkeypatch):
    path = tmp_path / "scout.yaml"
    path.write_text(template(ZED) + "ros2: {middleware: rmw_zenoh, domain: 7}\n", encoding="utf-8")
    robots = []
    monkeypatch.setattr(
        "app.cli.nodes.navigate.run_navigator", lambda *_, ros2, **__: robots.append(ros2)
    )
    assert run(["navigate", "--profile", str(path), *flags]) == 0
    assert [robot and robot.domain for robot in robots] == [domain]


def test_a_demo_does_not_drive_the_robot_of_its_profile():
    assert "--no-connect-robot" in navigator_arguments(Demo())


def test_a_demo_in_lock_step_counts_the_work_of_planning():
    pace = ["--step-budget-s", "0"]
    assert navigator_arguments(Demo(speed="max"))[-2:] == pace
    assert "--step-budget-s" not in navigator_arguments(Demo())


def test_a_log_level_that_is_none(capsys, monkeypatch):
    monkeypatch.setenv("IPPON_LOG", "loud")
    assert run(["levels", "hat"]) == 2
    assert "IPPON_LOG is one of DEBUG, INFO, WARNING, ERROR; got 'loud'" in capsys.readouterr().err


def test_a_taken_port(capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert run(["demo", "--port", port]) == 2
    assert f"port {port} is taken; choose another with --port" in capsys.readouterr().err


def test_several_navigators_are_listed(request, capsys):
    for robot in ("ippon/one", "ippon/two"):
        entry = register(RunningNavigator(pid=os.getpid(), robot=robot, endpoint="tcp/127.0.0.1:9"))
        assert entry is not None
        request.addfinalizer(entry.close)
    assert run(["ask", "hat"]) == 2
    err = capsys.readouterr().err
    assert "--robot ippon/one" in err
    assert "--robot ippon/two" in err


def test_levels_as_json(capsys):
    assert run(["levels", "my hat", "--context", "I left it on the sofa", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["object"] == "hat"
    assert answer["levels"]["sofa"] == "certain"
    assert set(answer["levels"]) == set(answer["reasons"])


@pytest.mark.slow
def test_a_picture_of_a_home(room, tmp_path, capsys):
    picture = tmp_path / "home.png"
    assert run(["sim", "--home", str(room), "--picture", str(picture)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert str(picture) in capsys.readouterr().out


@pytest.mark.slow
def test_an_exported_home_is_a_home(tmp_path, capsys):
    folder = tmp_path / "home"
    assert run(["sim", "--home", "5", "--export", str(folder)]) == 0
    exported, made = load_home(str(folder)), load_home("5")
    assert f"{folder}: scene.glb and scene.json" in capsys.readouterr().out
    assert [one.node for one in exported.instances] == [one.node for one in made.instances]
    assert len(exported.start_poses) == len(made.start_poses)


@pytest.mark.process
def test_help_is_quick_and_complete():
    done = subprocess.run(
        [sys.executable, "-m", "app", "--help"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    for command in ("demo", "sim", "navigate", "console", "ask", "read", "levels", "doctor"):
        assert command in done.stdout


@pytest.mark.process
def test_ctrl_c_while_waiting_says_nothing_odd(launch, free_endpoint):
    robot = launch("sim", "--connect", free_endpoint, "--home", "3")
    # zenoh's threads look for the navigator.
    while psutil.Process(robot.child.pid).num_threads() == 1:
        assert robot.child.poll() is None, robot.log()
        time.sleep(0.02)
    robot.child.send_signal(signal.SIGINT)
    robot.finish()
    assert "Exception ignored" not in robot.log()


@pytest.mark.slow
def test_what_needs_no_map_loads_no_kernels():
    modules = (
        "cli.tools.ask", "cli.tools.follow", "cli.tools.read", "cli.questions.control",
        "demo.processes", "nodes.console.node", "nodes.recorder", "nodes.segment",
    )  # fmt: skip
    code = f"import sys, app.{', app.'.join(modules)}; print('numba' in sys.modules)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout == "False\n"


@pytest.mark.parametrize("arguments", [["--help"], ["eval", "run", "--help"]])
def test_a_reader_that_has_read_enough_is_no_error(arguments):
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "wb") as pipe:
        process = subprocess.run(
            [sys.executable, "-m", "app", *arguments],
            stdout=pipe,
            stderr=subprocess.PIPE,
            check=False,
        )
    assert (process.returncode, process.stderr) == (141, b"")


def test_no_option_is_a_double_negation():
    modules = [f"app.cli.options.{one.name}" for one in pkgutil.iter_modules(options.__path__)]
    commands = [
        one
        for module in map(importlib.import_module, modules)
        for one in vars(module).values()
        if dataclasses.is_dataclass(one)
    ]
    assert Demo in commands
    names = {field.name for command in commands for field in dataclasses.fields(command)}
    assert {name for name in names if name.startswith("no_")} == set()


@pytest.mark.parametrize("arguments", [["--help"], ["profile"]])
def test_output_to_a_full_disk_fails_in_a_sentence(arguments):
    with Path("/dev/full").open("wb") as full:
        process = subprocess.run(
            [sys.executable, "-m", "app", *arguments],
            stdout=full,
            stderr=subprocess.PIPE,
            check=False,
        )
    said = b"ippon: no space is left on the disk that it writes to\n"
    assert (process.returncode, process.stderr) == (3, said)


def test_without_a_command_the_commands_are_listed(capsys):
    with pytest.raises(SystemExit) as end:
        run([])
    assert end.value.code == 0
    assert "{demo,sim,navigate," in capsys.readouterr().out


def test_a_misspelt_option_is_explained_by_those_of_its_command(capsys):
    with pytest.raises(SystemExit):
        run(["sim", "--hom", "3"])
    said = " ".join(capsys.readouterr().err.split())
    assert "--home STR" in said
    assert "--homes" not in said, "an option of `ippon eval run`"
    assert "run ippon sim --help" in said
