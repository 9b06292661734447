"""All robots on the router in a real browser: the list, the switch, and what twenty of them cost.

Every picture can be kept and looked at: set IPPON_KEEP_PICTURES to a folder.
"""

import dataclasses
import os
import time
from pathlib import Path

import pytest
from playwright.sync_api import expect

from app.messages.control import Bid
from app.messages.lease import LeaseStatus
from ippon.robot import ZED, CollisionSphere
from tests.app.nodes.console.light_navigators import LightNavigator
from tests.app.nodes.console.opened_page import WHOLE_MAP_TICKS, leave_out_scene
from tests.chromium import KEEP_PICTURES, PATIENCE_MS, new_window

pytestmark = pytest.mark.browser

DOG = dataclasses.replace(
    ZED,
    spheres=tuple(
        CollisionSphere(x_m=x, y_m=y, z_m=0.4, radius_m=0.18)
        for x in (-0.45, -0.22, 0.0, 0.22, 0.45)
        for y in (-0.1, 0.1)
    ),
    camera_height_m=0.5,
)
BIDS = {
    1: Bid(obstacle="", ground="room", place="kitchen", way_m=14.3),
    2: Bid(obstacle="held", detail="Anna", ground="room", place="kitchen", way_m=1.1),
    3: Bid(obstacle="", ground="room", place="Anna's kitchen", way_m=6.42),
    4: Bid(obstacle="", ground="unknown", place="kitchen"),
    5: Bid(obstacle="stopped", ground="unknown", place="kitchen"),
    6: Bid(obstacle="lost", detail="waiting for tf (3.0 s)", ground="unknown", place="kitchen"),
}
"""Of the first robots; the others are of a version without bids."""
FREE = {"state": "starting", "why": "waiting for a goal", "goal": None}
STATUSES = {
    1: FREE,
    2: {"lease": LeaseStatus(state="held", holder="Anna", epoch=1)},
    3: FREE,
    4: FREE,
    5: {"state": "stopped", "why": "stopped: press Resume to continue"},
    6: {"state": "lost", "why": "waiting for tf (3.0 s)"},
}
"""What they say when they are not asked."""
THINGS = ("hat", "keys", "red mug", "remote", "plant", "phone")


@pytest.fixture(scope="module")
def parts(stage, browser):
    """A console of a robot at home, with twenty more on its router."""
    zenoh_port = stage.free_port()
    home = stage.PublishedHome(zenoh_port, most_voxels=6_000, moving_ticks=WHOLE_MAP_TICKS)
    console = stage.ConsoleProcess(zenoh_port, stage.free_port())
    window = new_window(browser)
    console.wait_until_up()
    page = window.new_page()
    page.goto(console.url)
    expect(page.locator("#state")).to_have_text("Searching")
    alone = _core_percent(console)
    light = [_navigator(zenoh_port, n) for n in range(1, 21)]
    yield page, console, light, alone, zenoh_port
    window.close()
    console.close()
    for one in light:
        one.close()
    home.close()


def _navigator(zenoh_port, n):
    return LightNavigator(
        zenoh_port,
        f"site/robot-{n:02}",
        THINGS[n % len(THINGS)],
        # At the navigator's rate where the cost is measured.
        hz=5.0 if KEEP_PICTURES in os.environ else 2.0,
        profile=DOG if n == 2 else ZED,
        bid=BIDS.get(n),
        before=STATUSES.get(n),
    )


@pytest.fixture
def leaving(parts):
    """The second robot, which may be closed: another takes its place."""
    _, _, light, _, zenoh_port = parts
    yield light[1]
    light[1].close()
    light[1] = _navigator(zenoh_port, 2)


