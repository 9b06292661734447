"""What the page says and offers when a search ends, in a real browser."""

import re

import msgspec
import pytest
from playwright.sync_api import expect

from app.messages import keys
from app.messages.status import GoalStatus
from tests.app.nodes.console.opened_page import (
    PageParts,
    expect_state,
    open_tab,
    panels,
    text_field,
)

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def parts(stage, browser):
    parts = PageParts(stage, browser, most_voxels=12_000)
    yield parts
    parts.close()


@pytest.fixture(scope="module")
def opened(parts):
    return parts.open_page()


@pytest.fixture
def home(parts):
    """A navigator in the middle of a search."""
    parts.home.begin_again()
    parts.hold_still()
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


def test_search_pressed_twice_asks_before_it_searches_twice(home, page):
    text_field(page, "Find").fill("all cups and two towels")
    search = panels(page).get_by_role("button", name="Search", exact=True)
    search.click()
    expect(panels(page).locator(".ip-answer")).to_contain_text("Looking for: towel")
    search.click()
    expect(panels(page).locator(".ip-answer")).to_contain_text("This is searched for already.")
    assert [key for key, _ in home.requests].count(keys.SEARCH) == 2, "cups and towels"
    search.click()
    expect(panels(page).locator(".ip-answer")).to_contain_text("Looking for: towel")
    assert [key for key, _ in home.requests].count(keys.SEARCH) == 4
    text_field(page, "Find").fill("")


def test_end_names_the_goal_that_goes_on(home, page):
    wait = [GoalStatus(goal_id=n, object="cup", display=name, tour=3) for n, name in
            ((3, "cups"), (4, "towels"))]  # fmt: skip
    home.status_changes = {"queue": [*wait, GoalStatus(goal_id=5, object="mug")]}
    expect(panels(page).locator(".ip-goals")).to_contain_text("mug")
    panels(page).get_by_role("button", name="End", exact=True).click()
    expect(panels(page).locator(".ip-answer")).to_have_text(
        "The search is ended; the map is kept. Continuing with the next goal: cups, towels."
    )


def test_the_list_says_how_many_of_several_were_found(home, page):
    ended = GoalStatus(goal_id=9, object="towel", outcome="cancelled", count=2)
    home.status_changes = {"history": [ended]}
    expect(panels(page).locator(".ip-goals")).to_contain_text("cancelled, 0 of 2 found")


def test_what_was_not_found_is_said_also_when_the_next_goal_has_started(home, page):
    gone = msgspec.structs.replace(home.goal, outcome="exhausted")
    home.goal, home.state = gone, "exhausted"
    expect_state(page, "Not found")
    home.goal = GoalStatus(goal_id=2, object="mug", outcome="active")
    home.state, home.status_changes = "searching", {"history": [gone]}
    expect_state(page, "Searching")
    notice = page.locator("#notice")
    expect(notice).to_contain_text("Not found: hat")
    open_tab(page, "Session")
    notice.get_by_role("button", name="Likely places").click()
    listed = panels(page).get_by_text("Not found: hat.")
    expect(listed).to_be_visible()
    expect(panels(page).get_by_text("Most likely places, best first:")).to_be_visible()
    expect(panels(page).get_by_text("Place 1")).to_be_visible()
    expect(panels(page).locator(".ip-goals")).to_contain_text("not found")
    page.locator("#notice-close").click()
    expect(notice).to_be_hidden()
    panels(page).get_by_role("button", name="Close this list").click()
    expect(listed).to_be_hidden()
    expect(panels(page).get_by_text("Place 1")).to_be_hidden()


def test_a_doubtful_find_is_perhaps_everywhere(home, page, stage):
    home.status_changes = {"history": [GoalStatus(goal_id=9, object="tv", outcome="found")]}
    home.goal = msgspec.structs.replace(home.goal, display="red hat")
    _find(home, stage, perhaps=True)
    expect_state(page, "Perhaps found")
    expect(page.locator("#goal")).to_have_text("red hat")
    expect(page.locator("#notice")).to_contain_text("Perhaps found: red hat")
    expect(panels(page).locator(".ip-now")).to_contain_text("Perhaps found: red hat")
    expect(panels(page).locator(".ip-goals")).to_contain_text("found, not confirmed")
    page.keyboard.press("g")
    expect(page.locator("#goals-ended")).to_contain_text("found, not confirmed")
    page.keyboard.press("g")


def test_the_notice_leads_to_the_find_and_judges_it(home, page, stage):
    open_tab(page, "Session")
    _find(home, stage)
    notice = page.locator("#notice")
    expect(notice).to_contain_text("Found: hat Is this it?")
    notice.get_by_role("button", name="Show").click()
    tab = panels(page).get_by_role("tab", name="Search", exact=True)
    expect(tab).to_have_attribute("aria-selected", "true")
    expect(page.locator("#explanation")).to_be_visible()
    notice.get_by_role("button", name="Not this").click()
    expect_state(page, "Searching")
    assert home.requests[-1][0] == keys.FEEDBACK
    _find(home, stage, position_world=(1.0, 1.0, 0.5))
    notice.get_by_role("button", name="Confirm").click()
    expect_state(page, "Confirmed")
    expect(notice).to_be_hidden()


