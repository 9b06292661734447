"""The page in a real browser."""

import itertools
import os
import time

import pytest
from playwright.sync_api import expect

from app.messages import keys
from tests.app.nodes.console.drawn_home import camera_image
from tests.app.nodes.console.opened_page import (
    PageParts,
    expect_state,
    leave_out_scene,
    open_tab,
    panels,
    text_field,
    wait_until,
)
from tests.app.relay import Relay
from tests.chromium import GPU, KEEP_PICTURES, box_at_rest, new_window

pytestmark = pytest.mark.browser

_OTHERS = itertools.count(1)


@pytest.fixture(scope="module")
def shared(stage, browser):
    """What is started once for all tests that leave it running, with a map that is soon drawn."""
    parts = PageParts(stage, browser, most_voxels=2_000)
    yield parts
    parts.close()


@pytest.fixture
def home(shared):
    """A navigator in the middle of a search, which nobody has asked anything yet."""
    shared.home.begin_again()
    shared.hold_still()
    return shared.home


@pytest.fixture(scope="module")
def opened(shared):
    """The page, opened once for all tests that leave it whole."""
    return shared.open_page()


@pytest.fixture
def page(opened, home):
    """The page as an operator finds it, without what the test before typed."""
    open_tab(opened, "Search")
    for label in "Find", "Context", "Scenario":
        text_field(opened, label).fill("")
    expect_state(opened, "Searching")
    return opened


@pytest.fixture
def broken(shared, home):
    """A page that the test may break, without a scene."""
    page = shared.open_page(scene=False)
    expect_state(page, "Searching")
    yield page
    page.close()


@pytest.fixture
def relay(shared):
    """A line to the console that can fall silent."""
    relay = Relay(shared.port)
    yield relay
    relay.close()


def _another_scenario():
    """Return a scenario that no attempt has typed: the same question is searched for already."""
    return f"office {next(_OTHERS)}"


def test_everything_of_the_search_fits_without_scrolling(home, page):
    view = panels(page)
    folder = view.get_by_text("Reasons and corrections")
    expect(folder).to_be_visible()
    box = box_at_rest(folder)
    assert box["y"] + box["height"] < 900


def test_a_typed_query_reaches_the_navigator(home, page):
    view = panels(page)
    text_field(page, "Find").fill("find my student card, I just used it on the printer")
    scenario = _another_scenario()
    text_field(page, "Scenario").fill(scenario)
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("Looking for: student card.")).to_be_visible()
    expect(page.locator("#goal")).to_have_text("student card")
    key, payload = home.requests[-1]
    assert key == keys.SEARCH
    assert b'"object":"student card"' in payload
    assert b'"context":"I just used it on the printer"' in payload
    assert f'"scenario":"{scenario}"'.encode() in payload


def test_a_refused_query_says_why(home, page):
    view = panels(page)
    text_field(page, "Find").fill("unicorn")
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("nobody has ever seen a unicorn")).to_be_visible()
    text_field(page, "Find").fill("")
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("Type what to look for")).to_be_visible()
    text_field(page, "Find").fill("hat")
    text_field(page, "Context").fill("x" * 10_000)
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("The context has at most 2000 characters")).to_be_visible()
    text_field(page, "Context").fill("")
    text_field(page, "Scenario").fill("x" * 10_000)
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("The scenario has at most 200 characters")).to_be_visible()
    open_tab(page, "Session")
    text_field(page, "Note").fill("x" * 10_000)
    view.get_by_role("button", name="Save the note").click()
    expect(view.get_by_text("A note has at most 2000 characters; this is 10000.")).to_be_visible()
    assert [key for key, _ in home.requests] == [keys.SEARCH]


def test_what_is_typed_right_before_a_click_is_not_lost(home, page):
    view = panels(page)
    text_field(page, "Find").evaluate(
        """(field, search) => {
            const value = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value");
            for (const text of ["unic", "unicorn"]) {
                value.set.call(field, text);
                field.dispatchEvent(new Event("input", { bubbles: true }));
            }
            search.click();
        }""",
        view.get_by_role("button", name="Search").element_handle(),
    )
    expect(view.get_by_text("nobody has ever seen a unicorn")).to_be_visible()


