"""Login, and who has control, in a real browser: one console with users, shared by all checks."""

import os
import time
from pathlib import Path

import pytest
from playwright.sync_api import expect

from app.nodes.console.web.accounts import add_account
from tests.chromium import KEEP_PICTURES, new_page, open_browser

pytestmark = pytest.mark.browser

PASSWORD = "correct horse"
LEASE_PACE = 0.1
"""Speed of the lease's clock: pages of a software renderer may be silent for seconds."""


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    folder = Path(os.environ.get(KEEP_PICTURES, tmp_path_factory.mktemp("pictures")))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture
def console(stage, tmp_path):
    users = tmp_path / "users"
    for name, role in (("Anna", "operator"), ("Bert", "supervisor"), ("Vera", "viewer")):
        add_account(users, name, PASSWORD, role)
    zenoh_port = stage.free_port()
    home = stage.PublishedHome(zenoh_port, lambda: LEASE_PACE * time.monotonic())
    console = stage.ConsoleProcess(zenoh_port, stage.free_port(), users)
    console.wait_until_up()
    for _ in range(25):
        home.tick()
    home.frozen = True
    yield console
    console.close()
    home.close()


@pytest.fixture
def open_page(console):
    """Open a page in a browser of its own, as another operator would."""
    with open_browser() as browser:

        def open_one(*, scene=False):
            page = new_page(browser, 1280, 720)
            if not scene:
                # Software rendering of several scenes would leave their scripts no time.
                page.route("**/view/**", lambda route: route.abort())
            page.goto(console.url)
            return page

        yield open_one


def log_in(page, name, password=PASSWORD):
    page.get_by_label("Name").fill(name)
    page.get_by_label("Password").fill(password)
    page.get_by_role("button", name="Log in").click()


def press(page, selector):
    """Click without waiting for a still picture."""
    expect(page.locator(selector)).to_be_visible()
    page.locator(selector).evaluate("button => button.click()")


def holder(page, text):
    expect(page.locator("#holder")).to_have_text(text)


def test_login_roles_and_control_as_people_meet_them(open_page, console, pictures):
    anna = open_page()
    expect(anna).to_have_title("Log in – IPPON")
    log_in(anna, "Anna", "wrong horse")
    expect(anna.get_by_role("alert")).to_have_text("Name or password is wrong.")
    anna.screenshot(path=pictures / "login.png")
    log_in(anna, "Anna")
    expect(anna.locator("#state")).to_have_text("Searching")
    holder(anna, "nobody")
    expect(anna.locator("#log-out")).to_have_attribute("title", "Log out Anna (operator)")
    press(anna, "#lease-take")
    holder(anna, "you")

    vera = open_page(scene=True)
    log_in(vera, "Vera")
    holder(vera, "Anna")
    for button in ("#lease-take", "#lease-request", "#lease-over", "#lease-release"):
        expect(vera.locator(button)).to_be_hidden()
    panel = vera.frame_locator("#view").locator("[data-ip-watching]")
    expect(panel).to_have_attribute(
        "data-ip-watching", "Your login can watch and stop the robot, but not command it."
    )
    view = vera.frame_locator("#view")
    for name, opacity in (("Search", "0.5"), ("Camera", "1")):
        button = view.get_by_role("button", name=name, exact=True)
        expect(button).to_have_css("opacity", opacity)
        view.get_by_role("tab", name="Map").click()
    vera.screenshot(path=pictures / "viewer.png")
    press(vera, "#stop")
    expect(vera.locator("#state")).to_have_text("Stopped")
    vera.context.close()

    bert = open_page(scene=True)
    log_in(bert, "Bert")
    holder(bert, "Anna")
    told = bert.frame_locator("#view").locator("[data-ip-watching]")
    expect(told).to_have_attribute("data-ip-watching", "Anna has control. You are watching.")
    press(bert, "#lease-request")
    expect(anna.locator("#asked")).to_contain_text("Bert requests control.")
    anna.screenshot(path=pictures / "asked.png")
    press(anna, "#asked [data-lease=deny]")
    expect(told).to_have_attribute("data-ip-watching", "Anna keeps control. You are watching.")
    expect(anna.locator("#asked")).to_be_hidden()
    press(bert, "#lease-request")
    expect(anna.locator("#asked")).to_be_visible()
    press(anna, "#asked .grant")
    holder(bert, "you")
    holder(anna, "Bert")
    anna.screenshot(path=pictures / "watching.png")

    bert.context.close()
    holder(anna, "nobody")
    press(anna, "#log-out")
    expect(anna).to_have_title("Log in – IPPON")
    anna.goto(console.url)
    expect(anna).to_have_title("Log in – IPPON")
