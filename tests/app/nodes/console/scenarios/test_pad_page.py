"""The driving pad in a real browser: it says why nothing moves, and covers no camera."""

import contextlib
import json
import time

import pytest
from playwright.sync_api import TimeoutError as PlaywrightTimeoutError
from playwright.sync_api import expect

from app.messages.driving import DriveStatus
from tests.app.lossy_relay import LossyRelay
from tests.app.nodes.console.opened_page import (
    WHOLE_MAP_TICKS,
    PageParts,
    expect_state,
    leave_out_scene,
    open_tab,
    panels,
)
from tests.chromium import boxes_at_rest

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def parts(stage, browser):
    parts = PageParts(stage, browser, most_voxels=2_000, moving_ticks=WHOLE_MAP_TICKS)
    yield parts
    parts.close()


@pytest.fixture(scope="module")
def opened(parts):
    return parts.open_page()


@pytest.fixture
def page(opened, parts):
    """The page of a robot in Manual that nobody has control of."""
    home = parts.home
    home.begin_again()
    home.state = "manual"
    home.status_changes = {"drive": DriveStatus(mode="manual")}
    opened.set_viewport_size({"width": 1440, "height": 900})
    expect_state(opened, "Manual")
    # What the test before it took may be told a little later.
    deadline = time.monotonic() + 60.0
    while (holder := opened.locator("#holder").inner_text()) != "nobody":
        assert time.monotonic() < deadline, holder
        if opened.locator("#lease-release").is_visible():
            # It may be told just now that nobody has control, which hides the button.
            with contextlib.suppress(PlaywrightTimeoutError):
                opened.locator("#lease-release").click(timeout=2_000)
        opened.wait_for_timeout(200)
    return opened


def test_without_control_the_pad_says_so_and_offers_it(page):
    note = page.locator("#pad-note")
    expect(note).to_have_text("You have no control: press Take.")
    page.keyboard.down("w")
    expect(page.get_by_role("button", name="Forward", exact=True)).to_have_attribute(
        "data-held", ""
    )
    page.keyboard.up("w")
    expect(page.locator("[data-held]")).to_have_count(0)
    page.locator("#pad-take").click()
    expect(page.locator("#holder")).to_have_text("you")
    expect(note).not_to_contain_text("control")
    expect(page.locator("#pad-take")).to_be_hidden()


def test_an_old_picture_is_said_on_the_pad(page, parts):
    page.locator("#pad-take").click()
    expect(page.locator("#camera")).to_have_attribute("data-state", "live")
    parts.home.frozen = True
    expect(page.locator("#pad-note")).to_contain_text("s old")
    reason = "stopped: no picture for 0.8 s"
    parts.home.status_changes = {"drive": DriveStatus(mode="manual", intervention=reason)}
    expect(page.locator("#pad-note")).to_have_text(reason)


def test_the_pad_comes_with_control_though_no_state_follows(page, parts):
    far = parts.window.new_page()
    leave_out_scene(far)
    held, taken = [], []

    def relay(route):
        server = route.connect_to_server()

        def pass_on(text):
            message = json.loads(text)
            if message["type"] == "you" and message["standing"] == "holds":
                held.append(lambda: route.send(text))
            elif message["type"] != "state" or not taken:
                # The state that tells of the holder is the last one.
                if message["type"] == "state" and message["lease"]["state"] != "free":
                    taken.append(message)
                route.send(text)

        server.on_message(pass_on)

    far.route_web_socket("**/api/ws*", relay)
    far.goto(f"http://127.0.0.1:{parts.port}")
    far.locator("#pad-take").click()
    expect(far.locator("#lease-request")).to_be_visible()
    expect(far.locator("#pad")).to_be_hidden()
    while not held:
        far.wait_for_timeout(100)
    held[0]()
    expect(far.locator("#holder")).to_have_text("you")
    expect(far.locator("#pad")).to_be_visible()
    expect(far.locator("#pad-note")).not_to_contain_text("control")
    far.close()


