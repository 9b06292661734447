"""The page around the scene in a real browser, with a console in the process of the test."""

import asyncio
import itertools
import os
import re
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit

import msgspec
import pytest
from playwright.sync_api import expect
from starlette.responses import StreamingResponse

from app.messages.driving import DriveStatus
from app.messages.lease import LeaseStatus
from app.messages.memory import MemoryReply
from app.nodes.console.link.commands import CommandError
from app.nodes.console.scene.click_explanation import ClickExplanation
from app.nodes.console.scene.shell_state import ShellState, ShownFind, ShownUnfound
from app.nodes.console.web import assets, gateway
from app.nodes.console.web.access import OpenAccess
from app.nodes.console.web.gateway import Gateway
from app.nodes.console.web.guard import Hosts
from app.view.drawing.viser_client import ClientFiles
from app.view.words import Words
from ippon.control.drive_mode import NO_INPUT
from tests.app.nodes.console.drawn_home import things_of
from tests.app.nodes.console.opened_page import expect_state, panels
from tests.app.relay import Relay
from tests.chromium import KEEP_PICTURES, PATIENCE_MS, boxes_at_rest, each_stop_once, new_window

pytestmark = pytest.mark.browser

SEARCHING = ShellState(
    instance="one", robot="ippon", link="live", state="searching", object="hat", has_map=True
)
MANUAL = msgspec.structs.replace(SEARCHING, state="manual", drive=DriveStatus(mode="manual"))
HAT = ShownFind(
    goal_id=7, number=2, name="hat", position=(1.0, 2.0, 0.5), size=(0.2, 0.2, 0.2),
    perhaps=False, out_of_reach_m=None,
)  # fmt: skip
WARNING = "console 0.1.0, navigator 0.1.1"
FORWARD = "[data-hold='1 0 0']"
HANG = """() => { new (document.getElementById('view').contentWindow.WebSocket)(
    `ws://${location.host}/view/`) }"""
RELOAD = "document.getElementById('view').contentWindow.location.reload()"


@pytest.fixture
def post(state_feed):
    """Has the pages show a state, or the last one with changes."""
    last, is_over, lock = [SEARCHING], threading.Event(), threading.Lock()

    def show(state=None, **changes):
        with lock:
            last[0] = msgspec.structs.replace(last[0] if state is None else state, **changes)
            state_feed.post(msgspec.json.encode(last[0]))

    def go_on():
        while not is_over.wait(1.0):
            show()

    show()
    thread = threading.Thread(target=go_on)
    thread.start()
    yield show
    is_over.set()
    thread.join()


@pytest.fixture(scope="module")
def shell_alone():
    """The files of the page with an empty document for the scene, whose script is half of the work.

    For tests that meet only what is around the scene.
    """
    empty = ClientFiles(page=b"<html><head></head><body></body></html>", files={}, links=b"")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(assets, "unpack_client", lambda *_: empty)
        files = assets.Assets()
    files.view = assets.Asset("view.html", empty.page, "no-cache")
    return files


@pytest.fixture
def alone(stage, viser_server, state_feed, navigator, browsers, shell_alone):
    """A console whose pages have no scene."""
    access, hosts = OpenAccess(browsers), Hosts("127.0.0.1")
    served = stage.Served(
        Gateway(viser_server, state_feed, navigator, access, hosts, assets=shell_alone)
    )
    yield served
    served.close()


@pytest.fixture
def window(browser):
    window = new_window(browser)
    yield window
    window.close()


def _opened(window, origin):
    page = window.new_page()
    page.goto(origin)
    expect_state(page, "Searching")
    expect(panels(page).locator("body")).to_be_attached()
    return page


@pytest.fixture
def page(window, alone, post):
    """The page of a robot that searches, without a scene."""
    return _opened(window, alone.origin)


@pytest.fixture
def whole(window, client, post):
    """The page of a robot that searches, with its scene."""
    return _opened(window, client.origin)


def _until(condition, timeout_s=PATIENCE_MS / 1e3):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def _keep(page, name):
    folder = os.environ.get(KEEP_PICTURES)
    if folder:
        page.screenshot(path=Path(folder) / f"{name}.png")


def _sockets(page, ending):
    """Return the addresses of the sockets that a page opens from now on, as they come."""
    opened = []
    page.on("websocket", lambda one: ending in one.url and opened.append(one.url))
    return opened


def test_the_page_starts_while_the_document_of_the_scene_has_no_element(
    window, client, post, monkeypatch
):
    view, goes_on = gateway.Assets().view, threading.Event()
    whole = view.response

    async def late(body):
        while not goes_on.is_set():
            await asyncio.sleep(0.02)
        yield body

    def slow(request):
        answer = whole(request)
        length = {k: v for k, v in answer.headers.items() if k != "content-length"}
        return StreamingResponse(late(answer.body), headers=length)

    monkeypatch.setattr(view, "response", slow)
    page = window.new_page()
    problems = []
    page.on("pageerror", lambda problem: problems.append(str(problem)))
    page.goto(client.origin, wait_until="commit")
    try:
        # Until its first bytes come, it is the empty document that every frame begins with.
        page.wait_for_function(
            "() => document.getElementById('view')?.contentDocument?.documentElement === null"
        )
        expect_state(page, "Searching")
    finally:
        goes_on.set()
    assert problems == []


def test_a_page_that_slept_asks_before_it_leaves_its_line(window, alone, post):
    page, pongs = window.new_page(), []

    def hear(socket):
        socket.on("framereceived", lambda text: '"pong"' in str(text) and pongs.append(text))

    page.on("websocket", hear)
    page.clock.install()
    page.goto(alone.origin)
    page.clock.run_for(1_000)
    expect_state(page, "Searching")
    opened = _sockets(page, "/api/ws")
    for _ in range(3):
        before = len(pongs)
        page.clock.fast_forward(60_000)
        # An answer comes in the time of this machine, whatever the page's clock says.
        _until(lambda before=before: page.wait_for_timeout(20) or len(pongs) > before)
    expect_state(page, "Searching")
    assert opened == []


