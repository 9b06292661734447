"""The operator's eyes in a real browser: camera, plan and list of things.

One console serves all tests. Every picture can be kept and looked at: set IPPON_KEEP_PICTURES to a
folder.
"""

import os
import re
import time
from pathlib import Path

import msgspec
import numpy as np
import pytest
from playwright.sync_api import expect

from app.messages import keys
from app.messages.control import (
    FeedbackRequest,
    QueueRequest,
    SavedSearchRequest,
    SearchRequest,
    decode,
    encode,
)
from app.messages.driving import DriveStatus, GotoRequest, PaintRequest, WalkStatus
from app.messages.memory import MemoryNoteRequest
from app.messages.perception.heatmaps import encode_heatmap
from app.messages.status import CountedFind, FindReport, GoalStatus
from ippon.observation import Heatmap
from tests.app.nodes.console.opened_page import WHOLE_MAP_TICKS, wait_until
from tests.chromium import KEEP_PICTURES, box_at_rest, boxes_at_rest, new_window
from tests.machine_lateness import MachineLateness

pytestmark = pytest.mark.browser

HZ = 10.0
"""Rate of the images where they are counted; elsewhere fewer do."""
WATCHED_S = 6.0 if KEEP_PICTURES in os.environ else 3.0


class _Home:
    """A navigator with a heatmap of the drawn camera picture, and the times of its images."""

    def __init__(self, home):
        self.home = home
        self.sent_ms = {}
        put = home.put

        def put_and_note(key, payload):
            if key == keys.COLOR:
                put(keys.HEATMAP, self._heatmap())
                self.sent_ms[str(home.stamp_ns)] = 1e3 * time.time()
            put(key, payload)

        home.put = put_and_note

    def wait_for_request(self, page, before, wanted):
        """Wait until a request has arrived after the first `before` ones."""
        wait_until(page, lambda: self.home.requests[before:], wanted)

    def _heatmap(self):
        """The hat, as the network would see it in the drawn picture of 400 by 250 pixels."""
        probabilities = np.zeros((25, 40, 3), np.uint8)
        probabilities[:, :, 0] = 255
        probabilities[10:19, 9:33] = (0, 255, 0)
        probabilities[10:15, 16:23] = (0, 15, 240)
        heatmap = Heatmap(labels=("wall", "sofa"), ooi="hat", probabilities=probabilities)
        return encode_heatmap(heatmap, self.home.stamp_ns, "camera_color_optical_frame")


@pytest.fixture(scope="module")
def parts(stage, browser):
    zenoh_port, port = stage.free_port(), stage.free_port()
    home = stage.PublishedHome(zenoh_port, most_voxels=12_000, moving_ticks=WHOLE_MAP_TICKS)
    noted = _Home(home)
    console = stage.ConsoleProcess(zenoh_port, port)
    window = new_window(browser)
    console.wait_until_up()
    yield noted, console, window
    window.close()
    console.close()
    home.close()


@pytest.fixture(scope="module")
def page(parts):
    _, console, window = parts
    page = window.new_page()
    page.goto(console.url)
    expect(page.locator("#veil")).to_be_hidden()
    expect(page.locator("#state")).to_have_text("Searching")
    return page


@pytest.fixture
def shoot(page):
    """Takes a picture where they are kept; no assertion needs one."""

    def take(name, drawn_ms=0):
        folder = os.environ.get(KEEP_PICTURES)
        if folder is not None:
            Path(folder).mkdir(parents=True, exist_ok=True)
            page.wait_for_timeout(drawn_ms)
            page.screenshot(path=Path(folder) / f"{name}.png")

    return take


def _tab(page, name):
    page.frame_locator("#view").get_by_role("tab", name=name).click()


def test_the_camera_is_on_every_tab_and_one_key_enlarges_it(page, shoot):
    camera = page.locator("#camera")
    expect(camera).to_have_attribute("data-state", "live")
    for tab in ("Search", "Drive", "Map", "Session"):
        _tab(page, tab)
        expect(camera).to_have_attribute("data-size", "corner")
        expect(page.locator("#camera-picture")).to_be_in_viewport()
    shoot("camera-corner", 1_500)
    page.keyboard.press("c")
    expect(camera).to_have_attribute("data-size", "full")
    box, panel = boxes_at_rest(camera, _panel(page))
    assert box["x"] + box["width"] <= panel["x"] + 1, "the panel stays free"
    assert box["width"] > 0.6 * page.viewport_size["width"]
    shoot("camera-full", 1_500)
    page.keyboard.press("p")
    plan = page.locator("#plan")
    expect(plan).to_have_attribute("data-size", "full")
    for size in ("full", "corner"):
        page.keyboard.press("Escape")
        expect(plan).not_to_have_attribute("data-size", "full")
        expect(camera).to_have_attribute("data-size", size)
    page.locator("#camera-size").click()
    expect(camera).to_have_attribute("data-size", "full")
    page.locator("#camera-size").click()
    expect(camera).to_have_attribute("data-size", "corner")
    page.keyboard.press("Shift+C")
    expect(camera).to_be_hidden()
    page.locator("#camera-open").press("Enter")
    expect(camera).to_have_attribute("data-size", "corner")


