"""The driving pad in a real browser: it says why nothing moves, and covers no camera."""

import pytest
from playwright.sync_api import expect

from app.messages.driving import DriveStatus
from tests.app.nodes.console.opened_page import PageParts, expect_state, open_tab, panels

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def parts(stage, browser):
    parts = PageParts(stage, browser, most_voxels=2_000)
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
    if opened.locator("#lease-release").is_visible():
        opened.locator("#lease-release").click()
    expect(opened.locator("#holder")).to_have_text("nobody")
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


def test_a_robot_that_drives_to_a_point_is_not_said_to_be_in_manual(page, parts):
    open_tab(page, "Drive")
    panels(page).get_by_role("button", name="Manual", exact=True).click()
    answer = panels(page).locator(".ip-answer")
    expect(answer).not_to_have_count(0)
    parts.home.status_changes = {"drive": DriveStatus(waypoint=(1.0, 2.0))}
    expect_state(page, "Driving to a point")
    expect(page.locator("#mode")).to_have_text("Auto")
    expect(page.locator("#notice")).to_contain_text("Driving to the point that you clicked")
    parts.home.status_changes = {"drive": DriveStatus()}
    expect(answer).to_have_count(0)