def test_a_line_that_is_silent_is_left_and_the_console_is_told_for_how_long(window, alone, post):
    relay = Relay(int(alone.origin.rpartition(":")[2]))
    page = window.new_page()
    page.goto(f"http://127.0.0.1:{relay.port}")
    expect_state(page, "Searching")
    opened = _sockets(page, "/api/ws")
    relay.silence()
    _until(lambda: page.wait_for_timeout(50) or opened)
    assert 3.0 < float(opened[0].rpartition("?silent_s=")[2]) < 60.0
    expect_state(page, "Searching")
    relay.close()


def test_a_handshake_of_the_scene_that_hangs_holds_no_new_line_up(window, alone, post):
    """A browser opens one socket to a server after the other."""
    relay = Relay(int(alone.origin.rpartition(":")[2]))
    page = window.new_page()
    page.clock.install()
    page.goto(f"http://127.0.0.1:{relay.port}")
    page.clock.run_for(1_000)
    expect_state(page, "Searching")
    relay.swallows = True
    page.evaluate(HANG)
    _until(lambda: page.wait_for_timeout(50) or relay.swallowed)
    relay.swallows = False
    relay.silence()
    shown = page.locator("#state")
    _until(lambda: page.clock.run_for(2_000) or shown.inner_text() == "Disconnected")
    _until(lambda: page.clock.run_for(2_000) or shown.inner_text() == "Searching")
    relay.close()


def test_a_scene_that_could_not_be_loaded_is_loaded_with_the_next_line(whole, client, post):
    page = whole
    page.route(re.compile(r"/view/\?"), lambda route: route.abort())
    page.evaluate(RELOAD)
    page.wait_for_function("() => document.getElementById('view').contentDocument === null")
    page.unroute_all()
    _drop_lines(page, client)
    expect(panels(page).locator("canvas[data-engine]")).to_be_attached()


def _drop_lines(page, console):
    """End the sockets of a page, as a console does at a logout."""
    cookies = page.context.cookies(console.origin)
    name = f"ippon-{urlsplit(console.origin).port}"
    value = next(one["value"] for one in cookies if one["name"] == name)
    headers = {"Cookie": f"{name}={value}"}
    console.http.post("/api/stop?silent_s=0", headers=headers)


def test_a_page_of_another_edition_than_the_consoles_is_loaded_again_once_nobody_types(
    page, alone, navigator, shell_alone, post, monkeypatch
):
    is_old = "() => window.isOld"
    page.evaluate("window.isOld = true")
    opened = _sockets(page, "/api/ws")
    _drop_lines(page, alone)
    _until(lambda: page.wait_for_timeout(50) or opened)
    expect_state(page, "Searching")
    page.wait_for_timeout(1_000)
    assert page.evaluate(is_old), "a console that is the same as before"
    page.keyboard.press("b")
    page.locator("#robots-goal").fill("ha")
    monkeypatch.setattr(shell_alone, "edition", "another")
    _drop_lines(page, alone)
    _until(lambda: page.wait_for_timeout(50) or len(opened) == 2)
    expect_state(page, "Searching")
    page.locator("#robots-goal").press_sequentially("t")
    page.wait_for_timeout(3_000)
    assert page.locator("#robots-goal").input_value() == "hat"
    page.locator("#robots-goal").fill("")
    page.wait_for_function("() => !window.isOld")
    expect_state(page, "Searching")
    page.evaluate("window.isOld = true")
    post(MANUAL)
    expect_state(page, "Manual")
    _hold(page, navigator)
    page.wait_for_timeout(3_000)
    assert page.evaluate(is_old), "once"
    monkeypatch.setattr(shell_alone, "edition", "a third")
    _drop_lines(page, alone)
    page.wait_for_function("() => !window.isOld")
    _expect_still(page, navigator)


def test_a_stop_that_the_console_cannot_deliver_says_why(page, navigator, monkeypatch):
    async def control(_):
        # Longer than the page waits for an answer over HTTP.
        await asyncio.sleep(4.0)
        raise CommandError("no navigator at tcp/127.0.0.1:7447")

    monkeypatch.setattr(navigator, "control", control)
    page.keyboard.press("Space")
    expect(page.locator("#notice-text")).to_have_text("no navigator at tcp/127.0.0.1:7447")


def test_another_version_hides_no_find_and_can_be_closed(page, post):
    notice = page.locator("#notice")
    post(warning=WARNING, find=HAT)
    expect(notice).to_contain_text("Found")
    post(find=None)
    expect(notice).to_contain_text("navigator 0.1.1")
    page.locator("#notice-close").click()
    expect(notice).to_be_hidden()
    post(msgspec.structs.replace(SEARCHING, state="paused", warning=WARNING))
    expect(notice).to_contain_text("Paused")
    post(msgspec.structs.replace(SEARCHING, warning=WARNING))
    expect(notice).to_be_hidden()


def test_an_explanation_from_before_stays_closed_and_one_that_was_closed_too(page, alone, post):
    card = page.locator("#explanation")
    post(explanation=ClickExplanation(number=4, title="Sofa"))
    expect(card).to_be_visible()
    later = page.context.new_page()
    later.goto(alone.origin)
    expect_state(later, "Searching")
    expect(later.locator("#explanation")).to_be_hidden()
    page.locator("#explanation-close").click()
    opened = _sockets(page, "/api/ws")
    _drop_lines(page, alone)
    _until(lambda: page.wait_for_timeout(50) or opened)
    expect_state(page, "Searching")
    expect(card).to_be_hidden()
    post(explanation=ClickExplanation(number=5, title="Table"))
    expect(card).to_contain_text("Table")
    expect(later.locator("#explanation")).to_contain_text("Table")


