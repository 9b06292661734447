"""The page in a real browser."""

import time

import pytest
from playwright.sync_api import expect

from app.messages import keys
from tests.chromium import PATIENCE_MS, box_at_rest, new_window, open_browser

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def browser():
    """Chromium of the system, else Playwright's own; without one the tests fail."""
    with open_browser() as browser:
        yield browser


class _Parts:
    """A console, the navigator that it watches, and a window to open its page in."""

    def __init__(self, stage, browser, navigator=True, **home):
        self.zenoh_port, self.port = stage.free_port(), stage.free_port()
        self.home = stage.PublishedHome(self.zenoh_port, **home) if navigator else None
        self.console = stage.ConsoleProcess(self.zenoh_port, self.port)
        self.window = new_window(browser)
        # The map is looked at by its pixels, which the camera's picture would cover.
        self.window.add_init_script("localStorage.setItem('ippon-camera', 'off')")
        self.console.wait_until_up()

    def open_page(self):
        """Open the page as an operator would."""
        page = self.window.new_page()
        page.goto(self.console.url)
        return page

    def close(self):
        self.window.close()
        self.console.close()
        if self.home is not None:
            self.home.close()


@pytest.fixture(scope="module")
def shared(stage, browser):
    """What is started once for all tests that leave it running, with a map that is soon drawn."""
    parts = _Parts(stage, browser, most_voxels=2_000)
    yield parts
    parts.close()


@pytest.fixture
def home(shared):
    """A navigator in the middle of a search, which nobody has asked anything yet."""
    shared.home.begin_again()
    return shared.home


@pytest.fixture
def page(shared, home):
    """The page, opened as an operator would, without what the test before typed."""
    page = shared.open_page()
    for label in "Find", "Context", "Scenario":
        _field(page, label).fill("")
    yield page
    page.close()


@pytest.fixture
def own(stage, browser):
    """Makes a console and a navigator for one test alone."""
    made = []

    def make(**how):
        made.append(_Parts(stage, browser, **how))
        return made[-1]

    yield make
    for parts in made:
        parts.close()


def _view(page):
    return page.frame_locator("#view")


def _field(page, label):
    """The text field beside a label; viser does not tie the two together."""
    return _view(page).locator(f"xpath=//label[text()='{label}']/ancestor::div[.//input][1]//input")


def _state(page, text):
    expect(page.locator("#state")).to_have_text(text)


def _picture(page, tmp_path):
    """Return the scene's pixels, (H, W, 3)."""
    import numpy as np
    from PIL import Image

    path = tmp_path / f"{time.monotonic_ns()}.png"
    page.screenshot(path=path, clip={"x": 8, "y": 120, "width": 952, "height": 740})
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def _drawn(page, tmp_path):
    """Wait until the map fills a good part of the picture."""
    return _shown(page, tmp_path, lambda lit: lit.mean() > 0.2, "the scene stays dark")


def _shown(page, tmp_path, wanted, complaint):
    """Wait until the lit pixels of the picture, (H, W), are as wanted, and return the picture."""
    deadline = time.monotonic() + PATIENCE_MS / 1000.0
    while time.monotonic() < deadline:
        picture = _picture(page, tmp_path)
        if wanted(picture.max(axis=2) > 90):
            return picture
        page.wait_for_timeout(200)
    raise TimeoutError(complaint)


def test_shows_the_search_as_it_goes(own, tmp_path):
    page = own().open_page()
    _state(page, "Searching")
    expect(page.locator("#goal")).to_have_text("hat")
    expect(page.locator("#robot")).to_have_text("ippon")
    expect(page.locator("#link")).to_contain_text("live")
    expect(page.locator("#veil")).to_be_hidden()
    view = _view(page)
    expect(view.get_by_text("going to the viewpoint by the sofa")).to_be_visible()
    expect(view.get_by_text("embedded common sense", exact=False)).to_be_visible()
    _drawn(page, tmp_path)


def test_the_camera_follows_the_growing_map_in_the_browser(own, tmp_path):
    page = own().open_page()
    _drawn(page, tmp_path)

    def whole(lit):
        across, width = lit.any(axis=0).nonzero()[0], lit.shape[1]
        fills = len(across) and across[0] < 0.3 * width and across[-1] > 0.7 * width
        return fills and lit[:, 0].mean() < 0.2

    _shown(page, tmp_path, whole, "the whole map never came into the picture")