def _core_percent(console, seconds=8.0):
    """Share of a core that the console uses; None without a folder to keep the figure in."""
    if KEEP_PICTURES not in os.environ:
        return None
    ticks = os.sysconf("SC_CLK_TCK")

    def used_s():
        fields = Path(f"/proc/{console.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / ticks

    before, began = used_s(), time.monotonic()
    time.sleep(seconds)
    return round(100.0 * (used_s() - before) / (time.monotonic() - began), 1)


def _shoot(page, name):
    folder = os.environ.get(KEEP_PICTURES)
    if folder is not None:
        Path(folder).mkdir(parents=True, exist_ok=True)
        page.wait_for_timeout(1_500)
        page.screenshot(path=Path(folder) / f"{name}.png")


def _open_list(page):
    """Open the list with the keyboard, as if nobody had been there."""
    if page.locator("#robots").is_visible():
        page.locator("#robots-close").click()
    page.keyboard.press("b")
    expect(page.locator("#robots")).to_be_visible()


def test_all_robots_are_listed_and_cost_the_page_of_one_little(parts):
    page, console, _, alone, _ = parts
    with_twenty = _core_percent(console)
    _open_list(page)
    rows = page.locator("#robots-list li")
    expect(rows).to_have_count(21)
    expect(page.locator("#robots-count")).to_have_text("21 robots")
    own = rows.filter(has=page.locator("[aria-current='page']"))
    expect(own).to_contain_text("ippon")
    third = rows.filter(has_text="site/robot-02")
    expect(third).to_contain_text("Searching")
    expect(third).to_contain_text("“red mug”")
    expect(third).to_contain_text("answers in")
    _shoot(page, "robots")
    listed = _core_percent(console)
    folder = os.environ.get(KEEP_PICTURES)
    if folder is not None:
        text = f"% of a core: alone {alone}, with twenty {with_twenty}, listed {listed}\n"
        (Path(folder) / "robots_core_percent.txt").write_text(text)


def _give(page, light, sentence):
    """Give a goal, again while one of the robots was too slow: all of them are in one process."""
    answer, deadline = page.locator("#robots-answer"), time.monotonic() + PATIENCE_MS / 1e3
    late = page.locator(".robot-why", has_text="did not answer in time")
    unsure = answer.filter(has_text="did not confirm it")
    while True:
        for one in light:
            one.begin_again()
        page.locator("#robots-goal").fill(sentence)
        page.keyboard.press("Enter")
        expect(answer).not_to_have_text("Asking the robots…")
        if time.monotonic() > deadline or not (late.count() or unsure.count()):
            return


def test_a_goal_goes_to_the_nearest_free_robot_with_the_keyboard_alone(parts):
    page, _, light, *_ = parts
    field, answer = page.locator("#robots-goal"), page.locator("#robots-answer")
    page.set_viewport_size({"width": 1440, "height": 900})
    _open_list(page)
    page.keyboard.press("Tab")
    expect(field).to_be_focused()
    page.keyboard.type("what is this")
    page.keyboard.press("Enter")
    expect(answer).to_contain_text("No object was found in it")
    expect(answer).to_have_attribute("data-ok", "false")
    _give(page, light, "find my red mug, I left it in the kitchen")
    expect(answer).to_have_text("site/robot-03 searches for: red mug (Anna's kitchen, 6.4 m away).")
    expect(field).to_have_value("")
    expect(field).to_be_focused()
    rows = page.locator("#robots-list li")
    for name, why in (
        ("ippon", "searches for “hat” · kitchen, 3.2 m away"),
        ("site/robot-01", "free · kitchen, 14.3 m away"),
        ("site/robot-02", "Anna has control · kitchen, 1.1 m away"),
        ("site/robot-04", "free · “kitchen” is not on its map"),
        ("site/robot-06", "no data: waiting for tf (3.0 s)"),
        ("site/robot-07", "version 0.1.0 does not know this request"),
    ):
        expect(rows.filter(has_text=name).locator(".robot-why")).to_contain_text(why)
    third = rows.filter(has_text="site/robot-03")
    expect(third.locator(".robot-why")).to_have_text("got the goal")
    expect(third).to_contain_text("“red mug”")
    assert [len(one.searches) for one in light[:6]] == [0, 0, 1, 0, 0, 0]
    _shoot(page, "robots-given")
    page.set_viewport_size({"width": 390, "height": 844})
    for part in (field, page.locator("#robots-send")):
        box = part.bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390
        assert box["height"] >= 36
    _shoot(page, "phone-robots-given")
    page.set_viewport_size({"width": 1440, "height": 900})
    field.press("k")
    expect(third.locator(".robot-why")).to_be_empty()


def test_in_german_and_if_nobody_is_free(parts, stage):
    browser = parts[0].context.browser
    port = stage.free_port()
    home = stage.PublishedHome(port, most_voxels=2_000, moving_ticks=WHOLE_MAP_TICKS)
    second = LightNavigator(port, "lager", bid=BIDS[2])
    console = stage.ConsoleProcess(port, stage.free_port(), language="de")
    window = new_window(browser)
    console.wait_until_up()
    page = window.new_page()
    leave_out_scene(page)
    page.goto(console.url)
    expect(page.locator("#state")).to_have_text("Sucht")
    page.keyboard.press("b")
    expect(page.locator("#robots-give label")).to_have_text(
        "Ziel an den nächsten freien Roboter geben"
    )
    page.locator("#robots-goal").fill("red mug")
    page.get_by_role("button", name="Geben", exact=True).click()
    expect(page.locator("#robots-answer")).to_have_text(
        "Kein Roboter ist frei: Niemand hat das Ziel bekommen, und keiner hat es vorgemerkt."
    )
    row = page.locator("#robots-list li", has_text="lager")
    expect(row).to_contain_text("Anna steuert · Küche, 1,1 m entfernt")
    expect(page.locator("#robots-goal")).to_have_value("red mug")
    assert [key for key, _ in home.requests if key != "lease"] == ["bid"]
    assert second.searches == []
    _shoot(page, "robots-german")
    page.set_viewport_size({"width": 390, "height": 844})
    _shoot(page, "phone-robots-german")
    window.close()
    console.close()
    second.close()
    home.close()


def test_one_click_shows_the_page_of_another_robot_at_its_own_address(parts, leaving):
    page, console, *_ = parts
    page.set_viewport_size({"width": 1440, "height": 900})
    if page.url != f"{console.url}/":
        page.goto(console.url)
        expect(page.locator("#state")).to_have_text("Searching")
    _open_list(page)
    page.locator("#robots-list a", has_text="site/robot-02").click()
    expect(page).to_have_url(f"{console.url}/robot/site~robot-02/")
    expect(page.locator("#robot")).to_have_text("site/robot-02")
    expect(page.locator("#goal")).to_have_text("red mug")
    expect(page.frame_locator("#view").get_by_role("tab", name="Search")).to_be_visible()
    page.keyboard.press("b")
    current = page.locator("#robots-list [aria-current='page']")
    expect(current).to_contain_text("site/robot-02")
    leaving.close()
    expect(current).to_contain_text("gone · last heard")
    expect(page.locator("#notice-title")).to_have_text("No data from the navigator")
    _shoot(page, "robot-gone")
    page.set_viewport_size({"width": 390, "height": 844})
    for one in page.locator("#robots-list a").all():
        box = one.bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390
    _shoot(page, "phone-robots")
    page.set_viewport_size({"width": 1440, "height": 900})
    page.locator("#robots-list a", has_text="ippon").click()
    expect(page).to_have_url(f"{console.url}/")
    expect(page.locator("#state")).to_have_text("Searching")


def test_a_robot_that_is_not_there_is_refused(parts):
    page, console, *_ = parts
    answer = page.request.get(f"{console.url}/robot/nobody/")
    assert answer.status == 404
    assert "no navigator of the name “nobody” is, or was, at" in answer.text()
    answer = page.request.get(f"{console.url}/robot/site~robot-03", max_redirects=0)
    assert (answer.status, answer.headers["location"]) == (303, "/robot/site~robot-03/")
    answer = page.request.get(f"{console.url}/robot/ippon/", max_redirects=0)
    assert (answer.status, answer.headers["location"]) == (303, "/")


@pytest.fixture
def lost(parts, stage, browser):
    """The page of a console whose robot does not answer."""
    console = stage.ConsoleProcess(parts[4], stage.free_port(), robot="site/robot-99")
    window = new_window(browser)
    console.wait_until_up()
    page = window.new_page()
    leave_out_scene(page)
    page.goto(console.url)
    yield page
    window.close()
    console.close()


def test_a_page_whose_robot_does_not_answer_names_those_that_do(lost):
    expect(lost.locator("#state")).to_have_text("Waiting")
    expect(lost.locator("#veil-robots")).to_contain_text("Robots that answer here:")
    _shoot(lost, "waiting")
    link = lost.locator("#veil-robots").get_by_role("link").first
    name = link.inner_text()
    link.click()
    expect(lost.locator("#robot")).to_have_text(name)
    expect(lost.locator("#veil")).to_be_hidden()