def test_a_scene_that_is_loaded_again_leaves_nothing_behind(whole):
    page = whole
    session = page.context.new_cdp_session(page)
    scene = page.frame(url=lambda url: "/view/" in url)

    def documents():
        session.send("HeapProfiler.enable")
        for _ in range(2):
            session.send("HeapProfiler.collectGarbage")
        return session.send("Memory.getDOMCounters")["documents"]

    def load():
        page.evaluate("document.getElementById('view').contentWindow.isOld = true")
        page.evaluate(RELOAD)
        scene.wait_for_function("() => globalThis.isOld === undefined")
        expect(panels(page).locator("canvas[data-engine]")).to_be_attached()
        page.wait_for_timeout(500)

    load()
    before = documents()
    for _ in range(3):
        load()
    _until(lambda: documents() <= before + 1 or page.wait_for_timeout(500))


def test_a_click_in_the_scene_lets_the_page_call_by_sound(window, client, post):
    window.add_init_script(
        "globalThis.AudioContext = class { constructor() { top.sounds = (top.sounds ?? 0) + 1; } };"
    )
    page = window.new_page()
    page.goto(client.origin)
    expect_state(page, "Searching")
    panels(page).locator("canvas[data-engine]").click(position={"x": 300, "y": 500})
    page.wait_for_function("() => top.sounds === 1")


def _hold(page, navigator):
    """Hold W until the robot is told."""
    before = len(navigator.inputs)
    page.keyboard.down("w")
    _until(lambda: len(navigator.inputs) > before and navigator.inputs[-1].forward == 1.0)


def _expect_still(page, navigator):
    _until(lambda: navigator.inputs[-1] == NO_INPUT)
    page.wait_for_timeout(200)
    assert navigator.inputs[-1] == NO_INPUT


def _in_manual(page, post):
    post(MANUAL)
    expect_state(page, "Manual")
    return page


@pytest.fixture
def driven(page, post):
    """The page of a robot in Manual, without a scene."""
    return _in_manual(page, post)


def test_keys_are_released_where_nobody_tells_of_their_release(driven, navigator):
    page = driven
    _hold(page, navigator)
    page.locator("#camera-label").click()
    _expect_still(page, navigator)
    page.keyboard.up("w")
    page.keyboard.press("Escape")
    _hold(page, navigator)
    page.mouse.click(300, 20, button="right")
    _expect_still(page, navigator)
    page.keyboard.up("w")
    _hold(page, navigator)
    page.keyboard.down("Meta")
    _expect_still(page, navigator)
    page.keyboard.up("Meta")
    page.keyboard.up("w")


def test_a_scene_that_loads_again_releases_keys_and_takes_a_stop_at_once(whole, navigator, post):
    page = _in_manual(whole, post)
    waiting = []

    def keep(route):
        waiting.append(route)

    page.evaluate("document.getElementById('view').focus()")
    page.route("**/assets/draw_rate.js", keep)
    _hold(page, navigator)
    page.evaluate(RELOAD)
    _expect_still(page, navigator)
    _until(lambda: page.wait_for_timeout(50) or waiting)
    page.keyboard.up("w")
    page.wait_for_function(
        "() => Object.hasOwn(document.getElementById('view').contentDocument, 'hasFocus')"
    )
    with each_stop_once(page):
        page.keyboard.press("Space")
        _until(lambda: page.wait_for_timeout(50) or navigator.actions == ["stop"])
    for route in waiting:
        route.continue_()


def _middle(locator):
    box = locator.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