def test_everything_of_the_search_fits_without_scrolling(home, page):
    view = _view(page)
    folder = view.get_by_text("Reasons and corrections")
    expect(folder).to_be_visible()
    box = box_at_rest(folder)
    assert box["y"] + box["height"] < 900


def test_a_typed_query_reaches_the_navigator(home, page):
    view = _view(page)
    _field(page, "Find").fill("find my student card, I just used it on the printer")
    _field(page, "Scenario").fill("an office")
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("Looking for: student card.")).to_be_visible()
    expect(page.locator("#goal")).to_have_text("student card")
    key, payload = home.requests[-1]
    assert key == keys.SEARCH
    assert b'"object":"student card"' in payload
    assert b'"context":"I just used it on the printer"' in payload
    assert b'"scenario":"an office"' in payload


def test_a_refused_query_says_why(home, page):
    view = _view(page)
    _field(page, "Find").fill("unicorn")
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("nobody has ever seen a unicorn")).to_be_visible()
    _field(page, "Find").fill("")
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("Type what to look for")).to_be_visible()
    _field(page, "Find").fill("hat")
    _field(page, "Context").fill("x" * 10_000)
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("The context has at most 2000 characters")).to_be_visible()
    _field(page, "Context").fill("")
    _field(page, "Scenario").fill("x" * 10_000)
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("The scenario has at most 200 characters")).to_be_visible()
    view.get_by_role("tab", name="Session").click()
    _field(page, "Note").fill("x" * 10_000)
    view.get_by_role("button", name="Save the note").click()
    expect(view.get_by_text("A note has at most 2000 characters; this is 10000.")).to_be_visible()
    assert [key for key, _ in home.requests] == [keys.SEARCH]


def test_stop_by_click_and_by_space_and_resume(home, page):
    _state(page, "Searching")
    page.locator("#stop").click()
    _state(page, "Stopped")
    expect(page.locator("#notice")).to_contain_text(
        "The robot does not move until you press Resume"
    )
    page.locator("#resume").click()
    _state(page, "Searching")
    _view(page).locator("canvas").last.click()
    page.keyboard.press("Space")
    _state(page, "Stopped")
    actions = [payload for key, payload in home.requests if key == keys.CONTROL]
    assert [b"stop" in a for a in actions] == [True, False, True]


def test_a_space_in_a_text_field_is_a_space(home, page):
    field = _field(page, "Find")
    field.click()
    page.keyboard.type("student card")
    expect(field).to_have_value("student card")
    assert not [key for key, _ in home.requests if key == keys.CONTROL]


def test_space_stops_after_a_click_on_a_checkbox(home, page):
    _state(page, "Searching")
    view = _view(page)
    view.get_by_text("Map", exact=True).click()
    box = _field(page, "Voxels")
    box.click()
    expect(box).not_to_be_checked()
    page.keyboard.press("Space")
    _state(page, "Stopped")
    expect(box).not_to_be_checked()


def test_space_stops_after_a_click_on_a_button_and_does_not_press_it(home, page):
    _state(page, "Searching")
    view = _view(page)
    view.get_by_role("button", name="Pause", exact=True).click()
    _state(page, "Paused")
    page.keyboard.press("Space")
    _state(page, "Stopped")
    page.wait_for_timeout(300)
    actions = [payload for key, payload in home.requests if key == keys.CONTROL]
    assert [b"stop" in action for action in actions] == [False, True]


def test_stop_works_while_the_scene_is_gone(home, page):
    _state(page, "Searching")
    page.locator("#view").evaluate("frame => frame.remove()")
    page.locator("#stop").click()
    _state(page, "Stopped")


def test_stop_goes_by_http_when_the_socket_hangs(home, page):
    _state(page, "Searching")
    page.evaluate("WebSocket.prototype.send = () => {}")
    page.locator("#stop").click()
    _state(page, "Stopped")