def test_two_people_who_type_at_once_keep_their_own_words(shared, browser, home, page):
    window = new_window(browser)
    other = window.new_page()
    try:
        other.goto(shared.console.url)
        expect_state(other, "Searching")
        text_field(page, "Find").press_sequentially("a large ")
        text_field(other, "Find").press_sequentially("keys")
        text_field(page, "Find").press_sequentially("towel")
        text_field(page, "Context").fill("in the bathroom")
        text_field(other, "Scenario").fill(_another_scenario())
        panels(other).get_by_role("button", name="Search").click()
        expect(other.locator("#goal")).to_have_text("keys")
        expect(text_field(page, "Find")).to_have_value("a large towel")
        other.reload()
        expect(text_field(other, "Find")).to_have_value("keys")
    finally:
        window.close()
    asked = [payload for key, payload in home.requests if key == keys.SEARCH]
    assert len(asked) == 1
    assert b'"object":"keys"' in asked[0]


@pytest.mark.usefixtures("each_stop_once")
def test_stop_by_click_and_by_space_and_resume(home, page):
    expect_state(page, "Searching")
    page.locator("#stop").click()
    expect_state(page, "Stopped")
    expect(page.locator("#notice")).to_contain_text(
        "The robot does not move until you press Resume"
    )
    expect(panels(page).get_by_role("button", name="Resume", exact=True)).to_be_hidden()
    page.locator("#resume").click()
    expect_state(page, "Searching")
    panels(page).locator("canvas[data-engine]").click()
    page.keyboard.press("Space")
    expect_state(page, "Stopped")
    actions = [payload for key, payload in home.requests if key == keys.CONTROL]
    assert [b"stop" in a for a in actions] == [True, False, True]


def test_a_space_in_a_text_field_is_a_space(home, page):
    field = text_field(page, "Find")
    field.click()
    page.keyboard.type("student card")
    expect(field).to_have_value("student card")
    assert not [key for key, _ in home.requests if key == keys.CONTROL]


def test_space_stops_after_a_click_on_a_checkbox_and_enter_changes_it(home, page):
    expect_state(page, "Searching")
    open_tab(page, "Map")
    box = text_field(page, "Voxels")
    box.click()
    expect(box).not_to_be_checked()
    page.keyboard.press("Enter")
    expect(box).to_be_checked()
    page.keyboard.press("Enter")
    expect(box).not_to_be_checked()
    page.keyboard.press("Space")
    expect_state(page, "Stopped")
    expect(box).not_to_be_checked()


@pytest.mark.usefixtures("each_stop_once")
def test_space_stops_after_a_click_on_a_button_and_does_not_press_it(home, page):
    expect_state(page, "Searching")
    view = panels(page)
    view.get_by_role("button", name="Pause", exact=True).click()
    expect_state(page, "Paused")
    page.keyboard.press("Space")
    expect_state(page, "Stopped")
    page.wait_for_timeout(300)
    actions = [payload for key, payload in home.requests if key == keys.CONTROL]
    assert [b"stop" in action for action in actions] == [False, True]


def test_stop_works_while_the_scene_is_gone(broken):
    page = broken
    page.locator("#view").evaluate("frame => frame.remove()")
    page.locator("#stop").click()
    expect_state(page, "Stopped")


def test_stop_goes_by_http_when_the_socket_hangs(broken):
    page = broken
    page.evaluate("WebSocket.prototype.send = () => {}")
    page.locator("#stop").click()
    expect_state(page, "Stopped")


def test_a_line_that_goes_dead_is_left_within_seconds_and_a_stop_gets_through(shared, home, relay):
    page = shared.window.new_page()
    page.add_init_script("localStorage.setItem('ippon-camera', 'corner')")
    page.goto(f"http://127.0.0.1:{relay.port}")
    expect_state(page, "Searching")
    camera = page.locator("#camera[data-state=live]")
    _until_seen(camera, home)
    page.keyboard.press("t")
    expect(page.locator("#things")).to_be_visible()
    relay.silence()
    page.locator("#stop").click()
    expect(page.locator("#state")).to_have_text("Stopped", timeout=60_000)
    with page.expect_request("**/api/things", timeout=30_000):
        _until_seen(camera, home)
    # The panels are on a line of their own.
    open_tab(page, "Session")
    expect(panels(page).get_by_role("button", name="Save the note")).to_be_visible()
    page.close()


