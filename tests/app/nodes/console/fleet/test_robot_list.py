"""The list of navigators on a real router."""

import time

import pytest

from app.links.fleet.navigators import ANSWER_S
from app.links.network.session import PROFILE, open_router
from app.nodes.console.fleet import robot_list
from app.nodes.console.fleet.robot_list import RobotList
from tests.app.nodes.console.light_navigators import LightNavigator
from tests.ports import free_port


@pytest.fixture
def robots(monkeypatch):
    """A router with a list of its robots; opened navigators are closed."""
    monkeypatch.setattr(robot_list, "FRESH_S", 0.0)
    port = free_port()
    router = open_router(f"tcp/127.0.0.1:{port}")
    listed = RobotList(f"tcp/127.0.0.1:{port}")
    opened = []

    def add(name, wanted="hat"):
        opened.append(LightNavigator(port, name, wanted))
        return opened[-1]

    yield listed, add
    listed.close()
    for one in opened:
        one.close()
    router.close()


def by_name(listed):
    shown = listed.shown()
    assert shown.problem == ""
    return {one.name: one for one in shown.robots}


def wait_until(listed, name, link):
    """On a busy machine a navigator is heard of late, and listed as silent meanwhile."""
    deadline = time.monotonic() + 20.0
    while (one := by_name(listed).get(name)) is None or one.link != link:
        assert time.monotonic() < deadline, one


def test_every_navigator_is_listed_with_what_it_searches(robots):
    listed, add = robots
    assert by_name(listed) == {}
    add("site/robot-2", "red mug")
    add("robot-1")
    for name in ("site/robot-2", "robot-1"):
        wait_until(listed, name, "live")
    shown = by_name(listed)
    assert list(shown) == ["robot-1", "site/robot-2"]
    mug = shown["site/robot-2"]
    assert (mug.link, mug.state, mug.object) == ("live", "searching", "red mug")
    assert mug.path == "/robot/site~robot-2/"
    assert 0.0 < mug.round_trip_ms < 1e3 * ANSWER_S
    assert listed.knows("robot-1")
    assert not listed.knows("robot-3")


def test_one_that_disappears_stays_listed_as_gone(robots):
    listed, add = robots
    one = add("robot-1", "keys")
    wait_until(listed, "robot-1", "live")
    one.close()
    wait_until(listed, "robot-1", "gone")
    gone = by_name(listed)["robot-1"]
    assert (gone.link, gone.object, gone.round_trip_ms) == ("gone", "keys", None)
    assert listed.knows("robot-1")
    add("robot-1", "keys")
    wait_until(listed, "robot-1", "live")


def test_two_of_one_name_are_told(robots):
    listed, add = robots
    add("robot-1")
    other = add("robot-1")
    wait_until(listed, "robot-1", "twice")
    other.close()
    wait_until(listed, "robot-1", "live")


def test_without_a_router_the_problem_is_told():
    listed = RobotList(f"tcp/127.0.0.1:{free_port()}")
    shown = listed.shown()
    assert shown.robots == []
    assert "no navigator answers at" in shown.problem
    listed.close()


def test_robots_of_joined_routers_are_listed_at_each(monkeypatch, tmp_path):
    ports = free_port(), free_port()
    first = open_router(f"tcp/127.0.0.1:{ports[0]}")
    join = tmp_path / "join.json5"
    join.write_text(f'{{connect: {{endpoints: ["tcp/127.0.0.1:{ports[0]}"]}}}}')
    with monkeypatch.context() as patch:
        patch.setenv(PROFILE, str(join))
        second = open_router(f"tcp/127.0.0.1:{ports[1]}")
    light = [LightNavigator(port, f"robot-{port}") for port in ports]
    monkeypatch.setattr(robot_list, "FRESH_S", 0.0)
    for port in ports:
        listed = RobotList(f"tcp/127.0.0.1:{port}")
        deadline = time.monotonic() + 20.0
        while [one.link for one in by_name(listed).values()] != ["live", "live"]:
            assert time.monotonic() < deadline
        listed.close()
    for one in light:
        one.close()
    second.close()
    first.close()