def test_the_colours_can_be_switched(own, tmp_path):
    parts = own()
    page, home = parts.open_page(), parts.home
    home.frozen = True
    for _ in range(30):
        home.tick()
    before = _drawn(page, tmp_path)
    view = _view(page)
    view.get_by_text("Map", exact=True).click()
    view.get_by_role("button", name="Proximity").click()
    expect(view.get_by_text("How near the object is likely to be")).to_be_visible()
    page.wait_for_timeout(1500)
    near = _picture(page, tmp_path)
    assert (abs(near - before).max(axis=2) > 40).mean() > 0.1
    blue = (near[..., 2] > near[..., 0] + 40).mean()
    assert blue > 0.1, "walls and floor are far from a hat"
    view.get_by_role("button", name="Object", exact=True).click()
    expect(view.get_by_text("Probability of the object")).to_be_visible()


def test_a_find_is_shown_and_can_be_rejected(own, stage):
    parts = own()
    page, home = parts.open_page(), parts.home
    home.find, home.state = stage.find_of(), "found"
    _state(page, "Found")
    view = _view(page)
    reject = view.get_by_role("button", name="Not this: keep looking")
    expect(reject).to_be_visible()
    expect(view.get_by_role("button", name="Confirm: this is it")).to_be_visible()
    reject.click()
    _state(page, "Searching")
    expect(reject).to_be_hidden()
    assert home.requests[-1] == (keys.FEEDBACK, b'{"verdict":"reject"}')
    _a_search_that_ends_without_a_find_lists_places(home, page)


def _a_search_that_ends_without_a_find_lists_places(home, page):
    view = _view(page)
    while home.ticks < 40:
        page.wait_for_timeout(200)
    home.state = "exhausted"
    _state(page, "Not found")
    expect(page.locator("#notice")).to_contain_text(
        "The robot has searched everything that it can reach"
    )
    expect(view.get_by_text("Most likely places")).to_be_visible()
    expect(view.get_by_text("classified as: sofa").first).to_be_visible()
    view.get_by_role("button", name="Look again").first.click()
    _state(page, "Searching")
    expect(view.get_by_role("button", name="Look again").first).to_be_hidden()
    search, goto = home.requests[-2:]
    assert search[0] == keys.SEARCH
    assert b'"object":"hat"' in search[1]
    assert goto[0] == keys.GOTO
    assert b'"x_m":2.' in goto[1]


def test_the_search_can_be_paused_resumed_and_ended(home, page):
    view = _view(page)
    for word, action, state in [
        ("Pause", b"pause", "Paused"),
        ("Resume", b"resume", "Searching"),
        ("End", b"cancel", "Searching"),
    ]:
        view.get_by_role("button", name=word, exact=True).click()
        _state(page, state)
        page.wait_for_timeout(300)
        assert action in home.requests[-1][1]


def test_a_level_can_be_corrected(home, page):
    view = _view(page)
    view.get_by_text("Reasons and corrections").click()
    view.get_by_text("a hat and a sofa").wait_for()
    view.get_by_role("button", name="Change the level").click()
    expect(view.get_by_text("bed is now near.")).to_be_visible()
    assert home.requests[-1] == (keys.GUIDANCE, b'{"label":"bed","level":"near"}')
    _field(page, "New kind").fill("bookcase")
    view.get_by_role("button", name="Add this kind").click()
    expect(_field(page, "New kind")).to_have_value("")
    assert home.requests[-1][0] == keys.VOCABULARY
    assert b'"label":"bookcase"' in home.requests[-1][1]
    view.get_by_role("button", name="Question and answer").click()
    expect(view.get_by_text("I am a robot, and I am to find")).to_be_visible()
    expect(view.get_by_text("sofa: <b>hats</b> are left there.")).to_be_visible()
    view.get_by_role("button", name="Close", exact=True).click()
    expect(view.get_by_text("I am a robot, and I am to find")).to_be_hidden()


def test_a_doubtful_sentence_is_shown_before_anything_is_searched_for(home, page):
    view = _view(page)
    _field(page, "Find").fill("where is my red quokka")
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("“quokka” is not in the table")).to_be_visible()
    expect(view.get_by_text("Correct it above")).to_be_visible()
    assert [key for key, _ in home.requests] == [keys.SENTENCE]
    _field(page, "Find").fill("hat")
    view.get_by_role("button", name="Search").click()
    expect(view.get_by_text("Looking for: hat.")).to_be_visible()
    assert [key for key, _ in home.requests] == [keys.SENTENCE, keys.SEARCH]


