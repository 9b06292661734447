"""The whole product as a new_browser meets it: one command, one page, one search."""

import os
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx2
import pytest
from playwright.sync_api import Page, expect

from app.recording.notes import read_notes
from tests.chromium import KEEP_PICTURES, PATIENCE_MS, new_page, open_browser
from tests.ports import free_port

pytestmark = [pytest.mark.browser, pytest.mark.process, pytest.mark.slow]

SEARCH_MS = 240_000
HOME = "4" if KEEP_PICTURES in os.environ else "1"
"""In home 1 the plant is near; the pictures of the documents are of home 4."""


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
def page(launch: Callable[..., Any], port: int):
    """The page of a running demo that waits for a query."""
    demo = launch("demo", "--home", HOME, "--port", str(port), "--speed", "2", "--no-search")
    demo.wait_for_log(f"simulated robot in home-{HOME}", timeout_s=300.0)
    assert httpx2.get(f"http://127.0.0.1:{port}/health", timeout=60.0).is_success
    with open_browser() as browser:
        page = new_page(browser)
        page.goto(f"http://127.0.0.1:{port}")
        yield page


@pytest.fixture
def shoot(page: Page) -> Callable[..., None]:
    """Takes a picture where they are kept; no assertion needs one."""

    def take(name: str, drawn_ms: int = 0) -> None:
        if KEEP_PICTURES in os.environ:
            folder = Path(os.environ[KEEP_PICTURES])
            folder.mkdir(parents=True, exist_ok=True)
            page.wait_for_timeout(drawn_ms)
            page.screenshot(path=folder / f"{name}.png")

    return take


def field(page: Page, label: str):
    """The text field beside a label; viser does not tie the two together."""
    return page.frame_locator("#view").locator(
        f"xpath=//label[text()='{label}']/ancestor::div[.//input][1]//input"
    )


def ask(page: Page, sentence: str) -> None:
    field(page, "Find").fill(sentence)
    page.frame_locator("#view").get_by_role("button", name="Search").click()


def expect_state(page: Page, text: str, timeout_ms: int = PATIENCE_MS) -> None:
    expect(page.locator("#state")).to_have_text(text, timeout=timeout_ms)


def take_figures(page: Page, shoot: Callable[..., None]) -> None:
    """Take the paper's first two figures: the trail to the find; proximity and viewpoints."""
    view = page.frame_locator("#view")
    view.get_by_role("tab", name="Map").click()
    expect(view.locator("[data-mode='camera']")).to_be_visible()
    shoot("fig1")
    view.get_by_role("button", name="Proximity", exact=True).click()
    expect(view.locator("[data-mode='proximity']")).to_be_visible()
    shoot("fig2", drawn_ms=3_000)
    view.get_by_role("button", name="Camera", exact=True).click()
    view.get_by_role("tab", name="Search").click()


def keep_a_record(page: Page, sessions: Path, shoot: Callable[..., None]) -> None:
    """Press what the Session tab has for the recording, and find it beside the file."""
    view = page.frame_locator("#view")
    view.get_by_role("tab", name="Session").click()
    line = view.locator(".ip-recording")
    expect(line).to_contain_text("Recording: ")
    (first,) = sessions.iterdir()
    view.get_by_role("button", name="Mark", exact=True).click()
    expect(view.get_by_text("Stored with the recording.")).to_be_visible()
    field(page, "Note").fill("the lamp is new")
    view.get_by_role("button", name="Save the note").click()
    deadline = time.monotonic() + PATIENCE_MS / 1e3
    while len(notes := read_notes(first / "session_0.mcap")) < 2:
        assert time.monotonic() < deadline, notes
        page.wait_for_timeout(500)
    assert [(n.kind, n.text) for n in notes] == [("mark", ""), ("note", "the lamp is new")]
    view.get_by_role("button", name="Off", exact=True).click()
    expect(line).to_contain_text("not recording: ended by")
    shoot("record")
    view.get_by_role("button", name="On", exact=True).click()
    expect(line).to_contain_text("Recording: ")
    assert len(list(sessions.iterdir())) == 2
    view.get_by_role("tab", name="Search").click()


def test_a_typed_query_finds_the_plant_and_the_next_one_starts_at_once(
    page: Page, shoot: Callable[..., None], tmp_path: Path
) -> None:
    expect_state(page, "Ready")
    shoot("waiting")

    ask(page, "find the plant, I think it is near the sofa")
    expect(page.locator("#goal")).to_have_text("plant")
    expect_state(page, "Looking around")
    expect(page.locator("#state")).to_have_text(re.compile("Searching|Approaching"))
    view = page.frame_locator("#view")
    expect(view.get_by_text("embedded prior", exact=False)).to_be_visible()
    shoot("searching", drawn_ms=4_000)

    expect_state(page, "Found", timeout_ms=SEARCH_MS)
    expect(view.get_by_role("button", name="Confirm")).to_be_visible()
    shoot("console", drawn_ms=3_000)
    take_figures(page, shoot)
    keep_a_record(page, tmp_path / "ippon" / "sessions", shoot)

    ask(page, "toilet")
    expect(page.locator("#goal")).to_have_text("toilet")
    # Without looking around again: the map is there already.
    expect(page.locator("#state")).to_have_text(re.compile("Searching|Approaching|Found"))

    page.locator("#stop").click()
    expect_state(page, "Stopped")
    shoot("stopped")