def test_a_notice_can_be_closed_on_a_phone_and_comes_back_for_another_find(home, page, stage):
    page.set_viewport_size({"width": 390, "height": 844})
    _find(home, stage, position_world=(2.0, 1.0, 0.5))
    notice = page.locator("#notice")
    expect(notice).to_be_visible()
    page.locator("#notice-close").click()
    expect(notice).to_be_hidden()
    expect_state(page, "Found")
    expect(notice).to_be_hidden()
    _find(home, stage, position_world=(3.0, 1.0, 0.5))
    expect(notice).to_be_visible()


def test_the_list_of_goals_leads_to_where_something_was_found(home, page):
    at = (4.0, 1.0, 0.5)
    ended = GoalStatus(goal_id=9, object="tv", outcome="found", confirmed=True, position_world=at)
    home.status_changes = {"history": [ended]}
    if page.locator("#explanation-close").is_visible():
        page.locator("#explanation-close").click()
    page.keyboard.press("g")
    page.locator("#goals-ended").get_by_role("button", name="Show where tv was found").click()
    expect(page.locator("#explanation")).to_be_visible()
    page.keyboard.press("g")


def test_a_map_that_is_gone_is_not_shown_on_the_plan(page):
    page.keyboard.press("p")
    none = page.locator("#plan-none")
    expect(none).to_be_hidden()
    page.route("**/api/export/plan.json", lambda route: route.fulfill(status=404))
    expect(none).to_be_visible()
    page.unroute("**/api/export/plan.json")
    expect(none).to_be_hidden()
    page.keyboard.press("p")


def test_of_two_pages_of_one_browser_one_rings_for_several_calls_at_once(page):
    rung = page.evaluate(
        """async () => {
          const { Calls } = await import("/assets/calls.js");
          const open = () => Object.assign(
            Object.create(Calls.prototype),
            { instance: "other", rung: 0, ring() { this.rung += 1; } },
          );
          const pages = [open(), open()];
          const call = (number) => ({ number, title: "", occasion: { kind: "found", text: "" } });
          for (const one of pages) for (const number of [1, 2]) one.call(call(number));
          return pages.map((one) => one.rung);
        }"""
    )
    assert rung == [2, 0]


def test_every_call_of_a_console_that_was_started_again_sounds(page):
    rung = page.evaluate(
        """async () => {
          const { Calls } = await import("/assets/calls.js");
          const rung = [];
          const page = Object.assign(Object.create(Calls.prototype), {
            known: null, newest: null, seen: 0,
            renderControl() {}, render() {}, fetch() {},
            ring(title) { rung.push(title); },
          });
          const call = (number) => (
            { number, title: `${page.instance} ${number}`, occasion: { kind: "found", text: "" } }
          );
          const come = (instance, ...numbers) => {
            page.update({ instance, calls: 1 });
            page.take({ calls: numbers.map(call) });
          };
          come("first", 2, 1);
          come("first", 3, 2, 1);
          come("second", 4, 3, 2, 1);
          return rung;
        }"""
    )
    assert rung == ["first 3", "second 1", "second 2", "second 3", "second 4"]


def test_a_call_of_another_day_says_which(page):
    shown = page.evaluate(
        """async () => {
          const { Calls } = await import("/assets/calls.js");
          const times = (ago_ms) => {
            const call = { wall_ns: (Date.now() - ago_ms) * 1e6 };
            const row = { call, time: document.createElement("small") };
            Calls.prototype.renderTimes.call({ rows: new Map([[1, row]]) });
            return row.time.textContent.trim();
          };
          return [times(0), times(3 * 86400e3)];
        }"""
    )
    assert re.fullmatch(r"\d\d:\d\d( [AP]M)?", shown[0])
    assert re.match(r"[A-Z][a-z]{2} \d", shown[1]), shown


def test_calls_lead_to_their_find_and_repeat_what_was_not_found(home, page, stage):
    _find(home, stage, position_world=(4.0, 1.0, 0.5))
    expect_state(page, "Found")
    if not page.locator("#calls").is_visible():
        page.locator(".scene-tools [data-opens=calls]").click()
    page.locator("#calls-list").get_by_role("button", name="Show where hat").first.click()
    expect(page.locator("#explanation")).to_be_visible()
    home.begin_again()
    home.goal = msgspec.structs.replace(home.goal, goal_id=8, outcome="exhausted")
    home.state = "exhausted"
    page.locator("#calls-list").get_by_role("button", name="Search for hat again").first.click()
    expect(page.locator("#calls-answer")).not_to_be_empty()
    key, payload = home.requests[-1]
    assert key == keys.QUEUE
    assert b'"action":"repeat"' in payload
    page.locator("#calls-close").click()


def test_the_words_of_a_search_that_is_over_do_not_stand_beside_another_one(home, page):
    field = text_field(page, "Find")
    expect(field).to_have_attribute("placeholder", "my hat, I think it is on the sofa")
    assert field.bounding_box()["width"] > 330, "a sentence fits"
    field.fill("find my hat, I left it on the sofa")
    panels(page).get_by_role("button", name="Search", exact=True).click()
    expect(panels(page).locator(".ip-answer")).to_contain_text("Looking for: hat")
    expect(field).to_have_value("find my hat, I left it on the sofa")
    over = GoalStatus(goal_id=2, object="hat", outcome="found")
    home.goal = GoalStatus(goal_id=7, object="mug", outcome="active")
    home.status_changes = {"history": [over]}
    expect(field).to_have_value("")