@pytest.mark.usefixtures("each_stop_once")
def test_a_second_finger_on_stop_stops_while_the_first_drives(driven, navigator):
    page = driven
    session = page.context.new_cdp_session(page)
    pad, stop = _middle(page.locator(FORWARD)), _middle(page.locator("#stop"))

    def touch(kind, *fingers):
        points = [{"x": x, "y": y, "id": n} for n, (x, y) in enumerate(fingers)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", pad)
    _until(lambda: navigator.inputs and navigator.inputs[-1].forward == 1.0)
    touch("touchStart", pad, stop)
    _until(lambda: page.wait_for_timeout(50) or navigator.actions)
    touch("touchEnd")
    touch("touchStart", stop)
    touch("touchEnd")
    _until(lambda: page.wait_for_timeout(50) or len(navigator.actions) >= 2)
    page.wait_for_timeout(500)
    assert navigator.actions == ["stop", "stop"], "one for each press"


@pytest.mark.usefixtures("each_stop_once")
@pytest.mark.parametrize("dialog", ["help", "room"])
def test_stop_is_pressed_also_while_a_dialog_is_open(page, navigator, dialog):
    stop = _middle(page.locator("#stop"))
    page.evaluate(f"document.getElementById('{dialog}').showModal()")
    page.mouse.click(500, 20)
    page.evaluate(f"document.getElementById('{dialog}').close()")
    page.evaluate(f"document.getElementById('{dialog}').showModal()")
    page.mouse.click(*stop)
    _until(lambda: page.wait_for_timeout(50) or navigator.actions)
    page.evaluate(f"document.getElementById('{dialog}').close()")
    page.locator("#stop").press("Enter")
    _until(lambda: page.wait_for_timeout(50) or len(navigator.actions) == 2)
    assert navigator.actions == ["stop", "stop"]


def test_a_verdict_is_for_the_find_that_the_notice_shows(page, post, navigator):
    post(msgspec.structs.replace(SEARCHING, state="found", find=HAT))
    page.locator("#notice").get_by_role("button", name="Confirm", exact=True).click()
    _until(lambda: page.wait_for_timeout(50) or navigator.actions)
    assert navigator.actions == [("confirm", 7, 2)]


def test_a_find_of_a_tour_waits_over_the_scene_while_the_robot_goes_on(page, post, navigator):
    find = ShownFind(
        goal_id=7, number=2, name="chair 2", position=(1.0, 2.0, 0.5), size=(0.2, 0.2, 0.2),
        perhaps=False, out_of_reach_m=None,
    )  # fmt: skip
    lost = ShownUnfound(goal_id=3, took_s=1.0, name="hat", places=0)
    post(msgspec.structs.replace(SEARCHING, state="searching", find=find, unfound=lost))
    notice = page.locator("#notice")
    expect(notice).to_contain_text("Found: chair 2 Is this it?")
    notice.get_by_role("button", name="Not this", exact=True).click()
    _until(lambda: page.wait_for_timeout(50) or navigator.actions)
    assert navigator.actions == [("reject", 7, 2)]
    post(msgspec.structs.replace(SEARCHING, state="searching", unfound=lost))
    expect(notice).to_contain_text("Not found: hat")


def test_a_closed_notice_stays_closed_for_the_search_of_that_run_only(page, post):
    lost = ShownUnfound(goal_id=1, took_s=20.1, name="hat", places=0)
    post(unfound=lost)
    notice = page.locator("#notice")
    expect(notice).to_contain_text("Not found: hat")
    page.locator("#notice-close").click()
    expect(notice).to_be_hidden()
    post(unfound=lost, why="closed")
    expect(page.locator("#why")).to_have_text("closed")
    expect(notice).to_be_hidden()
    post(unfound=msgspec.structs.replace(lost, took_s=20.2))
    expect(notice).to_be_visible()


def test_a_plan_without_a_map_has_no_rooms(page):
    room = {"x_m": 1.0, "y_m": 1.0, "name": "hall", "kind": "", "area_m2": 4.0}
    scene = {"revision": 1, "explored_m2": 4.0, "rooms": [room], "things": [], "trail": [],
             "path": [], "painted": [], "find": None, "robot": None}  # fmt: skip
    cells = {"revision": 1, "origin_m": [0.0, 0.0], "size": [4, 4], "cell_m": 0.5, "packed": "AAAA"}
    page.route("**/api/export/plan-cells.json", lambda route: route.fulfill(json=cells))
    page.route("**/api/export/plan.json", lambda route: route.fulfill(json=scene))
    page.keyboard.press("p")
    expect(page.locator("#plan-rooms button")).to_have_text("hall")
    page.unroute("**/api/export/plan.json")
    page.route("**/api/export/plan.json", lambda route: route.fulfill(status=404))
    expect(page.locator("#plan-none")).to_be_visible()
    expect(page.locator("#plan-rooms button")).to_have_count(0)


def _show_plan(page, *rooms, painted=()):
    """Have a page show a plan of 9 m by 9 m of floor; `rooms` have name, x and area."""
    rooms = [
        {"x_m": x, "y_m": 1.0, "name": name, "kind": "", "area_m2": area} for name, x, area in rooms
    ]
    scene = {"revision": 1, "explored_m2": 4.0, "rooms": rooms, "things": [], "trail": [],
             "path": [], "painted": list(painted), "find": None, "robot": None}  # fmt: skip
    cells = {"revision": 1, "origin_m": [0.0, 0.0], "size": [9, 9], "cell_m": 1.0,
             "packed": "VVVVVVVVVVVVVVVVVVVVVVVVVVVV"}  # fmt: skip
    page.unroute("**/api/export/plan.json")
    page.route("**/api/export/plan-cells.json", lambda route: route.fulfill(json=cells))
    page.route("**/api/export/plan.json", lambda route: route.fulfill(json=scene))


FLOOR_BOX = """() => {
    const canvas = document.getElementById("plan-picture");
    const { width, height } = canvas;
    const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
    const all = [[], []];
    for (let at = 0; at < width * height; at += 1) {
        if (data[4 * at] !== 242 || data[4 * at + 1] !== 239) continue;
        all[0].push(at % width);
        all[1].push(Math.floor(at / width));
    }
    const scale = width / canvas.getBoundingClientRect().width;
    const { left, top } = canvas.getBoundingClientRect();
    const ends = (values, from) =>
        [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))]
            .map((value) => from + value / scale);
    const [x0, x1] = ends(all[0], left);
    const [y0, y1] = ends(all[1], top);
    return [x0, y0, x1, y1];
}"""
"""Where the floor of the plan is on the page: left, top, right, bottom."""


def _meets(box, other):
    left, top, right, bottom = box
    return (
        left < other["x"] + other["width"]
        and other["x"] < right
        and top < other["y"] + other["height"]
        and other["y"] < bottom
    )


@pytest.mark.parametrize(
    ("width", "height"), [(1440, 900), (1024, 768), (768, 1024), (390, 844), (844, 390)]
)
def test_the_plan_fits_beside_its_tools_and_the_camera(page, width, height):
    page.set_viewport_size({"width": width, "height": height})
    _show_plan(page)
    page.keyboard.press("p")
    expect(page.locator("#plan-none")).to_be_hidden()
    floor = page.evaluate(FLOOR_BOX)
    for part in (".plan-tools", "#camera"):
        box = page.locator(part).bounding_box()
        assert box is None or not _meets(floor, box), part
    shown = page.locator("#plan-picture").bounding_box()
    least = 0.35 * min(shown["width"], shown["height"])
    assert floor[2] - floor[0] >= least


def test_a_plan_that_nobody_has_moved_fits_a_window_of_another_size(page):
    _show_plan(page)
    page.keyboard.press("p")
    expect(page.locator("#plan-none")).to_be_hidden()
    before = page.evaluate(FLOOR_BOX)
    page.set_viewport_size({"width": 700, "height": 500})
    _until(lambda: page.wait_for_timeout(50) or page.evaluate(FLOOR_BOX) != before)
    left, top, right, bottom = page.evaluate(FLOOR_BOX)
    assert right - left == pytest.approx(bottom - top, abs=3), "all of the square is in the window"


def test_only_the_left_button_clicks_and_moves_the_plan(page):
    _show_plan(page)
    page.keyboard.press("p")
    expect(page.locator("#plan-none")).to_be_hidden()
    page.keyboard.press("m")
    x0, y0, x1, y1 = before = page.evaluate(FLOOR_BOX)
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    answer = page.locator("#plan-answer")
    for button in ("middle", "right"):
        page.mouse.click(x, y, button=button)
        assert answer.inner_text().startswith("Click two points")
        page.mouse.down(button=button)
        page.mouse.move(x + 60, y + 60)
        page.mouse.up(button=button)
        page.mouse.move(x, y)
    assert page.evaluate(FLOOR_BOX) == before
    page.mouse.click(x, y)
    assert answer.inner_text() == "Now the second point."


def test_two_fingers_zoom_the_plan_where_they_are_and_click_nothing(page):
    _show_plan(page)
    page.keyboard.press("p")
    expect(page.locator("#plan-none")).to_be_hidden()
    page.keyboard.press("m")
    for _ in range(3):
        page.keyboard.press("-")
    x0, y0, x1, y1 = page.evaluate(FLOOR_BOX)
    session = page.context.new_cdp_session(page)

    def touch(kind, *fingers):
        points = [{"x": x, "y": y, "id": n} for n, (x, y) in enumerate(fingers)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    # Both fingers stay on the places of the plan that they took.
    left, right, y = x0 + 60, x0 + 140, y0 + 60
    touch("touchStart", (left, y))
    touch("touchStart", (left, y), (right, y))
    for step in range(1, 5):
        touch("touchMove", (left - 5 * step, y), (right + 5 * step, y))
    touch("touchMove", (left - 20, y + 10), (right + 20, y + 10))
    touch("touchEnd")
    expect(page.locator("#plan-answer")).to_contain_text("Click two points")
    low_u, low_v = left - 20 - 1.5 * 60, y + 10 - 1.5 * 60
    high_u, high_v = low_u + 1.5 * (x1 - x0), low_v + 1.5 * (y1 - y0)
    assert page.evaluate(FLOOR_BOX) == pytest.approx([low_u, low_v, high_u, high_v], abs=6)


def test_the_wheel_keeps_the_place_under_the_pointer(page):
    _show_plan(page)
    page.keyboard.press("p")
    expect(page.locator("#plan-none")).to_be_hidden()
    x0, y0, x1, _ = page.evaluate(FLOOR_BOX)
    page.mouse.move(x0, y0)
    page.mouse.wheel(0, -100)
    page.wait_for_function(f"before => ({FLOOR_BOX})()[2] - before > 10", arg=x1)
    assert page.evaluate(FLOOR_BOX)[:2] == pytest.approx([x0, y0], abs=3)
    moved = page.evaluate(FLOOR_BOX)
    page.mouse.wheel(100, 0)
    page.wait_for_timeout(100)
    assert page.evaluate(FLOOR_BOX) == moved, "sideways is no zoom"


def test_the_plan_does_not_follow_a_mouse_whose_release_was_swallowed(page):
    _show_plan(page)
    page.keyboard.press("p")
    expect(page.locator("#plan-none")).to_be_hidden()
    x0, y0, x1, y1 = before = page.evaluate(FLOOR_BOX)
    page.mouse.move((x0 + x1) / 2, (y0 + y1) / 2)
    page.mouse.down()
    page.evaluate(
        """([clientX, clientY]) => {
        const to = { pointerId: 1, pointerType: "mouse", buttons: 0, clientX, clientY };
        document.getElementById("plan-picture").dispatchEvent(new PointerEvent("pointermove", to));
        }""",
        [x0, y0],
    )
    page.mouse.move(x0, y0)
    assert page.evaluate(FLOOR_BOX) == before


def test_names_of_rooms_do_not_cover_each_other(page):
    page.set_viewport_size({"width": 390, "height": 844})
    _show_plan(page, ("", 4.0, 4.0), ("living room", 4.4, 12.0), ("", 4.8, 3.0), ("bath", 4.4, 2.0))
    page.keyboard.press("p")
    rooms = page.locator("#plan-rooms button")
    expect(rooms).to_have_count(4)
    boxes = [room.bounding_box() for room in rooms.all()]
    for one, other in itertools.combinations(boxes, 2):
        corners = one["x"], one["y"], one["x"] + one["width"], one["y"] + one["height"]
        assert not _meets(corners, other)


def test_discs_of_a_painted_region_that_overlap_have_one_tone(page):
    region = {"kind": "not_here", "strokes": [[4.0, 4.0], [4.5, 4.0]], "radius_m": 0.6}
    _show_plan(page, painted=[region])
    page.keyboard.press("p")
    expect(page.locator("#plan-none")).to_be_hidden()
    tones = page.evaluate(
        """() => {
        const canvas = document.getElementById("plan-picture");
        const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
        const blue = new Set();
        for (let at = 0; at < data.length; at += 4)
            if (data[at] < 200 && data[at + 2] > data[at] + 20) blue.add(data[at]);
        return [...blue]; }"""
    )
    # The edges of the discs are smoothed: their tones are between the floor's and the area's.
    assert min(tones) == round(0.72 * 242)


def test_a_room_that_grows_keeps_the_focus(page):
    _show_plan(page, ("hall", 1.0, 4.0), ("study", 6.0, 3.0))
    page.keyboard.press("p")
    page.locator("#plan-rooms button").last.focus()
    _show_plan(page, ("study", 6.5, 5.0), ("hall", 1.0, 4.0))
    expect(page.locator("#plan-rooms button").first).to_have_text("study")
    expect(page.locator("#plan-rooms button").first).to_be_focused()


def test_a_room_that_grows_while_its_name_is_pressed_is_renamed(page):
    _show_plan(page, ("hall", 1.0, 4.0), ("study", 6.0, 3.0))
    page.keyboard.press("p")
    study = page.locator("#plan-rooms button", has_text="study")
    study.hover()
    page.mouse.down()
    _show_plan(page, ("hall", 1.0, 4.5), ("study", 6.1, 5.0), ("bath", 4.0, 2.0))
    expect(page.locator("#plan-rooms button")).to_have_count(3)
    study.hover()
    page.mouse.up()
    expect(page.locator("#room-name")).to_have_value("study")


def test_a_text_that_stays_the_same_is_not_written_again(page, post):
    page.evaluate(
        """() => { globalThis.writes = [];
        const keep = (all) => writes.push(...all.map((one) => one.target.id));
        const watch = new MutationObserver(keep);
        for (const id of ["state", "goal", "elapsed", "asked-text", "notice-title"])
          watch.observe(document.getElementById(id), { childList: true, characterData: true }); }"""
    )
    post(why="going to the sofa")
    expect(page.locator("#why")).to_have_text("going to the sofa")
    post(elapsed_s=61.0)
    expect(page.locator("#elapsed")).to_have_text("1:01")
    assert page.evaluate("writes") == ["elapsed"]


@pytest.mark.parametrize("width", [970, 1024, 1100])
def test_the_header_of_a_small_window_shows_its_texts_side_by_side(page, post, width):
    page.set_viewport_size({"width": width, "height": 768})
    looking = msgspec.structs.replace(SEARCHING, state="looking_around", object="washing machine")
    post(looking, elapsed_s=754.0)
    expect_state(page, "Looking around")
    ends = [
        page.locator(part).bounding_box()
        for part in ("#state", "#goal", "#elapsed", ".gauges", "#control", ".actions")
    ]
    for left, right in itertools.pairwise(ends):
        assert left["x"] + left["width"] <= right["x"]


@pytest.mark.parametrize("width", [970, 1024, 1100])
@pytest.mark.parametrize("is_watching", [False, True])
def test_the_header_of_a_small_window_shows_what_is_searched_for(page, post, width, is_watching):
    page.set_viewport_size({"width": width, "height": 768})
    why = "going to the viewpoint by the bed (near): gain 621, 4.1 s away"
    lease = LeaseStatus(state="held", holder="browser 12", epoch=3) if is_watching else None
    post(object="toothbrush", why=why, elapsed_s=754.0, lease=lease or LeaseStatus())
    if is_watching:
        expect(page.locator("#lease-over")).to_be_visible()
    expect(page.locator("#goal")).to_have_text("toothbrush")
    goal = page.locator("#goal")
    assert goal.evaluate("(e) => e.scrollWidth <= e.clientWidth"), "its end is cut off"
    right = goal.evaluate("(e) => e.getBoundingClientRect().right")
    assert right <= page.locator(".now").evaluate("(e) => e.getBoundingClientRect().right")


_PANEL_PX = 376
_BESIDE_THE_PANEL = f"""for (const one of document.querySelectorAll(".stack, #explanation"))
    one.style.setProperty("--scene-right", "{_PANEL_PX}px");"""
"""In a page without a scene, which says how wide the panel is."""


@pytest.mark.parametrize("is_listed", [False, True])
def test_an_explanation_and_a_notice_are_beside_each_other(page, post, is_listed):
    lost = ShownUnfound(
        goal_id=3, took_s=1.0, name="the little red hat of my grandmother", places=2
    )
    post(unfound=lost, explanation=ClickExplanation(number=4, title="Sofa", note="A sofa."))
    expect(page.locator("#explanation")).to_be_visible()
    page.evaluate(_BESIDE_THE_PANEL)
    if is_listed:
        page.keyboard.press("g")
    for width in (1100, 1200, 1400, 1440):
        page.set_viewport_size({"width": width, "height": 900})
        explained, notice = boxes_at_rest(page.locator("#explanation"), page.locator("#notice"))
        left, top = notice["x"], notice["y"]
        right, bottom = left + notice["width"], top + notice["height"]
        assert not _meets((left, top, right, bottom), explained), width
        for box in (explained, notice):
            assert box["width"] > 150, width
            assert box["x"] + box["width"] <= width - _PANEL_PX


@pytest.mark.parametrize("width", [970, 1024, 1440])
def test_the_cross_of_a_notice_takes_no_row(page, post, width):
    page.set_viewport_size({"width": width, "height": 768})
    find = ShownFind(
        goal_id=7, number=2, name="washing machine", position=(1.0, 2.0, 0.5),
        size=(0.2, 0.2, 0.2), perhaps=False, out_of_reach_m=None,
    )  # fmt: skip
    post(msgspec.structs.replace(SEARCHING, state="found", find=find))
    expect(page.locator("#notice-close")).to_be_visible()
    cross, notice = (page.locator(part).bounding_box() for part in ("#notice-close", "#notice"))
    assert cross["y"] - notice["y"] < 10
    assert notice["x"] + notice["width"] - cross["x"] - cross["width"] < 10
    acts = page.locator("#notice-acts").bounding_box()
    assert acts["x"] + acts["width"] <= cross["x"]


IS_SEEN = """(e) => {
  const { left, top, width, height } = e.getBoundingClientRect();
  return e.contains(document.elementFromPoint(left + width / 2, top + height / 2));
}"""
"""Whether an element is on the screen with nothing over it."""


@pytest.mark.parametrize(("width", "height"), [(390, 844), (720, 450)])
def test_a_list_on_a_phone_covers_nothing_that_must_be_seen(page, post, width, height):
    page.set_viewport_size({"width": width, "height": height})
    notice, card = page.locator("#notice"), page.locator("#explanation")
    sofa = ClickExplanation(number=4, title="Sofa")
    stopped = msgspec.structs.replace(SEARCHING, state="stopped", explanation=sofa)
    page.keyboard.press("g")
    # The pad of Manual has a place for notices of its own.
    for drive in DriveStatus(mode="manual"), DriveStatus():
        post(stopped, drive=drive)
        expect_state(page, "Stopped")
        expect(page.locator("#mode")).to_have_text(drive.mode.capitalize())
        _keep(page, f"{width}-list-stopped")
        assert notice.evaluate(IS_SEEN)
        assert page.locator("#goals-close").evaluate(IS_SEEN)
    expect(page.locator("#view")).to_be_hidden()
    expect(card).to_be_hidden()
    post(msgspec.structs.replace(stopped, state="found", find=HAT))
    expect(page.locator("#notice-title")).to_contain_text("Found")
    expect(notice).to_be_hidden()
    post(link="waiting", has_map=False)
    expect(page.locator("#veil")).to_be_visible()
    _keep(page, f"{width}-list-veil")
    assert page.locator("#veil-title").evaluate(IS_SEEN)
    post(link="live", has_map=True)
    page.locator("#goals-close").click()
    for part in notice, card, page.locator("#view"):
        expect(part).to_be_visible()


def test_ages_are_those_of_the_console_whatever_the_clock_of_the_tablet_says(
    window, alone, post, navigator
):
    mug = msgspec.structs.replace(things_of()[0], last_seen_ns=time.time_ns())
    navigator.things = lambda: MemoryReply(things=[mug], count=1)
    page = window.new_page()
    page.clock.install(time=time.time() + 3 * 3600)
    page.goto(alone.origin)
    page.clock.run_for(1_000)
    expect_state(page, "Searching")
    page.keyboard.press("t")
    expect(page.locator("#things-list small").nth(1)).to_contain_text("just now")


def test_another_thing_of_the_same_number_has_its_own_picture(page, navigator):
    asked = []
    page.on("request", lambda one: "/api/things/" in one.url and asked.append(one.url))
    for since_ns in (10**18, 2 * 10**18):
        mug = msgspec.structs.replace(
            things_of()[0], instance_id=1, first_seen_ns=since_ns, has_picture=True
        )
        navigator.things = lambda mug=mug: MemoryReply(things=[mug], count=1)
        page.keyboard.press("t")
        wanted = f"/api/things/1?since={since_ns}"
        while not any(wanted in url for url in asked):
            page.wait_for_event("request")
        page.keyboard.press("Escape")


def test_a_goal_that_has_moved_keeps_the_focus(page, post, state_feed):
    def goals(*numbers):
        common = {"outcome": "queued", "context": "", "count": 1, "rejected": 0, "took_s": None,
                  "counted": [], "confirmed": False, "display": "", "tour": None}  # fmt: skip
        waiting = [{"goal_id": n, "object": f"cup {n}", **common} for n in numbers]
        state_feed.goals = msgspec.json.encode({"waiting": waiting})
        post(goals=numbers[0])

    goals(5, 6, 7)
    page.keyboard.press("g")
    page.get_by_role("button", name="Move cup 7 up").focus()
    goals(5, 7, 6)
    goals(7, 5, 6)
    expect(page.locator("#goals-waiting li").first).to_contain_text("cup 7")
    expect(page.get_by_role("button", name="Move cup 7 down")).to_be_focused()


def test_a_picture_that_waited_to_be_drawn_is_as_old_as_that(page):
    age = """async () => {
        const { Camera } = await import("/assets/camera.js");
        const drawn = { drawnAt: Date.now(), waited_ms: 60000, header: { held_ms: 5 } };
        return Camera.prototype.age.call({ drawn, latency: { ms: 40 } });
    }"""
    assert 60_005 <= page.evaluate(age) < 61_000


SHAPE = """async ([width, height]) => {
    const { Camera } = await import("/assets/camera.js");
    const section = document.getElementById("camera");
    const one = { section, times: [], renderLabels() {} };
    const header = { stamp_ns: 1, label: "", labels: [], held_ms: 0 };
    Camera.prototype.hear.call(one, { header, shape: width / height, drawnAt: 1, bytes: 1 });
    const box = document.getElementById("camera-picture").getBoundingClientRect();
    return box.width / box.height;
}"""


@pytest.mark.parametrize(
    ("size", "shape"), [((1280, 720), 16 / 9), ((640, 480), 4 / 3), ((720, 1280), 4 / 3)]
)
def test_the_camera_in_the_corner_has_the_shape_of_its_picture(page, size, shape):
    expect(page.locator("#camera")).to_have_attribute("data-size", "corner")
    assert page.evaluate(SHAPE, size) == pytest.approx(shape, rel=0.01)


@pytest.mark.parametrize("size", [(1280, 800), (820, 1180), (390, 844)])
def test_the_introduction_covers_no_part_of_the_pad(browser, alone, post, size):
    window = new_window(browser, *size, is_first_visit=True)
    page = _opened(window, alone.origin)
    post(MANUAL)
    expect_state(page, "Manual")
    card, pad = boxes_at_rest(page.locator("#introduction"), page.locator("#pad"))
    assert card["y"] >= 0.0
    assert card["y"] + card["height"] <= pad["y"]
    window.close()


def test_escape_closes_the_introduction_wherever_the_focus_is(browser, alone, post):
    window = new_window(browser, is_first_visit=True)
    page = _opened(window, alone.origin)
    card = page.locator("#introduction")
    for focus in (
        lambda: None,
        lambda: page.locator("#introduction-text").click(),
        lambda: panels(page).locator("body").click(position={"x": 5, "y": 500}),
        lambda: page.locator("#introduction-next").click(),
    ):
        expect(card).to_be_visible()
        focus()
        page.keyboard.press("Escape")
        expect(card).to_be_hidden()
        page.evaluate("localStorage.removeItem('ippon-introduction')")
        page.reload()
    expect(card).to_be_visible()
    page.keyboard.press("g")
    page.keyboard.press("Escape")
    expect(page.locator("#goals")).to_be_hidden()
    expect(card).to_be_visible()
    post(explanation=ClickExplanation(number=4, title="Sofa"))
    expect(page.locator("#explanation")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator("#explanation")).to_be_hidden()
    expect(card).to_be_visible()
    window.close()


def test_a_page_with_its_scene_has_no_errors(window, client, post):
    page, problems = window.new_page(), []
    page.on("pageerror", lambda problem: problems.append(str(problem)))
    page.goto(client.origin)
    expect(panels(page).locator("canvas[data-engine]")).to_be_attached()
    page.wait_for_timeout(1_000)
    assert problems == []


def test_a_paused_robot_is_said_to_wait_for_resume(page, post):
    post(msgspec.structs.replace(SEARCHING, state="paused", why="paused"))
    expect(page.locator("#notice")).to_contain_text(
        "Paused The robot does not move until Resume is pressed in the Search tab."
    )


def test_cancelling_a_goal_of_a_tour_is_answered_in_words(page, post, state_feed):
    common = {"outcome": "active", "context": "", "count": 1, "rejected": 0, "took_s": None,
              "counted": [], "confirmed": False, "display": "", "tour": 5}  # fmt: skip
    active = [{"goal_id": n, "object": name, **common} for n, name in ((5, "hat"), (6, "plant"))]
    state_feed.goals = msgspec.json.encode({"active": active})
    post(goals=5)
    page.keyboard.press("g")
    page.locator("#goals-active").get_by_role("button", name="Cancel").last.click()
    expect(page.locator("#goals-answer")).to_have_text("Done.")


def test_a_goal_of_a_tour_that_is_over_has_nothing_to_cancel(page, post, state_feed):
    common = {"context": "", "count": 1, "rejected": 0, "took_s": None, "counted": [],
              "display": "", "tour": 5}  # fmt: skip
    ends = [("hat", "found", True), ("plant", "found", False), ("tv", "active", False),
            ("cup", "cancelled", False), ("mug", "out_of_reach", True)]  # fmt: skip
    active = [
        {"goal_id": n, "object": name, "outcome": outcome, "confirmed": confirmed, **common}
        for n, (name, outcome, confirmed) in enumerate(ends, start=5)
    ]
    state_feed.goals = msgspec.json.encode({"active": active})
    post(goals=5)
    page.keyboard.press("g")
    rows = page.locator("#goals-active li")
    expect(rows).to_have_count(len(ends))
    offers = {
        name: rows.filter(has_text=name).get_by_role("button", name="Cancel").count()
        for name, _, _ in ends
    }
    assert offers == {"hat": 0, "plant": 1, "tv": 1, "cup": 0, "mug": 0}


@pytest.fixture
def german_page(window, stage, viser_server, state_feed, navigator, browsers, shell_alone, post):
    """The page in German, without a scene."""
    access, hosts = OpenAccess(browsers), Hosts("127.0.0.1")
    with pytest.MonkeyPatch.context() as patch:
        empty = ClientFiles(page=shell_alone.view._plain, files={}, links=b"")
        patch.setattr(assets, "unpack_client", lambda *_: empty)
        files = assets.Assets(Words("de"))
    served = stage.Served(Gateway(viser_server, state_feed, navigator, access, hosts, assets=files))
    page = window.new_page()
    page.goto(served.origin)
    expect_state(page, "Sucht")
    yield page
    served.close()


@pytest.mark.parametrize("is_watching", [False, True])
@pytest.mark.parametrize(
    ("width", "height", "name"),
    [
        (390, 844, "Laptop"),
        (970, 768, "Wasserkocher"),
        (1024, 768, "Waschmaschine"),
        (970, 768, "Geschirrspülmaschine"),
        (1024, 768, "rote Thermoskanne von Anna"),
        (1440, 900, "rote Thermoskanne von Anna"),
    ],
)
def test_the_german_header_of_a_small_window_shows_what_is_searched_for(
    german_page, post, width, height, name, is_watching
):
    page = german_page
    page.set_viewport_size({"width": width, "height": height})
    lease = LeaseStatus(state="held", holder="Browser 12", epoch=3) if is_watching else None
    words = Words("de")
    states = ["looking_around", "perhaps", "exhausted", "approaching", "confirmed"]
    for state in states if is_watching else [*states, "stopped"]:
        searching = msgspec.structs.replace(SEARCHING, state=state, object=name)
        post(searching, elapsed_s=754.0, why="fährt zum Blickpunkt", lease=lease or LeaseStatus())
        expect_state(page, words(f"state.{state}"))
        goal = page.locator("#goal")
        whole = "(e) => e.scrollWidth <= e.clientWidth && e.scrollHeight <= e.clientHeight"
        assert goal.evaluate(whole), f"{state}: it is cut"
        # On a phone the goal is below the state.
        parts = ("#goal", "#stop") if width < 520 else ("#state", "#goal", ".actions")
        boxes = [page.locator(part).bounding_box() for part in parts]
        for left, right in itertools.pairwise(boxes):
            assert left["x"] + left["width"] <= right["x"], state
        assert boxes[-1]["x"] + boxes[-1]["width"] <= width