def _panel(page):
    return page.frame_locator("#view").locator("[data-dock-region='right']")


def test_what_is_drawn_in_can_be_chosen(page):
    chosen = page.locator("#camera-label")
    page.keyboard.press("c")
    expect(chosen).to_have_attribute("title", "Drawn in: what the network takes for hat")
    chosen.select_option("sofa")
    expect(chosen).to_have_attribute("title", "Drawn in: what the network takes for sofa")
    chosen.select_option("Object of interest")
    page.locator("#camera-picture").click()


def test_a_person_who_drives_gets_the_large_camera_and_the_limits(page, parts, shoot):
    noted = parts[0]
    drive = DriveStatus(mode="manual", body_half_width_m=0.25, stop_within_m=1.3, slow_within_m=1.9)
    noted.home.state = "manual"
    noted.home.status_changes = {"drive": drive}
    camera = page.locator("#camera")
    expect(camera).to_have_attribute("data-size", "full")
    expect(page.locator("#pad")).to_be_visible()
    shoot("camera-manual", 1_500)
    noted.home.begin_again()
    expect(camera).to_have_attribute("data-size", "corner")


_DRAWN = "(camera) => ['stamp', 'drawnAt', 'bytes'].map((name) => camera.dataset[name])"
"""All of one picture."""