def test_keys_on_a_line_that_queues_move_nothing_and_the_pad_says_so(page, parts):
    relay = LossyRelay(parts.port, 0.0, 0.0)
    far = parts.window.new_page()
    leave_out_scene(far)
    far.goto(f"http://127.0.0.1:{relay.port}")
    note = far.locator("#pad-note")
    far.locator("#pad-take").click()
    expect(far.locator("#holder")).to_have_text("you")
    expect(note).not_to_contain_text("late")
    relay.latency_s = 1.5
    far.keyboard.down("w")
    expect(note).to_have_text("Keys arrive late: the line is slow. The robot stops.")
    far.keyboard.up("w")
    expect(note).not_to_contain_text("late")
    far.close()
    relay.close()


def test_a_robot_that_drives_to_a_point_is_not_said_to_be_in_manual(page, parts):
    open_tab(page, "Drive")
    panels(page).get_by_role("button", name="Manual", exact=True).click()
    answer = panels(page).locator(".ip-answer")
    expect(answer).not_to_have_count(0)
    parts.home.status_changes = {"drive": DriveStatus(waypoint=(1.0, 2.0))}
    expect_state(page, "Driving to a point")
    expect(page.locator("#mode")).to_have_text("Auto")
    expect(page.locator("#notice")).to_contain_text("Driving to the clicked point")
    parts.home.status_changes = {"drive": DriveStatus()}
    expect(answer).to_have_count(0)


def _meet(one, other):
    return (
        one["x"] < other["x"] + other["width"]
        and other["x"] < one["x"] + one["width"]
        and one["y"] < other["y"] + other["height"]
        and other["y"] < one["y"] + one["height"]
    )


def test_on_a_phone_the_camera_is_free_of_pad_and_plan(page):
    page.set_viewport_size({"width": 390, "height": 844})
    expect(page.locator("#plan")).to_be_hidden()
    # The panel leaves the right side a moment after the window has become narrow.
    expect(page.locator("#camera-picture")).to_have_js_property("clientWidth", 390)
    right = panels(page).locator("[data-dock-region='right']")
    camera, pad, panel = boxes_at_rest(page.locator("#camera-picture"), page.locator("#pad"), right)
    assert not _meet(camera, pad)
    assert camera["height"] > 200, "and it is not small"
    assert not _meet(panel, pad)


def test_on_a_phone_the_plan_is_free_of_notice_camera_and_tools(page, parts, stage):
    parts.home.begin_again()
    parts.home.find, parts.home.state = stage.find_of(), "found"
    page.set_viewport_size({"width": 390, "height": 844})
    expect(page.locator("#notice")).to_be_visible()
    page.locator("#plan-open").click()
    expect(page.locator("#notice")).to_be_hidden()
    expect(page.locator("#camera")).to_be_hidden()
    drawn, tools = boxes_at_rest(page.locator("#plan-picture"), page.locator(".plan-tools"))
    assert not _meet(drawn, tools)
    assert tools["height"] < 100, "two rows"
    page.locator("#plan-close").click()
    expect(page.locator("#notice")).to_be_visible()


def test_the_camera_of_a_paused_recording_is_not_said_to_be_old(page, parts):
    parts.home.frozen = True
    camera = page.locator("#camera")
    expect(camera).to_have_attribute("data-state", "lost")
    page.evaluate("document.body.toggleAttribute('data-paused', true)")
    expect(camera).to_have_attribute("data-state", "paused")
    expect(page.locator("#camera-age")).to_have_text("paused")
    page.evaluate("document.body.toggleAttribute('data-paused', false)")


def test_a_recording_that_is_played_has_no_age_and_no_latency(page, parts):
    parts.home.frozen = True
    camera = page.locator("#camera")
    expect(camera).to_have_attribute("data-state", "lost")
    page.evaluate("document.body.classList.add('review')")
    expect(camera).to_have_attribute("data-state", "live")
    expect(page.locator("#camera-age")).to_have_text("recorded")
    expect(page.locator("#camera-latency")).to_have_text("")
    page.evaluate("document.body.classList.remove('review')")