def _until_seen(part, home, timeout_s=30.0):
    """Publish images, and nothing that is drawn, until a part of the page is there."""
    deadline = time.monotonic() + timeout_s
    while not part.is_visible():
        assert time.monotonic() < deadline
        home.stamp_ns += 100_000_000
        home.put(keys.COLOR, camera_image(stamp_ns=home.stamp_ns))
        time.sleep(0.1)


def test_the_search_can_be_paused_resumed_and_ended(home, page):
    view = panels(page)
    for word, action, state in [
        ("Pause", b"pause", "Paused"),
        ("Resume", b"resume", "Searching"),
        ("End", b"cancel", "Searching"),
    ]:
        view.get_by_role("button", name=word, exact=True).click()
        expect_state(page, state)
        other = {"Paused": "Pause", "Searching": "Resume"}[state]
        expect(view.get_by_role("button", name=other, exact=True)).to_be_hidden()
        # Nothing on the page tells that the last one has arrived.
        wait_until(page, lambda: home.requests[-1][1], action)


def test_a_level_can_be_corrected(home, page):
    view = panels(page)
    view.get_by_text("Reasons and corrections").click()
    view.get_by_text("a hat and a sofa").wait_for()
    view.get_by_role("button", name="Change the level").click()
    expect(view.get_by_text("Choose the kind of object first.")).to_be_visible()
    view.get_by_role("combobox", name="Object kind").click()
    view.get_by_role("option", name="bed", exact=True).click()
    view.get_by_role("button", name="Change the level").click()
    expect(view.get_by_text("bed is now near.")).to_be_visible()
    assert home.requests[-1] == (keys.GUIDANCE, b'{"label":"bed","level":"near"}')
    text_field(page, "New kind").fill("bookcase")
    view.get_by_role("button", name="Add this kind").click()
    expect(text_field(page, "New kind")).to_have_value("")
    assert home.requests[-1][0] == keys.VOCABULARY
    assert b'"label":"bookcase"' in home.requests[-1][1]
    view.get_by_role("button", name="Question and answer").click()
    expect(view.get_by_text("I am a robot, and I am to find")).to_be_visible()
    expect(view.get_by_text("sofa: <b>hats</b> are left there.")).to_be_visible()
    view.get_by_role("button", name="Close", exact=True).click()
    expect(view.get_by_text("I am a robot, and I am to find")).to_be_hidden()


def test_a_doubtful_sentence_is_shown_before_anything_is_searched_for(home, page):
    view = panels(page)
    text_field(page, "Find").fill("where is my red quokka")
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("“quokka” is not in the table")).to_be_visible()
    expect(view.get_by_text("Correct it above")).to_be_visible()
    assert [key for key, _ in home.requests] == [keys.SENTENCE]
    text_field(page, "Find").fill("hat")
    text_field(page, "Scenario").fill(_another_scenario())
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("Looking for: hat.")).to_be_visible()
    assert [key for key, _ in home.requests] == [keys.SENTENCE, keys.SEARCH]


def test_text_from_outside_runs_nothing(home, page):
    attack = "<img src=x onerror=\"parent.document.title='owned'\">"
    home.status_changes = {"why": attack, "robot": attack}
    expect(page.locator("#robot")).to_have_text(attack)
    expect(panels(page).get_by_text(attack)).to_be_visible()
    page.wait_for_timeout(500)
    assert "owned" not in page.title()


def test_another_servers_address_in_the_url_leads_nowhere(shared):
    page, asked = shared.window.new_page(), []
    page.on("websocket", lambda socket: asked.append(socket.url))
    with page.expect_event("websocket"):
        page.goto(f"{shared.console.url}/view/?websocket=ws://127.0.0.1:9/evil")
    page.wait_for_timeout(500)
    assert asked
    assert all(url.startswith(shared.console.url.replace("http", "ws")) for url in asked)
    page.close()


def _across(locator):
    """Return left side and width of an element; nothing while it is not shown."""
    box = locator.bounding_box()
    return None if box is None else (box["x"], box["width"])


