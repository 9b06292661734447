"""The demo as whole processes."""

import json
import os
import re
import signal
import time
from pathlib import Path

import httpx2
import pytest

from app.links.network.requests import last_message
from app.links.network.session import open_client
from app.messages import keys
from app.messages.control import decode
from app.messages.status import Status
from tests.ports import free_port

pytestmark = [pytest.mark.process, pytest.mark.slow]

ONE_SEARCH = ("--headless", "--exit-when-done", "--speed", "max", "--home", "4")
"""The bed is in the room next to the start."""


def _stat(pid):
    """Return the fields of /proc/PID/stat after the name; empty when the process is gone."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except (FileNotFoundError, ProcessLookupError):
        return []


def children_of(parent):
    """Return {pid: command line} of the processes that a process has started."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and _stat(entry.name)[1:2] == [str(parent)]:
            found[int(entry.name)] = (entry / "cmdline").read_text().replace("\0", " ")
    return found


def alive(pid):
    return _stat(pid)[:1] not in ([], ["Z"])


def wait_until_gone(pids, timeout_s):
    deadline = time.monotonic() + timeout_s
    while [pid for pid in pids if alive(pid)]:
        left = [pid for pid in pids if alive(pid)]
        assert time.monotonic() < deadline, f"still running: {left}"
        time.sleep(0.05)


@pytest.fixture
def free_page_port():
    return str(free_port())


@pytest.fixture
def start(launch):
    """Start demos side by side; each gets its children's command lines by process."""

    def start(*options):
        demos = [launch("demo", *arguments) for arguments in options]
        for demo in demos:
            demo.wait_for_log("simulated robot in home-", timeout_s=240.0)
            demo.children = children_of(demo.child.pid)
            assert len(demo.children) == 4 - ("--headless" in demo.child.args), demo.children
        return demos

    return start


def kill(demo, command):
    """Kill the child that runs a command; return the others."""
    killed = next(pid for pid, line in demo.children.items() if f" {command} " in line)
    os.kill(killed, signal.SIGKILL)
    return [pid for pid in demo.children if pid != killed]


def search_once(launch):
    """Return what a whole search of one command reports."""
    demo = launch("demo", *ONE_SEARCH, "--object", "bed")
    status, out = demo.finish(280.0)
    assert status == 0, demo.log()
    result = json.loads(out.splitlines()[-1])
    assert Path(result.pop("session")).is_dir()
    return result


def test_one_command_finds_the_bed_in_lock_step(launch):
    result = search_once(launch)
    assert (result["object"], result["found"], result["correct"]) == ("bed", True, True)
    assert 0.0 < result["spl"] <= 1.0
    assert result["frames"] > 10
    assert result["path_length_m"] > 0.0


@pytest.mark.large
def test_lock_step_repeats_itself(launch):
    # Of robot and mission alone: test_robot_sim.py and test_trial.py.
    assert search_once(launch) == search_once(launch)


def test_a_dead_console_is_replaced_and_a_dead_navigator_is_the_end(start, free_page_port):
    (demo,) = start(("--home", "3", "--object", "toilet", "--port", free_page_port))
    assert httpx2.get(f"http://127.0.0.1:{free_page_port}/health", timeout=60.0).is_success
    others = kill(demo, "console")
    demo.wait_for_log("-P -m app console --connect", timeout_s=60.0)
    assert f"--port {free_page_port}\n" in demo.log()
    assert all(alive(pid) for pid in others)
    assert demo.child.poll() is None

    demo.children = children_of(demo.child.pid)
    kill(demo, "navigate")
    status, _ = demo.finish(60.0)
    assert status == 3
    assert "the navigator ended" in demo.log()
    wait_until_gone(demo.children, 20.0)


def test_an_interrupted_search_is_no_result(launch):
    demo = launch("demo", "--headless", "--exit-when-done", "--home", "3", "--object", "toilet")
    demo.wait_for_log("simulated robot in home-3", timeout_s=240.0)
    children = children_of(demo.child.pid)
    demo.child.send_signal(signal.SIGINT)
    assert demo.finish(60.0) == (130, "")
    wait_until_gone(children, 5.0)


def where(demo):
    """Return endpoint and prefix of a demo's navigator."""
    line = next(line for line in demo.children.values() if " navigate " in line)
    return re.findall(r"--listen (\S+) .*--robot (\S+)", line)[0]


@pytest.mark.large
def test_demos_side_by_side_do_not_disturb_each_other(launch, start):
    demos = start(("--home", "3", "--object", "toilet"), ("--home", "4", "--object", "bed"))
    pages = [re.findall(r"IPPON is at (\S+)", demo.log())[0] for demo in demos]
    assert len(set(pages)) == 2
    for demo, page in zip(demos, pages, strict=True):
        robot = httpx2.get(f"{page}/health", timeout=60.0).json()["state"]["robot"]
        assert robot.endswith(f"-{demo.child.pid}")
    places = [where(demo) for demo in demos]
    assert len({endpoint for endpoint, _ in places}) == 2
    assert len({robot for _, robot in places}) == 2
    goals = []
    for endpoint, robot in places:
        session = open_client(endpoint)
        heard = []
        session.declare_subscriber("**", lambda s, heard=heard: heard.append(str(s.key_expr)))
        time.sleep(1.5)
        assert heard
        assert all(key.startswith(f"{robot}/") for key in heard)
        payload = last_message(session, f"{robot}/{keys.STATUS}", 5.0)
        assert payload is not None
        goals.append(decode(payload, Status).goal)
        session.close()
    assert [goal.object for goal in goals] == ["toilet", "bed"]

    # Without options `ippon ask` cannot know which one is meant.
    asked = launch("ask", "hat")
    assert asked.finish()[0] == 2
    assert "several navigators run on this machine" in asked.log()

    first, second = demos
    first.child.kill()
    wait_until_gone(first.children, 20.0)
    assert all(alive(pid) for pid in second.children)
    second.child.send_signal(signal.SIGINT)
    assert second.finish(60.0)[0] == 0
    wait_until_gone(second.children, 5.0)
    assert "Traceback" not in second.log()


def test_asking_and_following_from_another_terminal(launch, start):
    (demo,) = start(("--home", "4", "--headless", "--no-search", "--speed", "2"))
    asked = launch("ask", "find the bed, I think it is in the bedroom", "--follow", "--json")
    status, out = asked.finish(240.0)
    assert status == 0, asked.log()
    lines = [json.loads(line) for line in out.splitlines()]
    assert lines[0]["object"] == "bed"
    assert (lines[-1]["state"], lines[-1]["outcome"]) == ("found", "found")
    assert len(lines[-1]["position_world"]) == 3

    demo.child.send_signal(signal.SIGTERM)
    assert demo.finish(60.0)[0] == 0
    wait_until_gone(demo.children, 5.0)
