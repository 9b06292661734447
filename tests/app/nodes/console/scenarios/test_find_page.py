"""What the page says and offers when a search ends, in a real browser."""

import msgspec
import pytest
from playwright.sync_api import expect

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
def home(parts):
    """A navigator in the middle of a search."""
    parts.home.begin_again()
    return parts.home


@pytest.fixture
def page(opened, home):
    """The page of a robot that searches."""
    opened.set_viewport_size({"width": 1440, "height": 900})
    open_tab(opened, "Search")
    expect_state(opened, "Searching")
    return opened


def _find(home, stage, **changes):
    """Have the robot find the hat."""
    home.goal = msgspec.structs.replace(home.goal, outcome="found")
    home.find = msgspec.structs.replace(stage.find_of(), **changes)
    home.state = "found"


def test_after_confirm_nothing_asks_for_a_verdict_any_more(home, page, stage):
    _find(home, stage)
    expect_state(page, "Found")
    expect(page.locator("#notice")).to_contain_text("Found: hat")
    confirm = panels(page).get_by_role("button", name="Confirm: this is it")
    confirm.click()
    expect_state(page, "Confirmed")
    expect(page.locator("#notice")).to_be_hidden()
    expect(confirm).to_be_hidden()
    expect(panels(page).get_by_role("button", name="Not this: keep looking")).to_be_hidden()
    expect(panels(page).locator(".ip-now")).to_contain_text("Confirmed: hat")
