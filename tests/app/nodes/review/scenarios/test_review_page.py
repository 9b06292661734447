"""The pages of a review in a real browser: the list, a session, and two side by side.

Every picture can be kept and looked at: set IPPON_KEEP_PICTURES to a folder.
"""

import os
import re
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.chromium import KEEP_PICTURES, box_at_rest, new_page, open_browser

pytestmark = pytest.mark.browser


@pytest.fixture
def url(launch, made_up, tmp_path):
    """The address of a review of two sessions: of six and of four seconds."""
    folder = tmp_path / "sessions"
    for name, seconds in (("first", 6.0), ("second", 4.0)):
        session = made_up.write_session(tmp_path / name, seconds).writer.folder
        folder.mkdir(exist_ok=True)
        session.rename(folder / f"{name}-{session.name}")
    process = launch("review", str(folder), "--port", "0")
    process.wait_for_log("review at http")
    return process.log().split("review at ")[1].split()[0]


@pytest.fixture
def page(url):
    with open_browser() as browser:
        page = new_page(browser)
        page.goto(url)
        yield page


def _keep(page, name):
    folder = os.environ.get(KEEP_PICTURES)
    if folder:
        page.wait_for_timeout(3_000)
        page.screenshot(path=Path(folder) / f"{name}.png")


def test_a_session_opens_at_its_find_and_a_moment_by_its_link(page):
    expect(page.locator(".card-of-session")).to_have_count(2)
    _keep(page, "review-list")
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        expect(page.locator("html")).to_have_css("color-scheme", scheme)
    page.locator("#words").fill("first hat")
    page.locator(".card-of-session").click()
    clock, said = page.locator(".timeline .clock"), page.locator(".timeline .said")
    expect(page.locator("#state")).to_have_text("Found")
    expect(clock).to_have_text("0:05.8 / 0:05.8")
    expect(page.locator(".strip img").first).to_be_visible()
    _keep(page, "review")

    page.locator(".timeline [type=search]").fill("searching hat")
    expect(page.locator(".found-events button")).to_have_text("0:00.0 searching for hat")
    page.keyboard.press("Enter")
    expect(clock).to_have_text("0:00.3 / 0:05.8")
    expect(page.locator("#state")).to_have_text("Searching")
    page.keyboard.press("Escape")
    expect(page.locator(".found-events")).to_be_hidden()

    page.locator(".timeline select").select_option("16")
    page.locator(".timeline .play").click()
    expect(said).to_contain_text("end of the recording")
    expect(page.locator("#state")).to_have_text("Found")

    page.locator(".strip button").first.click()
    expect(clock).not_to_have_text("0:05.8 / 0:05.8")
    moment = clock.text_content()
    page.get_by_role("button", name="Link", exact=True).click()
    expect(page).to_have_url(re.compile("#t="))
    link = page.url
    page.goto("about:blank")
    page.goto(link)
    expect(clock).to_have_text(moment)


def test_two_sessions_stay_in_step(page):
    boxes = page.locator(".card-of-session input")
    expect(boxes).to_have_count(2)
    for n in range(2):
        boxes.nth(n).check()
    page.locator("#compare").click()
    expect(page.locator(".versus tbody tr")).to_have_count(2)
    page.keyboard.press("Home")
    expect(page.locator(".timeline .clock")).to_have_text("0:00.0 / 0:05.8")
    page.keyboard.press("ArrowRight")
    expect(page.locator(".timeline .clock")).to_have_text("0:05.0 / 0:05.8")
    _keep(page, "review-two")
    # Over the plan arrows move that, and in a dialog they and Home scroll.
    for opens, opened in (("?", page.locator("#help[open]")), ("p", page.locator("#plan"))):
        page.keyboard.press(opens)
        expect(opened).to_be_visible()
        page.keyboard.press("ArrowLeft")
        page.wait_for_timeout(1_000)
        expect(page.locator(".timeline .clock")).to_have_text("0:05.0 / 0:05.8")
        page.keyboard.press("Escape")
        expect(opened).to_be_hidden()
    page.keyboard.press("ArrowLeft")
    expect(page.locator(".timeline .clock")).to_have_text("0:00.0 / 0:05.8")


def test_what_is_pressed_stays_while_the_session_grows(launch, made_up, tmp_path):
    session = made_up.write_session(tmp_path, 12.0, end=False)
    session.writer.flush()
    later = made_up.all_messages(20.0)

    def record(after_s, until_s):
        for time_ns, key, payload in later:
            if after_s < (time_ns - made_up.START_NS) * 1e-9 <= until_s:
                session.add(key, payload, time_ns, (time_ns - made_up.START_NS) * 1e-9)
        session.writer.flush()

    process = launch("review", str(session.writer.folder), "--port", "0")
    process.wait_for_log("review at http")
    with open_browser() as browser:
        page = new_page(browser)
        page.goto(process.log().split("review at ")[1].split()[0])
        clock, said = page.locator(".timeline .clock"), page.locator(".timeline .said")
        expect(said).to_contain_text("recording in progress")
        expect(said).not_to_have_class(re.compile("problem"))
        # A recording knows no things: there is nothing to open.
        expect(page.get_by_role("button", name="Goals", exact=True)).to_be_visible()
        expect(page.get_by_role("button", name="Things", exact=True)).to_be_hidden()
        mark, pictures = page.locator(".track .mark.detection"), page.locator(".strip button")
        expect(pictures.first).to_be_visible()
        mark.focus()
        pictures.last.evaluate("(one) => { one.dataset.seen = 1; }")
        before = box_at_rest(mark)["x"]
        record(11.9, 12.1)
        expect(clock).to_contain_text("/ 0:12.0")
        expect(page.locator(".strip button[data-seen]")).to_have_count(1)
        record(12.1, 14.1)
        expect(clock).to_contain_text("/ 0:14.0")
        expect(page.locator(".strip button[data-seen]")).to_have_count(0)
        expect(mark).to_be_focused()
        assert box_at_rest(mark)["x"] < before - 10.0
    session.close()