def test_a_first_visit_is_introduced_and_the_next_one_is_not(shared, browser, home):
    window = new_window(browser, 390, 844, is_first_visit=True)
    page = window.new_page()
    page.goto(shared.console.url)
    # A phone's panel is below the map; the first layout may be that of a wide window.
    panel = panels(page).locator("[data-dock-region='right']")
    wait_until(page, lambda: [_across(panel)], (0, 390))
    card = page.locator("#introduction")
    expect(card).to_contain_text("1 of 5")
    expect(panels(page).get_by_role("tab", name="Session")).to_be_visible()
    if folder := os.environ.get(KEEP_PICTURES):
        home.frozen = False
        page.wait_for_timeout(4_000)
        page.screenshot(path=f"{folder}/introduction.png")
    for title in "Why it goes there", "Steer", "Confirm", "Review":
        page.get_by_role("button", name="Next").click()
        expect(card.get_by_role("heading")).to_have_text(title)
    expect(panels(page).get_by_role("tab", name="Session")).to_have_attribute(
        "aria-selected", "true"
    )
    # Space still stops the robot, and presses no button of the card.
    page.keyboard.press("Space")
    expect_state(page, "Stopped")
    expect(card).to_contain_text("5 of 5")
    page.reload()
    expect(card).to_contain_text("5 of 5")
    # A card that moves between press and release of a click is not clicked.
    wait_until(page, lambda: [_across(panel)], (0, 390))
    box_at_rest(card)
    page.get_by_role("button", name="Done").click()
    expect(card).to_be_hidden()
    expect(panels(page).get_by_role("tab", name="Search")).to_have_attribute(
        "aria-selected", "true"
    )
    leave_out_scene(page)
    page.reload()
    expect(page.locator("#state")).not_to_have_text("Connecting")
    expect(card).to_be_hidden()
    page.keyboard.press("?")
    page.get_by_role("button", name="Introduction").click()
    expect(card).to_contain_text("1 of 5")
    page.keyboard.press("Escape")
    expect(card).to_be_hidden()
    window.close()


def test_the_rectangle_of_an_area_can_be_drawn_over_the_scene(page):
    scene = page.frame(url=lambda url: "/view/" in url)
    scene.wait_for_function("ipponDrawRate.timed > 0")
    over = "document.querySelector('canvas:not([data-engine])').getContext('2d') !== null"
    assert scene.evaluate(over), "no other context took the canvas"


@pytest.fixture(scope="module")
def blank(shared):
    page = shared.window.new_page()
    yield page
    page.close()


@pytest.fixture
def draw_rate(blank, shared):
    """A page with nothing but what decides when the scene is drawn, loaded anew."""
    blank.goto(f"{shared.console.url}/assets/draw_rate.js")
    blank.add_script_tag(url="draw_rate.js")
    yield blank
    blank.mouse.up()


def test_frames_for_messages_are_spaced_until_somebody_uses_the_page(draw_rate):
    page = draw_rate
    frames = """async (isUsed) => {
        let frames = 0, turns = 0, due = false;
        const draw = () => { due = true; };
        ipponDrawRate.frame_ms = 100;
        const began = performance.now();
        for (; performance.now() < began + 1200 || turns < 12; turns += 1) {
            ipponDrawRate.usedUntil = isUsed ? Infinity : 0;
            ipponDrawRate.request(draw, () => {});
            await new Promise((resolve) => setTimeout(resolve, 10));
            if (!due) continue;
            due = false;
            frames += 1;
            ipponDrawRate.drawn(draw);
        }
        return [frames, turns, performance.now() - began];
    }"""
    drawn, _, took_ms = page.evaluate(frames, False)
    assert 1 <= drawn <= 1 + took_ms / 400, "every 400 ms"
    drawn, turns, _ = page.evaluate(frames, True)
    assert drawn == turns > 10