def test_a_page_opened_before_the_navigator_waits_for_it(own, stage, tmp_path):
    parts = own(navigator=False)
    page = parts.open_page()
    _state(page, "Waiting")
    expect(page.locator("#veil")).to_contain_text(f"tcp/127.0.0.1:{parts.zenoh_port}")
    parts.home = stage.PublishedHome(parts.zenoh_port)
    _state(page, "Searching")
    expect(page.locator("#veil")).to_be_hidden()
    _drawn(page, tmp_path)


def test_the_page_comes_back_by_itself_when_the_console_does(own, stage, tmp_path):
    parts = own()
    page = parts.open_page()
    _drawn(page, tmp_path)
    parts.console.kill()
    _state(page, "Disconnected")
    expect(page.locator("#veil")).to_contain_text("The console does not respond")
    page.locator("#stop").click()
    expect(page.locator("#notice")).to_contain_text("Command not delivered")
    parts.console = stage.ConsoleProcess(parts.zenoh_port, parts.port)
    _state(page, "Searching")
    _drawn(page, tmp_path)
    expect(_view(page).get_by_text("going to the viewpoint")).to_be_visible()


def test_text_from_outside_runs_nothing(home, page):
    attack = "<img src=x onerror=\"parent.document.title='owned'\">"
    home.status_changes = {"why": attack, "robot": attack}
    expect(page.locator("#robot")).to_have_text(attack)
    expect(_view(page).get_by_text(attack)).to_be_visible()
    page.wait_for_timeout(500)
    assert "owned" not in page.title()


def test_another_servers_address_in_the_url_leads_nowhere(shared, page):
    asked = []
    page.on("websocket", lambda socket: asked.append(socket.url))
    page.goto(f"{shared.console.url}/view/?websocket=ws://127.0.0.1:9/evil")
    page.wait_for_timeout(3000)
    assert asked
    assert all(url.startswith(shared.console.url.replace("http", "ws")) for url in asked)


def test_a_first_visit_is_introduced_and_the_next_one_is_not(shared, browser, home):
    window = new_window(browser, 390, 844, is_first_visit=True)
    page = window.new_page()
    page.goto(shared.console.url)
    panel = box_at_rest(_view(page).locator("[data-dock-region='right']"))
    assert (panel["x"], panel["width"]) == (0, 390), "a phone's panel is below the map"
    card = page.locator("#introduction")
    expect(card).to_contain_text("1 of 5")
    for title in "Why it goes there", "Steer", "Confirm", "Review":
        page.get_by_role("button", name="Next").click()
        expect(card.get_by_role("heading")).to_have_text(title)
    expect(_view(page).get_by_role("tab", name="Session")).to_have_attribute(
        "aria-selected", "true"
    )
    # Space still stops the robot, and presses no button of the card.
    page.keyboard.press("Space")
    _state(page, "Stopped")
    expect(card).to_contain_text("5 of 5")
    page.reload()
    expect(card).to_contain_text("5 of 5")
    page.get_by_role("button", name="Done").click()
    page.reload()
    expect(page.locator("#state")).not_to_have_text("Connecting")
    expect(card).to_be_hidden()
    page.keyboard.press("?")
    page.get_by_role("button", name="Introduction").click()
    expect(card).to_contain_text("1 of 5")
    page.keyboard.press("Escape")
    expect(card).to_be_hidden()
    window.close()


def test_frames_for_messages_are_spaced_until_somebody_uses_the_page(shared):
    page = shared.window.new_page()
    page.goto(f"{shared.console.url}/assets/draw_rate.js")
    page.add_script_tag(url="draw_rate.js")
    frames = """async (isUsed) => {
        let frames = 0, due = false;
        const draw = () => { due = true; };
        ipponDrawRate.frame_ms = 100;
        const end = performance.now() + 1200;
        while (performance.now() < end) {
            ipponDrawRate.usedAt = isUsed ? performance.now() : -1e9;
            ipponDrawRate.request(draw);
            await new Promise((resolve) => setTimeout(resolve, 10));
            if (!due) continue;
            due = false;
            frames += 1;
            ipponDrawRate.drawn(draw);
        }
        return frames;
    }"""
    assert 1 <= page.evaluate(frames, False) <= 4, "every 400 ms"
    assert page.evaluate(frames, True) > 10
    page.close()