def test_pictures_come_within_the_budget_and_soon(page, parts):
    """Image to glass: from before the image is published until the page's worker has drawn it.

    Both are the clock of this machine. The figures are for docs/results.md; here they must only be
    possible, because the machine may be busy: the time that it is late is left out.
    """
    noted = parts[0]
    camera = page.locator("#camera")
    drawn_ms, sizes = {}, []
    noted.home.hz, usual_hz = HZ, noted.home.hz
    began = time.monotonic()
    with MachineLateness(time.time) as lateness:
        while (took_s := time.monotonic() - began) < WATCHED_S or (
            len(drawn_ms) < 7 and took_s < 60.0
        ):
            stamp, at, size = camera.evaluate(_DRAWN)
            if stamp in noted.sent_ms and stamp not in drawn_ms:
                drawn_ms[stamp] = float(at)
                sizes.append(int(size))
            page.wait_for_timeout(20)
    noted.home.hz = usual_hz
    ordered = sorted(at - noted.sent_ms[stamp] for stamp, at in drawn_ms.items())
    net_s = sorted(
        lateness.net_s(noted.sent_ms[stamp] / 1e3, at / 1e3) for stamp, at in drawn_ms.items()
    )
    folder = os.environ.get(KEEP_PICTURES)
    if folder is not None:
        ms = [round(d) for d in ordered]
        text = f"{len(ordered)} pictures in {WATCHED_S:.0f} s, ms: {ms}, bytes {sizes}\n"
        (Path(folder) / "image_to_glass_ms.txt").write_text(text)
    assert len(ordered) > 6
    assert ordered[0] >= 0.0
    assert net_s[len(net_s) // 2] < 0.5, ordered
    assert sum(sizes) * 8 / took_s < 2e6


def test_a_frozen_camera_is_marked(page, parts, shoot):
    noted = parts[0]
    noted.home.frozen = True
    camera = page.locator("#camera")
    expect(camera).to_have_attribute("data-state", "lost")
    expect(page.locator("#camera-age")).to_contain_text("s old")
    shoot("camera-frozen", 500)
    noted.home.frozen = False
    expect(camera).to_have_attribute("data-state", "live")


def test_the_map_is_coloured_by_kind_with_a_legend(page, shoot):
    _tab(page, "Map")
    inside = page.frame_locator("#view")
    inside.get_by_role("button", name="Thing", exact=True).click()
    legend = inside.locator("[data-mode='thing']")
    expect(legend).to_contain_text("Most probable kind of thing")
    expect(legend).to_contain_text("sofa")
    shoot("map-kinds", 2_500)
    inside.get_by_role("button", name="Camera", exact=True).click()


def test_one_key_shows_the_plan_with_rooms_furniture_and_scale(page, shoot):
    _tab(page, "Map")
    page.keyboard.press("p")
    plan = page.locator("#plan")
    expect(plan).to_have_attribute("data-size", "full")
    expect(page.get_by_role("button", name="Rename the room living room")).to_be_visible()
    expect(page.locator("#plan-none")).to_be_hidden()
    shoot("plan", 3_000)
    box, panel = boxes_at_rest(plan, _panel(page))
    assert box["x"] + box["width"] <= panel["x"] + 1, "the panel stays free"


def test_two_clicks_measure_and_so_does_the_keyboard(page, shoot):
    page.keyboard.press("m")
    expect(page.locator("#plan-answer")).to_contain_text("Click two points")
    box = box_at_rest(page.locator("#plan-picture"))
    middle = box["y"] + 0.3 * box["height"]
    page.mouse.click(box["x"] + 300, middle)
    page.mouse.click(box["x"] + 500, middle)
    metres = float(page.locator("#plan-answer").inner_text().removesuffix(" m"))
    across = page.locator("#plan-picture").evaluate("c => c.clientWidth")
    assert 1.0 < metres < 8.0, f"200 of {across} pixels of a plan that is about 10 m wide"
    shoot("plan-measured")
    page.keyboard.press("Enter")
    expect(page.locator("#plan-answer")).to_have_text("Now the second point.")
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    expect(page.locator("#plan-answer")).to_contain_text(" m")
    page.keyboard.press("Escape")
    expect(page.locator("#plan-measure")).to_have_attribute("aria-pressed", "false")


def _choose_click(inside, name, answer):
    """Choose what a click does; the console has it once it answers."""
    inside.get_by_role("button", name=name, exact=True).click()
    expect(inside.get_by_text(answer)).to_be_visible()


def test_a_click_on_the_plan_sends_the_robot_there_or_paints(page, parts, shoot):
    noted, inside = parts[0], page.frame_locator("#view")
    box = box_at_rest(page.locator("#plan-picture"))
    at = (box["x"] + 400, box["y"] + 0.5 * box["height"])
    # An attempt before this one may have chosen something else.
    _tab(page, "Drive")
    _choose_click(inside, "Explain", "Click a viewpoint or a surface")
    before = len(noted.home.requests)
    page.mouse.click(*at)
    expect(page.locator("#plan-answer")).to_contain_text("In the Drive tab choose")
    _tab(page, "Drive")
    _choose_click(inside, "Go", "Click the floor or the plan: the robot drives there")
    page.mouse.click(*at)
    expect(page.locator("#plan-answer")).to_have_text("Done.")
    sent = [decode(payload, GotoRequest) for key, payload in noted.home.requests[before:]
            if key == keys.GOTO]  # fmt: skip
    shoot("plan-go", 500)
    _choose_click(inside, "Not here", "Click the floor or the plan where not to search")
    page.mouse.click(at[0] + 100, at[1])
    wait_until(page, lambda: [key for key, _ in noted.home.requests[before:]], keys.PAINT)
    (painted,) = [decode(payload, PaintRequest) for key, payload in noted.home.requests[before:]
                  if key == keys.PAINT]  # fmt: skip
    (goto,), ((x_m, y_m),) = sent, painted.strokes
    assert painted.action == "not_here"
    assert y_m == pytest.approx(goto.y_m)
    assert 0.5 < x_m - goto.x_m < 4.0, "100 pixels of a plan that is about 10 m wide"
    _choose_click(inside, "Explain", "Click a viewpoint or a surface")
    _tab(page, "Map")


_MIDDLE = """() => {
    const canvas = document.getElementById("plan-picture");
    const at = [Math.round(canvas.width / 2), Math.round(canvas.height / 2)];
    return [...canvas.getContext("2d").getImageData(...at, 1, 1).data].slice(0, 3);
}"""
"""Colour in the middle of the plan."""
_CROSS = [194, 24, 91]


def test_enter_clicks_at_the_cross_of_the_plan(page, parts, shoot):
    noted, inside = parts[0], page.frame_locator("#view")

    def points():
        payloads = [payload for key, payload in noted.home.requests if key == keys.GOTO]
        return [(one.x_m, one.y_m) for one in (decode(one, GotoRequest) for one in payloads)]

    before = len(points())
    page.keyboard.press("0")
    _tab(page, "Drive")
    _choose_click(inside, "Go", "Click the floor or the plan: the robot drives there")
    box = box_at_rest(page.locator("#plan-picture"))
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    expect(page.locator("#plan-answer")).to_have_text("Done.")
    assert page.evaluate(_MIDDLE) != _CROSS, "a hand on the mouse needs no cross"
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowUp")
    assert page.evaluate(_MIDDLE) == _CROSS
    shoot("plan-keys")
    page.keyboard.press("Enter")
    wait_until(page, lambda: [len(points()) - before], 2)
    (x0, y0), (x1, y1) = points()[before:]
    assert x1 - x0 > 0.1
    assert y1 - y0 == pytest.approx(x1 - x0, rel=0.1), "one step to the right, and one up"
    page.locator("#plan-fit").focus()
    page.keyboard.press("Enter")
    page.wait_for_timeout(300)
    assert len(points()) - before == 2, "Enter on a button presses the button"
    _choose_click(inside, "Explain", "Click a viewpoint or a surface")
    _tab(page, "Map")


def test_a_room_is_renamed_by_clicking_it_and_markup_stays_text(page, parts):
    noted = parts[0]
    room = page.get_by_role("button", name="Rename the room living room")
    room.press("Enter")
    expect(page.locator("#room")).to_be_visible()
    page.locator("#room-name").fill("<b>Anna's</b> room")
    page.locator("#room-name").press("Enter")
    expect(page.locator("#plan-answer")).to_have_text("The room is named.")
    expect(page.locator("#plan-rooms button").first).to_have_text("<b>Anna's</b> room")
    assert keys.ROOM_NAME in [key for key, _ in noted.home.requests]
    page.locator("#plan-rooms button").first.click()
    page.locator("#room-cancel").click()
    expect(page.locator("#room")).to_be_hidden()


def test_the_plan_is_exported_in_four_formats(page, parts):
    console = parts[1]
    starts = {"png": b"\x89PNG", "svg": b"<svg ", "pgm": b"P5\n", "yaml": b"image: ippon-plan.pgm"}
    page.locator("#plan-export summary").click()
    for ending, start in starts.items():
        link = page.locator(f"#plan-export a[href$='plan.{ending}']")
        with page.expect_download() as download:
            link.click()
        assert download.value.suggested_filename == f"ippon-plan.{ending}"
        assert Path(download.value.path()).read_bytes().startswith(start)
    page.locator("#plan-export summary").click()
    folder = os.environ.get(KEEP_PICTURES)
    if folder is not None:
        for ending in starts:
            answer = page.request.get(f"{console.url}/api/export/plan.{ending}")
            (Path(folder) / f"exported.{ending}").write_bytes(answer.body())


def test_what_is_remembered_is_found_shown_and_searched_for(page, parts, shoot):
    noted = parts[0]
    page.keyboard.press("t")
    page.locator("#things-find").fill("")
    rows = page.locator("#things-list li:visible")
    expect(rows).to_have_count(5)
    expect(page.locator("#things-count")).to_have_text("5 things")
    page.locator("#things-find").fill("bedroom counter")
    expect(rows).to_have_count(1)
    expect(page.locator("#things-count")).to_have_text("1 of 5 things")
    expect(rows).to_contain_text("kitchen counter 90 %bedroom · seen just now")
    expect(rows).to_contain_text("or armchair 5 %")
    rows.get_by_title("Show where it is").press("Enter")
    expect(rows).to_have_class("chosen")
    shoot("things", 1_000)
    page.get_by_role("button", name="Search for this kitchen counter").click()
    expect(page.locator("#things-count")).to_contain_text("Looking for: kitchen counter")
    searches = [payload for key, payload in noted.home.requests if key == keys.SEARCH]
    assert decode(searches[-1], SearchRequest).object == "kitchen counter"
    page.locator("#things-find").fill("")
    shoot("things-all", 1_000)
    page.locator("#things-find").press("Escape")
    expect(page.locator("#things")).to_be_hidden()


@pytest.mark.parametrize(
    ("key", "count", "path"),
    [("t", "#things-count", "**/api/things"), ("b", "#robots-count", "**/api/robots")],
)
def test_a_count_that_stays_the_same_is_not_read_again(page, key, count, path):
    page.keyboard.press(key)
    # The answer to a search stands there for a while, and an earlier count until the next comes.
    expect(page.locator(count)).to_have_text(re.compile(r"^\d+ (thing|robot)s?$"))
    for _ in range(2):
        with page.expect_response(path):
            pass
    page.locator(count).evaluate("(one) => { one.firstChild.stays = true; }")
    for _ in range(2):
        with page.expect_response(path):
            pass
    assert page.locator(count).evaluate("(one) => one.firstChild.stays")
    page.keyboard.press("Escape")


def test_a_thing_is_named_and_denied_by_a_person_and_markup_stays_text(page, parts, shoot):
    noted = parts[0]
    # The scene is in view, not the plan.
    if page.locator("#plan").is_visible():
        page.keyboard.press("p")
    expect(page.locator("#plan")).to_be_hidden()
    page.keyboard.press("t")
    page.locator("#things-find").fill("")
    things = page.locator("#things")
    table = things.locator("#things-list li", has_text="table")
    table.get_by_title("Show where it is").press("Enter")
    expect(page.locator("#explanation")).to_be_visible()
    expect(page.locator("#explanation-rows")).to_contain_text("height")
    things.get_by_role("button", name="Give table a name").press("Enter")
    page.keyboard.type("mug")
    page.keyboard.press("Enter")
    expect(page.locator("#things-count")).to_have_text("'mug' is a kind of things")
    page.get_by_label("Name of the thing; empty for none").fill("Opa's table")
    page.keyboard.press("Enter")
    row = things.locator("#things-list li", has_text="Opa's table")
    expect(row).to_contain_text("table 90 %")
    expect(page.locator("#things-count")).to_have_text("This table is Opa's table.")
    row.get_by_role("button", name="Opa's table is not a table").press("Enter")
    expect(row).to_contain_text("armchair 50 %")
    expect(row).to_contain_text("not a table")
    expect(page.locator("#things-count")).to_contain_text("no search will take it for one")
    shoot("things-named", 2_500)
    requests = [decode(sent, MemoryNoteRequest) for key, sent in noted.home.requests
                if key == keys.MEMORY_NOTE]  # fmt: skip
    assert requests[-1] == MemoryNoteRequest(instance_id=2, deny="table")
    row.get_by_role("button", name="Opa's table may be a table").press("Enter")
    expect(row).to_contain_text("table 90 %")
    row.get_by_role("button", name="Give Opa's table a name").press("Enter")
    page.keyboard.press("Enter")
    # The name is as it was, and the field is gone.
    expect(page.get_by_label("Name of the thing; empty for none")).to_have_count(0)
    row.get_by_role("button", name="Give Opa's table a name").press("Enter")
    page.keyboard.type("<b>Anna's</b> table")
    page.keyboard.press("Enter")
    row = things.locator("#things-list li", has_text="<b>Anna's</b> table")
    row.get_by_role("button", name="Search for this <b>Anna's</b> table").press("Enter")
    expect(page.locator("#things-count")).to_contain_text("Looking for: <b>Anna's</b> table")
    page.set_viewport_size({"width": 390, "height": 844})
    for one in things.get_by_role("button").all():
        box = one.bounding_box()
        assert box is None or (box["x"] >= 0 and box["x"] + box["width"] <= 390)
    shoot("phone-things", 800)
    page.set_viewport_size({"width": 1440, "height": 900})
    page.locator("#things-find").press("Escape")
    expect(things).to_be_hidden()
    # What is said of one object of interest is not said of the next.
    noted.home.goal = msgspec.structs.replace(noted.home.goal, goal_id=noted.home.goal.goal_id + 1)
    expect(page.locator("#explanation")).to_be_hidden()
    noted.home.begin_again()


def test_two_thousand_things_stay_smooth(page, parts):
    """Times to open, filter and scroll; the figures are for docs/results.md."""
    noted = parts[0]
    one = noted.home.things[0]
    kinds = ["mug", "chair", "book", "kitchen_counter", "plant"]
    noted.home.things = [
        msgspec.structs.replace(
            one, instance_id=n, label=kinds[n % 5], position_world=(n % 8 + 0.5, 1.0, 0.4)
        )
        for n in range(1, 2_001)
    ]
    took = page.evaluate(
        """async (watched) => {
          const count = document.getElementById("things-count");
          const find = document.getElementById("things-find");
          const list = document.getElementById("things-list");
          const frame = () => new Promise((go) => requestAnimationFrame(go));
          const drawn = async () => { await frame(); await frame(); };
          const until = async (text) => {
            while (count.textContent !== text) await frame();
            await drawn();
          };
          const time = async (act) => {
            const began = performance.now();
            await act();
            return Math.round(performance.now() - began);
          };
          const took = {};
          find.value = "";
          took.open = await time(async () => {
            document.querySelector("[data-opens='things']").click();
            await until("2000 things");
          });
          took.filter = await time(async () => {
            find.value = "kitchen";
            find.dispatchEvent(new Event("input"));
            await until("400 of 2000 things");
          });
          took.unfilter = await time(async () => {
            find.value = "";
            find.dispatchEvent(new Event("input"));
            await until("2000 things");
          });
          const frames = [];
          let last = await frame();
          for (let n = 1; n <= watched; n += 1) {
            list.scrollTop = n * list.scrollHeight / watched;
            const now = await frame();
            frames.push(Math.round(now - last));
            last = now;
          }
          took.frames = frames.sort((x, y) => x - y);
          const idle = [];
          last = await frame();
          for (let n = 1; n <= watched; n += 1) {
            const now = await frame();
            idle.push(Math.round(now - last));
            last = now;
          }
          took.idleFrames = idle.sort((x, y) => x - y);
          while (list.childElementCount < 2000) {
            list.scrollTop = list.scrollHeight;
            await frame();
          }
          list.lastElementChild.querySelector(".thing").click();
          took.chosen = list.lastElementChild.classList.contains("chosen");
          return took;
        }""",
        40 if KEEP_PICTURES in os.environ else 4,
    )
    folder = os.environ.get(KEEP_PICTURES)
    if folder is not None:
        (Path(folder) / "two_thousand_things_ms.txt").write_text(f"{took}\n")
    assert took["chosen"]
    page.locator("#things-find").press("Escape")
    noted.home.begin_again()


def test_the_name_of_a_kind_is_beside_the_pointer(page, shoot):
    _tab(page, "Map")
    inside = page.frame_locator("#view")
    inside.get_by_role("button", name="Show the whole map").click()
    inside.get_by_role("button", name="Thing", exact=True).click()
    expect(inside.locator("[data-mode='thing']")).to_contain_text("sofa")
    label, names = page.locator("#hover"), set()
    # Several times over: the whole map comes into view in its own time.
    for k in [*range(24)] * 3:
        page.mouse.move(330 + 90 * (k % 6), 300 + 90 * (k // 6))
        page.wait_for_timeout(400)
        if label.is_visible():
            names.add(label.inner_text())
            if names & {"sofa", "bed", "table"}:
                break
    assert names <= {"wall", "floor", "sofa", "table", "bed", "plant"}
    assert names & {"sofa", "bed", "table"}
    shoot("hover")
    inside.get_by_role("button", name="Camera", exact=True).click()
    page.mouse.move(500, 400)
    page.wait_for_timeout(600)
    expect(label).to_be_hidden()


def test_driving_keys_leave_the_view_and_one_key_shows_the_whole_map(page):
    """viser's client moves its camera as long as W is held, with the map soon out of sight."""
    page.evaluate(
        """() => {
          window.sent = [];
          const send = WebSocket.prototype.send;
          WebSocket.prototype.send = function (data) {
            window.sent.push(data);
            send.call(this, data);
          };
        }"""
    )
    inside = page.frame_locator("#view")
    heard = """() => {
      const seen = (document.heard = []);
      document.addEventListener("keydown", (event) => seen.push(event.code));
    }"""
    inside.locator("body").evaluate(heard)
    page.locator("#view").focus()
    for key in ("w", "a", "s", "d", "q", "e", "ArrowUp", "h"):
        page.keyboard.press(key)
    assert inside.locator("body").evaluate("() => document.heard") == ["ArrowUp"]
    page.locator("#home").click()
    page.wait_for_function(
        """() => window.sent.filter((data) => data === '{"type":"frame"}').length === 2"""
    )


def test_goals_are_ordered_edited_repeated_and_saved_by_keyboard(page, parts, shoot):
    noted = parts[0]
    tour = {"tour": 6, "outcome": "queued"}
    waiting = [
        GoalStatus(goal_id=5, object="plant", context="near the window"),
        GoalStatus(goal_id=6, object="tv", **tour),
        GoalStatus(goal_id=7, object="remote", display="<b>remote</b>", **tour),
    ]
    ended = [
        GoalStatus(goal_id=3, object="shoe", outcome="cancelled"),
        GoalStatus(goal_id=4, object="keys", outcome="found", confirmed=True, took_s=133.2,
                   position_world=(5.5, 0.6, 0.4)),
        GoalStatus(goal_id=2, object="cup", outcome="exhausted", rejected=2, took_s=412.0,
                   count=3, counted=[CountedFind(number=3, position_world=(1.0, 2.0, 0.5))]),
    ]  # fmt: skip
    noted.home.status_changes = {"queue": waiting, "history": ended}
    goals = page.locator("#goals")
    if not goals.is_visible():
        page.keyboard.press("g")
    expect(
        page.locator(".scene-tools .goals-waiting, .plan-tools .goals-waiting").first
    ).to_have_text("3")
    expect(goals.locator("#goals-active li")).to_contain_text("is searched for")
    # The list of an attempt before this one may still be shown.
    expect(goals.locator("#goals-waiting li").first).to_contain_text("near the window")
    expect(goals.locator("#goals-waiting li").nth(2)).to_contain_text("<b>remote</b>")
    expect(goals.locator("#goals-ended li").first).to_contain_text(
        "not found · 1 of 3 found · 2 finds rejected · 6:52"
    )
    expect(goals.locator("#goals-ended li").nth(1)).to_contain_text("found, confirmed · 2:13")
    shoot("goals", 500)
    for name, key, request in (
        ("Move plant down", keys.QUEUE, QueueRequest(goal_id=6, action="before", before=5)),
        ("Move <b>remote</b> up", keys.QUEUE, QueueRequest(goal_id=7, action="before", before=5)),
        ("Cancel the goal tv", keys.QUEUE, QueueRequest(goal_id=6, action="remove")),
        ("Search for keys again", keys.QUEUE, QueueRequest(goal_id=4, action="repeat")),
        ("Save the search for plant", keys.SEARCHES,
         SavedSearchRequest(
             action="save", object="plant", context="near the window", goal_id=5)),
        ("Search for my keys", keys.SEARCHES, SavedSearchRequest(action="run", saved_id=4)),
        ("Delete the saved search for my keys", keys.SEARCHES,
         SavedSearchRequest(action="delete", saved_id=4)),
    ):  # fmt: skip
        before = len(noted.home.requests)
        goals.get_by_role("button", name=name, exact=True).press("Enter")
        noted.wait_for_request(page, before, (key, encode(request)))
        expect(page.locator("#goals-answer")).to_have_text("Done.")
    goals.get_by_role("button", name="Edit the goal plant").press("Enter")
    page.keyboard.type("cactus")
    waiting[0] = GoalStatus(goal_id=5, object="plant", context="changed by somebody else")
    page.wait_for_timeout(500)
    before = len(noted.home.requests)
    page.keyboard.press("Enter")
    edited = QueueRequest(goal_id=5, action="edit", object="cactus", context="near the window")
    noted.wait_for_request(page, before, (keys.QUEUE, encode(edited)))
    expect(goals.locator("form")).to_have_count(0)
    expect(goals.locator("#goals-waiting li").first).to_contain_text("changed by somebody else")
    goals.get_by_role("button", name="Edit the goal plant").press("Enter")
    page.keyboard.type("mug")
    noted.home.status_changes = {"queue": waiting[1:], "history": ended}
    expect(page.locator(".scene-tools .goals-waiting").first).to_have_text("2")
    page.keyboard.type(" on")
    expect(goals.locator("form input").first).to_have_value("mug on")
    page.keyboard.press("Escape")
    expect(goals.locator("form")).to_have_count(0)
    expect(goals.locator("#goals-waiting li")).to_have_count(2)
    page.set_viewport_size({"width": 390, "height": 844})
    for one in goals.get_by_role("button").all():
        box = one.bounding_box()
        assert box is None or (box["x"] >= 0 and box["x"] + box["width"] <= 390)
    shoot("phone-goals", 800)
    page.set_viewport_size({"width": 1440, "height": 900})
    goals.locator("#goals-close").press("Escape")
    expect(goals).to_be_hidden()
    noted.home.begin_again()


def test_each_of_several_finds_is_confirmed_or_rejected_by_itself(page, parts, shoot):
    noted = parts[0]
    counted = [
        CountedFind(number=1, position_world=(4.1, 1.2, 0.4)),
        CountedFind(number=2, position_world=(1.3, 3.4, 0.4)),
    ]
    noted.home.goal = GoalStatus(
        goal_id=7, object="chair", display="chairs", outcome="active", count=3, counted=counted
    )
    view = page.frame_locator("#view")
    _tab(page, "Search")
    expect(view.get_by_text("Found so far:")).to_be_visible()
    rows = view.get_by_text(", z = ", exact=False)
    expect(rows).to_have_count(2)
    expect(rows.first).to_have_text("chair 2 at (1.3, 3.4) m, z = 0.4 m")
    shoot("counted-finds", 1_000)
    for number, button, verdict in ((2, "Confirm", "confirm"), (1, "Not this", "reject")):
        before = len(noted.home.requests)
        # The latest is on top.
        view.get_by_role("button", name=button, exact=True).nth(2 - number).click()
        request = FeedbackRequest(verdict=verdict, goal_id=7, find=number)
        noted.wait_for_request(page, before, (keys.FEEDBACK, encode(request)))
    confirmed = msgspec.structs.replace(counted[1], confirmed=True)
    noted.home.goal = msgspec.structs.replace(noted.home.goal, counted=[confirmed], rejected=1)
    expect(view.get_by_text("Confirmed: chair 2")).to_be_visible()
    expect(rows).to_have_count(0)
    shoot("counted-finds-judged", 1_000)
    noted.home.begin_again()
    expect(view.get_by_text("Found so far:")).to_be_hidden()


def test_a_person_is_called_and_each_kind_can_be_muted(page, parts, shoot):
    noted = parts[0]
    page.evaluate("localStorage.removeItem('ippon-muted')")
    rang = int(page.locator("body").get_attribute("data-rang") or 0)
    calls = page.locator("#calls")
    if not calls.is_visible():
        page.keyboard.press("n")
    expect(calls).to_contain_text("start the console with --notify URL")
    sound = calls.get_by_role("switch", name="Sound: Perhaps found")
    sound.press("Enter")
    expect(sound).not_to_be_checked()
    find = FindReport(
        goal_id=1, object="hat", position_world=(1.6, 5.4, 0.8), size_m=(0.3, 0.3, 0.2),
        probability=0.9, voxels=20, perhaps=True,
    )  # fmt: skip
    noted.home.goal = GoalStatus(goal_id=1, object="hat", display="<i>hat</i>", outcome="found")
    noted.home.find, noted.home.state = find, "found"
    expect(calls.locator("#calls-list li").first).to_contain_text("Perhaps found")
    noted.home.find = msgspec.structs.replace(find, perhaps=False)
    expect(calls.locator("#calls-list li").first).to_contain_text("<i>hat</i>: confirm or reject")
    expect(page.locator("body")).to_have_attribute("data-rang", str(rang + 1))
    shoot("calls", 500)
    page.set_viewport_size({"width": 390, "height": 844})
    shoot("phone-calls", 800)
    # There the list would cover the scene that flies to the place.
    calls.locator("#calls-list .acts button").first.click()
    expect(calls).to_be_hidden()
    page.set_viewport_size({"width": 1440, "height": 900})
    page.keyboard.press("n")
    expect(calls).to_be_visible()
    page.keyboard.press("Escape")
    expect(calls).to_be_hidden()
    noted.home.begin_again()


def test_who_carries_the_camera_is_led_by_an_arrow_and_metres(page, parts, shoot):
    home = parts[0].home
    card, do, then = (page.locator(f"#walk{part}") for part in ("", "-do", "-then"))
    expect(card).to_be_hidden()

    def show(step, **values):
        walk = {"turn_deg": 0.0, "walk_m": 0.0, "way_m": 0.0, "look_up_deg": 0.0} | values
        home.status_changes = {"walk": WalkStatus(step=step, **walk)}

    show("turn", turn_deg=62.0, walk_m=1.2, way_m=3.6)
    expect(do).to_have_text("Turn left 60°")
    expect(then).to_have_text("then walk 1.2 m")
    show("turn", turn_deg=-170.0)
    expect(do).to_have_text("Turn around")
    show("look", look_up_deg=14.0)
    expect(do).to_have_text("Look up 15°")
    show("hold")
    expect(do).to_have_text("Hold still")
    expect(page.locator("#walk-arrow")).to_be_hidden()
    show("walk", turn_deg=-10.0, walk_m=2.4, way_m=5.0, look_up_deg=-20.0)
    expect(do).to_have_text("Walk 2.4 m")
    expect(then).to_have_text("then 2.6 m more, look down 20°")
    shoot("walk", 500)
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_timeout(1_000)
    shoot("phone-walk", 800)
    box, words = boxes_at_rest(card, do)
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= 390
    assert words["height"] >= 32, "readable at arm's length"
    assert words["x"] + words["width"] <= box["x"] + box["width"]
    page.set_viewport_size({"width": 1440, "height": 900})
    home.begin_again()
    expect(card).to_be_hidden()


def test_the_map_is_in_the_corner_while_the_camera_fills_the_scene(page, shoot):
    if page.locator("#plan").is_visible():
        page.keyboard.press("p")
    expect(page.locator("#plan")).to_be_hidden()
    page.keyboard.press("c")
    expect(page.locator("#plan")).to_have_attribute("data-size", "corner")
    shoot("camera-full-with-plan", 3_000)
    page.keyboard.press("c")
    expect(page.locator("#plan")).to_be_hidden()


def test_camera_and_plan_fit_a_phone(page, shoot):
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_timeout(1_500)
    shoot("phone-corner", 1_500)
    assert box_at_rest(page.locator("#camera"))["y"] < 200, "above the panel"
    for opened, key in (("plan", "p"), ("camera", "c")):
        page.keyboard.press(key)
        expect(page.locator(f"#{opened}")).to_have_attribute("data-size", "full")
        box = box_at_rest(page.locator(f"#{opened}"))
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390
        for name in page.locator(f"#{opened} button:visible").all():
            shown = name.bounding_box()
            assert shown["x"] + shown["width"] <= 391, "every button is on the screen"
        shoot(f"phone-{opened}", 1_500)
        page.keyboard.press(key)
    page.set_viewport_size({"width": 1440, "height": 900})