def test_a_change_that_a_person_asked_for_is_in_the_first_frame(draw_rate):
    page = draw_rate
    page.evaluate("""() => {
        window.steps = [];
        const step = (name) => () => steps.push(name);
        window.ask = () => ipponDrawRate.request(step("draw"), step("apply"));
        const drawnAt = performance.now() + 1e6;
        Object.assign(ipponDrawRate, { frame_ms: 400, usedUntil: 0, drawnAt });
        addEventListener("pointerdown", () => setTimeout(ask, 50));
        ask();
    }""")
    assert page.evaluate("steps") == [], "nobody asked: it may wait"
    deadline = time.monotonic() + 30.0
    while not page.evaluate("steps.length"):
        assert time.monotonic() < deadline
        page.mouse.down()
        page.wait_for_timeout(500)
        page.mouse.up()
    assert page.evaluate("steps") == ["apply", "draw"], "messages before the frame, not in it"
    page.evaluate("ipponDrawRate.usedUntil = Infinity")
    assert (
        page.evaluate("() => { ipponDrawRate.isTimed = true; ask(); return steps.length; }") == 2
    ), "no second frame behind one that takes long"
    page.evaluate(
        "() => { ipponDrawRate.isTimed = false; ipponDrawRate.plan(ipponDrawRate.held); }"
    )
    assert page.evaluate("steps") == ["apply", "draw"] * 2
    beat = "() => { ipponDrawRate.beat(() => steps.push('beat')); return steps.length; }"
    assert page.evaluate(beat) == 4, "no other frame delays that of an answer"
    page.evaluate("ipponDrawRate.usedUntil = 0")
    assert page.evaluate(beat) == 5


def test_lines_are_smoothed_with_a_gpu_only(draw_rate):
    page = draw_rate
    assert page.evaluate("ipponDrawRate.smooths()") is (GPU in os.environ)
    page.evaluate("""() => {
        ipponDrawRate.isSmooth = null;
        HTMLCanvasElement.prototype.getContext = () => ({
            getExtension: () => null,
            getParameter: () => "ANGLE (Intel, Mesa Intel(R) Iris(R) Xe Graphics, OpenGL 4.6)",
        });
    }""")
    assert page.evaluate("ipponDrawRate.smooths()") is True


def test_a_scene_that_takes_long_to_draw_has_fewer_pixels(draw_rate):
    page = draw_rate
    ratios = """(frames_ms) => {
        const ratios = [];
        // The page's own share, which fewer pixels leave as it is.
        ipponDrawRate.frame_ms = 200;
        for (const frame_ms of frames_ms) {
            ipponDrawRate.pixels_ms = frame_ms;
            for (let frame = 0; frame < 10; frame++) {
                ipponDrawRate.timed += 1;
                ipponDrawRate.sharpen((ratio) => ratios.push(ratio / devicePixelRatio));
            }
        }
        return ratios;
    }"""
    assert page.evaluate(ratios, [16, 49]) == []
    assert page.evaluate(ratios, [120, 80, 80]) == [0.75, 0.5], "no lower than a half"
    assert page.evaluate(ratios, [20, 14, 40]) == [], "more pixels would be slow again"
    assert page.evaluate(ratios, [12, 12]) == [0.75, 1]


def test_the_share_of_the_gpu_in_a_frame_is_its_own_figure_where_there_is_one(draw_rate):
    page = draw_rate
    shares = """async ([hasTimer, isKnown]) => {
        const nothing = () => ({});
        let doneAt = Infinity;
        const gl = {
            UNSIGNALED: "unsignaled", QUERY_RESULT_AVAILABLE: "available",
            createQuery: nothing, beginQuery: nothing, endQuery: nothing, deleteQuery: nothing,
            deleteSync: nothing, flush: nothing,
            fenceSync: () => { doneAt = performance.now() + 100; return {}; },
            isContextLost: () => false, getParameter: () => false,
            getExtension: () => (hasTimer ? {} : null),
            getSyncParameter: () => (performance.now() < doneAt ? "unsignaled" : "signaled"),
            getQueryParameter: (_, what) => (what === "available" ? isKnown : 2e6),
        };
        Object.assign(ipponDrawRate, { frame_ms: 0, pixels_ms: 0, timed: 0 });
        ipponDrawRate.time(gl);
        const began = performance.now();
        // The page's own share.
        while (performance.now() < began + 50);
        while (!ipponDrawRate.timed) await new Promise((go) => setTimeout(go, 5));
        return [ipponDrawRate.frame_ms / 0.3, ipponDrawRate.pixels_ms / 0.3];
    }"""
    for case, has_figure in (((True, True), True), ((True, False), False), ((False, False), False)):
        frame_ms, pixels_ms = page.evaluate(shares, case)
        assert frame_ms > 140.0
        if has_figure:
            assert pixels_ms == pytest.approx(2.0)
        else:
            assert 95.0 < pixels_ms < frame_ms - 45.0, "without the page's own share"
