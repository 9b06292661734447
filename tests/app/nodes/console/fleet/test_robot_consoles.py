"""Pages of several robots from one console, on real sockets."""

import time
from types import SimpleNamespace

import pytest

from app.links.network.session import open_router
from app.messages.control import Bid
from app.nodes.console.fleet import robot_consoles
from app.nodes.console.fleet.robot_consoles import RobotConsoles
from app.nodes.console.web.access import OpenAccess
from app.nodes.console.web.gateway import Gateway
from app.nodes.console.web.guard import Hosts
from tests.app.nodes.console.light_navigators import LightNavigator, wait_until_listed
from tests.app.nodes.console.served import hear
from tests.ports import free_port

BID = Bid(obstacle="", ground="area", explored_m2=12.0)


@pytest.fixture
def fleet(stage, viser_server, state_feed, navigator, browsers):
    """A console of robot "own" whose router has the robots a and site/b."""
    port = free_port()
    router = open_router(f"tcp/127.0.0.1:{port}")
    light = [LightNavigator(port, "a", "keys", bid=BID), LightNavigator(port, "site/b", "mug")]
    wait_until_listed(port, ["a", "site/b"])
    gateway = Gateway(viser_server, state_feed, navigator, OpenAccess(browsers), Hosts("127.0.0.1"))
    consoles = RobotConsoles(f"tcp/127.0.0.1:{port}", "own", gateway)
    app = gateway.app()
    app.router.routes += consoles.routes()
    consoles.start()
    consoles.light = light
    served = stage.Served(SimpleNamespace(app=lambda: app))
    yield served, consoles
    served.close()
    consoles.close()
    for one in light:
        one.close()
    router.close()


def _state_of(served, path, robot):
    """Follow the state of a page until its robot is live."""
    with served.socket(f"{path}api/ws") as shell:
        while True:
            state = hear(shell, "state")
            if state["link"] == "live":
                assert state["robot"] == robot
                return state


@pytest.mark.slow
def test_each_robot_has_a_page_with_its_own_state(fleet):
    served, _ = fleet
    page = served.get("/robot/site~b/")
    assert page.status_code == 200
    assert 'src="/robot/site~b/view/?darkMode"' in page.text
    assert "ippon-" in page.headers["set-cookie"], "a page makes a browser known"
    assert "script-src 'self';" in page.headers["content-security-policy"]
    view = served.get("/robot/site~b/view/")
    assert "wasm-unsafe-eval" in view.headers["content-security-policy"]
    assert _state_of(served, "/robot/a/", "a")["object"] == "keys"
    assert _state_of(served, "/robot/site~b/", "site/b")["object"] == "mug"
    robots = {one["name"]: one["path"] for one in served.get("/api/robots").json()["robots"]}
    assert robots == {"a": "/robot/a/", "site/b": "/robot/site~b/"}


def test_addresses_without_a_robot_are_refused(fleet):
    served, _ = fleet
    for path in ("/robot/c/", "/robot/", "/robot/%3Cb%3E/"):
        assert served.get(path).status_code == 404
    for path, to in (("/robot/a", "/robot/a/"), ("/robot/own/", "/")):
        answer = served.get(path)
        assert (answer.status_code, answer.headers["location"]) == (303, to)
    with pytest.raises(Exception, match="403"):
        served.socket("/robot/c/api/ws")
    answer = served.get("/robot/a/", headers={"Host": "evil.example"})
    assert answer.status_code == 403


def test_what_nobody_looks_at_is_closed_and_there_is_a_limit(fleet, monkeypatch):
    served, consoles = fleet
    monkeypatch.setattr(robot_consoles, "MAX_OPEN", 1)
    monkeypatch.setattr(robot_consoles, "IDLE_S", 0.0)
    with served.socket("/robot/a/api/ws") as shell:
        hear(shell, "state")
        answer = served.get("/robot/site~b/")
        assert answer.status_code == 404
        assert "1 other robots are open besides “own”" in answer.text
        consoles.close_idle()
        assert served.get("/robot/a/health").json()["console"] == "up"
    deadline = time.monotonic() + 10.0
    while served.get("/robot/site~b/").status_code != 200:
        assert time.monotonic() < deadline
        consoles.close_idle()
        time.sleep(0.05)


def test_an_open_page_does_not_wait_while_another_is_opened_or_closed(fleet):
    served, consoles = fleet
    assert served.get("/robot/a/").status_code == 200
    with consoles._lock:
        assert served.get("/robot/a/health", timeout=60.0).status_code == 200


def test_a_goal_is_given_with_the_control_that_the_browser_has_of_the_robot(fleet):
    served, consoles = fleet
    robot = consoles.light[0]
    served.get("/")
    given = served.post("/api/robots/give", content=b'{"sentence": "mug"}').json()
    assert (given["ok"], given["robot"], given["path"]) == (True, "a", "/robot/a/")
    assert [one["why"] for one in given["others"]] == ["version 0.1.0 does not know this request"]
    assert robot.searches[0].object == "mug"
    assert robot.who[0].name.startswith("browser ")
    assert robot.who[0].epoch == 0
    served.get("/robot/a/")
    console = consoles._open["a"].console
    twin = console.browsers.find(robot.who[0].session)
    twin.epoch = 7
    served.post("/api/robots/give", content=b'{"sentence": "hat"}')
    assert robot.who[1].epoch == 7


@pytest.mark.parametrize(
    ("content", "status", "text"),
    [
        (b"{}", 400, "missing required field `sentence`"),
        (b'{"sentence": "mug", "robot": "a"}', 400, "unknown field `robot`"),
        (b"\xff", 400, "not a goal"),
        (b'{"sentence": "' + b"x" * 3000 + b'"}', 400, "length <= "),
        (b" " * 30_000, 413, "too long"),
    ],
)
def test_what_is_no_goal_is_refused(fleet, content, status, text):
    served, consoles = fleet
    answer = served.post("/api/robots/give", content=content)
    assert answer.status_code == status
    assert text in answer.text
    assert consoles.light[0].searches == []


def test_another_site_gives_no_goal(fleet):
    served, consoles = fleet
    foreign = {"Origin": "http://evil.example"}
    answer = served.post("/api/robots/give", content=b'{"sentence": "mug"}', headers=foreign)
    assert answer.status_code == 403
    assert served.get("/api/robots/give").status_code == 405
    assert consoles.light[0].searches == []
