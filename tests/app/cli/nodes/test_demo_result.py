"""When a search of the demo is over."""

import queue
import subprocess
import sys
import time
from types import SimpleNamespace
from typing import Any

import pytest

from app.cli.nodes.demo import _Running, prefix_part, restart_command
from app.cli.nodes.demo_result import await_outcome
from app.cli.tools.ask import exit_status
from app.errors import DemoError
from app.messages.control import encode
from app.messages.keys import check_prefix
from app.messages.status import GoalStatus, Status, Timings


def report(goal=None, history=()):
    """The navigator's report with an active goal and some that are over."""
    return encode(
        Status(
            robot="r", version="1", stamp_ns=0, wall_ns=0, state="starting", why="", goal=goal,
            queue=[], history=list(history), find=None, streams=[], timings=Timings(), frames=3,
            elapsed_s=2.0, path_length_m=0.0, best_ooi=0.0, explored_m2=0.0, surface_voxels=0,
            voxel_size_m=0.1, map_revision=0,
        )
    )  # fmt: skip


def part(name: str, status: int | None = None) -> Any:
    return SimpleNamespace(name=name, ended=lambda: status)


def goal(outcome: Any, goal_id: int = 7):
    return GoalStatus(goal_id=goal_id, object="hat", outcome=outcome)


def heard(*reports):
    updates = queue.SimpleQueue()
    for content in reports:
        updates.put(content)
    return updates


@pytest.mark.parametrize(
    "last",
    [report(goal("found")), report(goal("exhausted")), report(None, [goal("cancelled")])],
    ids=["found", "exhausted", "cancelled"],
)
def test_the_search_is_over(last):
    others = report(goal("found", 6), [goal("cancelled", 5)])
    updates = heard(others, report(goal("queued")), report(goal("active")), last)
    status, ended = await_outcome([part("navigator"), part("robot")], updates, 7)
    assert ended.goal_id == 7
    assert encode(status) == last


def test_the_result_does_not_need_the_page():
    parts = [part("navigator"), part("console", -9), part("robot")]
    assert await_outcome(parts, heard(report(goal("found"))), 7)[1].outcome == "found"


@pytest.mark.parametrize(
    ("outcome", "status"), [("found", 0), ("exhausted", 1), ("cancelled", 1), ("out_of_reach", 4)]
)
def test_the_exit_status_tells_a_find_from_one_out_of_reach(outcome, status):
    assert exit_status(goal(outcome)) == status


@pytest.mark.parametrize("name", ["navigator", "robot"])
def test_the_result_needs_navigator_and_robot(name):
    parts = [part("navigator"), part("console"), part("robot")]
    parts = [part(name, -9) if p.name == name else p for p in parts]
    with pytest.raises(DemoError, match=f"the {name} ended with status -9"):
        await_outcome(parts, heard(), 7)


@pytest.mark.parametrize(
    ("name", "part"),
    [("home-3", "home-3"), ("Bob's flat", "Bob_s_flat"), ("café 3", "caf_3"), ("", "home")],
)
def test_any_folder_name_makes_a_key_prefix(name, part):
    assert prefix_part(name) == part
    check_prefix(f"ippon/{prefix_part(name)}-4194304")


def test_a_long_folder_name_makes_a_key_prefix():
    check_prefix(f"ippon/{prefix_part('x' * 255)}-4194304")


@pytest.mark.process
def test_what_starts_the_console_again_is_a_command_that_works(tmp_path):
    running = _Running(robot="ippon/home-3-1", endpoint="tcp/127.0.0.1:7450", page_port=8099)
    command = restart_command(running)
    assert command.startswith(sys.executable)
    assert "--connect tcp/127.0.0.1:7450 --robot ippon/home-3-1 --port 8099" in command
    log = tmp_path / "log"
    with log.open("wb") as stream:
        child = subprocess.Popen(["bash", "-c", f"exec {command}"], cwd=tmp_path, stderr=stream)
    try:
        deadline = time.monotonic() + 60.0
        while "console at http://127.0.0.1:8099" not in log.read_text():
            assert child.poll() is None, log.read_text()
            assert time.monotonic() < deadline, log.read_text()
            time.sleep(0.05)
    finally:
        child.terminate()
        child.wait()
