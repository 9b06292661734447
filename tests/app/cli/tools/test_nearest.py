"""`ippon ask --nearest` with light robots on a real router."""

import json
import threading
import time

import pytest

from app.cli.main import run
from app.links.network.session import open_router
from app.messages.status import GoalStatus
from tests.app.nodes.console.light_navigators import LightNavigator, room, wait_until_listed
from tests.ports import free_port


@pytest.fixture
def site():
    """A router with a near robot, a far one, and one that somebody else has control of."""
    port = free_port()
    router = open_router(f"tcp/127.0.0.1:{port}")
    robots = {
        name: LightNavigator(port, name, bid=bid)
        for name, bid in (
            ("far", room(9.0)),
            ("near", room(2.5)),
            ("held", room(0.5, "held", "Anna")),
        )
    }
    wait_until_listed(port, robots)

    def ask(*arguments):
        connect = ("--connect", f"tcp/127.0.0.1:{port}")
        return run(["ask", "--nearest", *arguments, *connect])

    ask.robots = robots
    yield ask
    for one in robots.values():
        one.close()
    router.close()


def test_the_nearest_gets_it_and_the_others_are_explained(site, capsys):
    assert site("find my red mug, I left it in the kitchen") == 0
    out, err = capsys.readouterr()
    assert out == "near searches for: red mug (kitchen, 2.5 m away). goal 2\n"
    assert "  far: free · kitchen, 9.0 m away\n" in err
    assert "  held: Anna has control · kitchen, 0.5 m away\n" in err
    (search,) = site.robots["near"].searches
    assert (search.context, search.requester) == ("I left it in the kitchen", "ippon ask")


def test_as_json(site, capsys):
    assert site("mug", "--context", "in the kitchen", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["robot"], told["bid"]["way_m"], told["accepted"]["goal_id"]) == ("near", 2.5, 2)
    assert [(one["robot"], one["problem"]) for one in told["others"]] == [("far", ""), ("held", "")]


def test_if_nobody_is_free_the_exit_status_says_so(site, capsys):
    assert site("mug") == site("hat") == 0
    assert site("keys") == 1
    err = capsys.readouterr().err
    assert "No robot is free: nobody got the goal, and none waits for it." in err
    assert "  near: refused: it is not free any more: searching\n" in err
    assert [len(one.searches) for one in site.robots.values()] == [1, 1, 0]


def test_follow_stays_with_the_robot_that_got_it(site, capsys):
    near = site.robots["near"]

    def find_it():
        while not near.searches:
            time.sleep(0.02)
        time.sleep(0.5)
        near.goal = GoalStatus(goal_id=2, object="mug", outcome="found")

    finder = threading.Thread(target=find_it)
    finder.start()
    assert site("mug", "--follow") == 0
    finder.join()
    assert "searching: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("mug", "--take"), "--nearest takes control from nobody"),
        (("mug", "--explain"), "--explain is about one robot"),
        (("mug", "--add-label", "shelf"), "--add-label is about one robot"),
        (("my keys and my wallet",), "2 objects are named: give one at a time with --nearest"),
        (("hello there",), "no object was found"),
    ],
)
def test_what_cannot_be_given_is_said(site, capsys, arguments, text):
    assert site(*arguments) == 2
    assert text in capsys.readouterr().err
    assert all(one.who == [] for one in site.robots.values())


def test_without_robots_that_is_said(capsys):
    port = free_port()
    router = open_router(f"tcp/127.0.0.1:{port}")
    assert run(["ask", "mug", "--nearest", "--connect", f"tcp/127.0.0.1:{port}"]) == 2
    assert "no navigator is on the router" in capsys.readouterr().err
    router.close()
