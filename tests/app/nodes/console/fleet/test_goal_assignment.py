"""Goals in plain words for the robots of a real router, as a page gives them."""

import threading

import pytest

from app.links.network.session import open_router
from app.messages.control import Bid
from app.messages.lease import Credential
from app.nodes.console.fleet.goal_assignment import GoalAssignment, GoalToGive
from app.nodes.console.web.browsers import Browser
from app.view.words import ENGLISH, Words
from tests.app.nodes.console.light_navigators import LightNavigator, room, wait_until_listed
from tests.ports import free_port

IN_THE_KITCHEN = "find my red mug, I left it in the kitchen"
ANNA = Browser("a" * 20, "Anna", "operator")


@pytest.fixture
def site():
    """A router, its robots, and a console that gives goals to them."""
    port = free_port()
    router = open_router(f"tcp/127.0.0.1:{port}")
    opened = []

    def add(name, bid=None):
        opened.append(LightNavigator(port, name, bid=bid))
        wait_until_listed(port, [name])
        return opened[-1]

    def give(sentence, *, sure=False, browser=ANNA, say=ENGLISH):
        desk = GoalAssignment(f"tcp/127.0.0.1:{port}", "a", say)
        goal = GoalToGive(sentence=sentence, sure=sure)
        who = Credential(session=browser.session, name=browser.name)
        return desk.give(goal, browser, lambda _: who)

    add.give, add.port = give, port
    yield add
    for one in opened:
        one.close()
    router.close()


def test_the_nearest_free_robot_gets_it_and_every_other_has_a_reason(site):
    near = site("near", room(2.04))
    far = site("site/far", room(12.0))
    site("held", room(0.5, "held", "Bert"))
    site("elsewhere", Bid(obstacle="", ground="unknown", place="kitchen"))
    site("old")
    given = site.give(IN_THE_KITCHEN)
    assert (given.ok, given.robot, given.path) == (True, "near", "/robot/near/")
    assert given.text == "near searches for: red mug (kitchen, 2.0 m away)."
    assert {one.name: one.why for one in given.others} == {
        "site/far": "free · kitchen, 12.0 m away",
        "elsewhere": "free · “kitchen” is not on its map",
        "held": "Bert has control · kitchen, 0.5 m away",
        "old": "version 0.1.0 does not know this request",
    }
    assert [one.path for one in given.others if one.name == "site/far"] == ["/robot/site~far/"]
    (search,) = near.searches
    assert (search.object, search.context) == ("red mug", "I left it in the kitchen")
    assert (search.requester, search.if_free) == ("console", True)
    assert far.searches == []
    assert near.who[0].name == "Anna"


def test_in_german(site):
    site("nah", room(2.04))
    site("fern", room(12.0, "searching", "hat"))
    given = site.give(IN_THE_KITCHEN, say=Words("de"))
    assert given.text == "nah sucht: red mug (Küche, 2,0 m entfernt)."
    assert given.others[0].why == "sucht „Hut“ · Küche, 12,0 m entfernt"


def test_if_nobody_is_free_nothing_is_queued(site):
    robots = [
        site("a", room(2.0, "stopped")),
        site("b", room(1.0, "manual")),
        site("c", room(1.0, "lost", "waiting for tf")),
    ]
    given = site.give("mug")
    assert not given.ok
    assert given.text == "No robot is free: nobody got the goal, and none waits for it."
    whys = [one.why.split(" · ")[0] for one in given.others]
    assert whys == ["stopped", "a person drives it", "no data: waiting for tf"]
    assert all(one.searches == [] for one in robots)


def test_two_pages_at_once_get_two_robots_or_one_of_them_none(site):
    robots = [site("a", room(2.0)), site("b", room(3.0))]
    desk = GoalAssignment(f"tcp/127.0.0.1:{site.port}", "a", ENGLISH)
    results = []

    def give(wanted):
        results.append(desk.give(GoalToGive(sentence=wanted), ANNA, lambda _: None))

    threads = [threading.Thread(target=give, args=(name,)) for name in ("mug", "hat", "keys")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60.0)
    assert sorted(one.robot for one in results) == ["", "a", "b"]
    assert [len(one.searches) for one in robots] == [1, 1]


@pytest.mark.parametrize(
    ("sentence", "text"),
    [
        ("  ", "Say what to look for."),
        ("hello there", "No object was found in it; say what to look for"),
        ("Stop!", "No object was found in it; say what to look for"),
        ("wo ist mein Hut", "This looks like German"),
        ("my keys and my wallet", "2 objects are named: give one at a time."),
        ("find 200 screws", "At most 99 of one kind are counted; got 200. Ask for all of them."),
        ("x" * 81, "At most 80 characters; these are 81."),
    ],
)
def test_a_sentence_that_gives_no_goal_asks_no_robot(site, sentence, text):
    robot = site("a", room(2.0))
    given = site.give(sentence)
    assert (given.ok, given.doubtful, given.others) == (False, False, [])
    assert given.text.startswith(text)
    assert robot.who == []


def test_a_doubtful_reading_is_shown_before_any_robot_is_asked(site):
    robot = site("a", room(2.0))
    sentence = "find the blorp thing and so on in the kitchen or whatever"
    given = site.give(sentence)
    assert (given.ok, given.doubtful) == (False, True), given
    assert given.text.startswith("Understood: ")
    assert given.text.endswith("Press again to give it like this.")
    assert robot.who == []
    assert site.give(sentence, sure=True).robot == "a"


def test_a_viewer_gives_no_goal(site):
    robot = site("a", room(2.0))
    given = site.give("mug", browser=Browser("v" * 20, "Vera", "viewer"))
    assert "your login (viewer) can watch and stop the robot" in given.text
    assert robot.who == []


def test_without_robots_or_router_that_is_said(site):
    assert site.give("mug").text == "No navigator is on the router: nobody got the goal."
    assert site.give(IN_THE_KITCHEN).text == "No navigator is on the router: nobody got the goal."
    desk = GoalAssignment(f"tcp/127.0.0.1:{free_port()}", "a", ENGLISH)
    given = desk.give(GoalToGive(sentence="mug"), ANNA, lambda _: None)
    assert not given.ok
    assert "no navigator answers at" in given.text
