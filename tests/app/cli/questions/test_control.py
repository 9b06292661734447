"""`ippon control` with a robot as the network shows it."""

import json
import threading

import msgspec
import pytest

from app.cli.main import run
from app.cli.options.tools import Control
from app.cli.questions.control import answer_text, status_lines
from app.links.network.session import open_router
from app.messages import keys
from app.messages.control import ControlReply
from app.messages.status import GoalStatus
from tests.app.nodes.console.drawn_home import status_of
from tests.app.nodes.console.published_home import PublishedHome
from tests.ports import free_port


@pytest.fixture
def robot():
    """A robot that searches for the hat, and the words that name it on the command line."""
    port = free_port()
    home = PublishedHome(port)
    home.where = ("--connect", f"tcp/127.0.0.1:{port}")
    yield home
    home.close()


def test_what_is_searched_for_what_waits_and_what_was_found(robot, capsys):
    robot.status_changes = {
        "queue": [GoalStatus(goal_id=3, object="mug", display="red mug", context="in the kitchen")],
        "history": [
            GoalStatus(goal_id=2, object="keys", outcome="found", position_world=(1.0, 2.0, 0.5)),
            GoalStatus(goal_id=4, object="bed", outcome="exhausted"),
        ],
    }
    assert run(["control", *robot.where]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("ippon: searching: ")
    assert lines[1].startswith("  goal 1, hat, I left it on the sofa: searching for ")
    assert lines[1].endswith(" m driven")
    assert lines[2:5] == [
        "  goal 3, red mug, in the kitchen: waits",
        "  goal 2, keys: found at (1.0, 2.0) m, z = 0.5 m",
        "  goal 4, bed: not found",
    ]
    assert run(["control", "--json", *robot.where]) == 0
    assert json.loads(capsys.readouterr().out)["goal"]["object"] == "hat"


@pytest.mark.parametrize(
    ("state", "why", "line"),
    [
        ("stopped", "stopped: press Resume to continue", "stopped: press Resume to continue"),
        ("found", "found tv: 72 voxels at p = 1.00", "found tv: 72 voxels at p = 1.00"),
        ("looking_around", "looking around (71%)", "looking around (71%)"),
        ("approaching", "going to where tv can be seen", "approaching: going to where tv can"),
        ("starting", "waiting", "starting: waiting"),
    ],
)
def test_the_state_is_said_once(state, why, line):
    status = status_of(state, why=why)
    assert next(status_lines(status)).startswith(f"ippon: {line}")


def test_stop_and_what_is_about_one_goal(robot, capsys):
    robot.status_changes = {"queue": [GoalStatus(goal_id=3, object="mug")]}
    assert run(["control", "stop", *robot.where]) == 0
    assert run(["control", "cancel", "--goal", "3", *robot.where]) == 0
    assert run(["control", "cancel", *robot.where]) == 0
    sent = [
        (key, json.loads(payload)) for key, payload in robot.requests if key in ("control", "queue")
    ]
    assert [(key, one["action"], one.get("goal_id")) for key, one in sent] == [
        ("control", "stop", None),
        ("queue", "remove", 3),
        ("control", "cancel", None),
    ]
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == ["ippon: stopped", "goal 3 is cancelled"]


@pytest.mark.parametrize(
    ("action", "state", "detail", "text"),
    [
        (
            "cancel",
            "starting",
            "the search for hat was cancelled",
            "the search for hat was cancelled",
        ),
        ("cancel", "starting", "", "starting"),
        ("stop", "stopped", "", "stopped"),
        ("resume", "looking_around", "more", "looking around; more"),
    ],
)
def test_cancel_answers_about_the_goal_and_the_others_about_the_robot(action, state, detail, text):
    reply = ControlReply(state=state, detail=detail)
    assert answer_text("ippon", Control(action=action), reply) == f"ippon: {text}"


def test_a_goal_goes_with_cancel_alone_and_a_dead_link_is_an_error(robot, capsys):
    assert run(["control", "resume", "--goal", "1", *robot.where]) == 2
    assert "--goal goes with cancel" in capsys.readouterr().err
    assert run(["control", "stop", "--connect", "tcp/127.0.0.1:1", "--timeout-s", "0.3"]) == 2
    assert "127.0.0.1:1" in capsys.readouterr().err


@pytest.fixture
def compiling():
    """The router of a navigator that compiles, and its endpoint."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    router = open_router(endpoint)
    token = router.liveliness().declare_token(f"r/{keys.NAVIGATOR_STARTING}")
    yield router, endpoint
    token.undeclare()
    router.close()


@pytest.mark.parametrize("action", ["show", "resume", "cancel"])
def test_a_navigator_that_compiles_is_waited_for_and_named(compiling, action, capsys):
    _, endpoint = compiling
    where = ("--connect", endpoint, "--robot", "r", "--timeout-s", "0.2")
    assert run(["control", action, *where]) == 2
    assert "the navigator of r still compiles its program" in capsys.readouterr().err


def test_a_navigator_that_is_ready_in_time_answers(compiling, capsys):
    router, endpoint = compiling

    answer, declared = msgspec.json.encode(status_of("searching")), []

    def become_ready():
        key = f"r/{keys.STATUS}"
        declared.append(router.declare_queryable(key, lambda query: query.reply(key, answer)))
        declared.append(router.liveliness().declare_token(f"r/{keys.NAVIGATOR_ALIVE}"))

    later = threading.Timer(0.5, become_ready)
    later.start()
    assert run(["control", "--connect", endpoint, "--robot", "r", "--timeout-s", "30"]) == 0
    later.join()
    assert "searching" in capsys.readouterr().out
