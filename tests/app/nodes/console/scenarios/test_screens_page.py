"""The page on every screen and for everybody: German, sizes, keyboard, names, contrast, motion.

Every picture can be kept and looked at: set IPPON_KEEP_PICTURES to a folder.
"""

import functools
import json
import os
import time
from pathlib import Path

import msgspec
import pytest
from playwright.sync_api import expect

from app.messages import keys
from app.messages.control import encode
from app.messages.driving import DriveStatus, WalkStatus
from app.messages.status import Event
from tests.app.nodes.console.opened_page import WHOLE_MAP_TICKS
from tests.app.nodes.console.page_checks import (
    CUT_OFF,
    LOW_CONTRAST,
    UNNAMED,
    in_page,
    in_panels,
)
from tests.chromium import KEEP_PICTURES, PATIENCE_MS, box_at_rest, boxes_at_rest, new_window

pytestmark = pytest.mark.browser

TABS = ("Suche", "Fahren", "Karte", "Sitzung")
SIDES = ("goals", "things", "calls", "robots")
WORDS = Path(__file__).parents[5] / "web_assets/words"
SETTLED_S = 20.0
"""What is wrong for longer stays wrong; an idle machine has all in place after half a second."""


@pytest.fixture(scope="module")
def parts(stage, browser):
    """The page of a console in German, and what it shows."""
    zenoh_port = stage.free_port()
    home = stage.PublishedHome(zenoh_port, most_voxels=2_000, moving_ticks=WHOLE_MAP_TICKS)
    console = stage.ConsoleProcess(zenoh_port, stage.free_port(), language="de")
    window = new_window(browser)
    console.wait_until_up()
    page = window.new_page()
    page.goto(console.url)
    expect(page.locator("#state")).to_have_text("Sucht")
    expect(_tab(page, "Suche")).to_be_visible()
    yield page, home
    window.close()
    console.close()
    home.close()


@pytest.fixture
def at_first(parts):
    """The page in its usual size, with nothing open, of a robot that searches."""
    page, home = parts
    home.begin_again()
    page.set_viewport_size({"width": 1440, "height": 900})
    # What the test before showed as another operator's is the robot's again.
    expect(page.locator("#lease-take")).to_be_visible()
    box_at_rest(page.frame_locator("#view").locator("[data-dock-region='right']"))
    yield page
    page.evaluate("document.getElementById('help').close()")
    for name in SIDES:
        if page.locator(f"#{name}").is_visible():
            page.locator(f"#{name}-close").click()
    if page.locator("#plan").get_attribute("data-size") == "full":
        page.locator("#plan-close").click()
    _use_theme(page, "dark")


def _use_theme(page, theme):
    if page.locator("html").get_attribute("data-theme") != theme:
        page.locator("#theme").click()
    expect(page.locator("html")).to_have_attribute("data-theme", theme)


def _tab(page, name):
    return page.frame_locator("#view").get_by_role("tab", name=name, exact=True)


def _open(page, name):
    """Open a panel over the scene, the plan or the help, and wait until it has its content."""
    opener = (
        "#help-open" if name == "help" else f".scene-tools :is(#{name}-open, [data-opens={name}])"
    )
    page.locator(opener).click()
    expect(page.locator(f"#{name}")).to_be_visible()
    if name in ("things", "goals", "robots"):
        expect(page.locator(f"#{name} li").first).to_be_visible()


def _views(page):
    """Open everything in turn; yields the name of each view."""
    for name in TABS:
        _tab(page, name).click()
        expect(_tab(page, name)).to_have_attribute("aria-selected", "true")
        yield name
    for name in (*SIDES, "plan", "help"):
        _open(page, name)
        yield name
        page.keyboard.press("Escape")
        expect(page.locator(f"#{name}")).to_be_hidden()


AT_REST = """async (doc) => {
  const view = doc.defaultView;
  for (let n = 0; n < 2; n++) await new Promise((go) => view.requestAnimationFrame(go));
  const moves = doc.getAnimations().filter((one) => one instanceof view.CSSTransition);
  await Promise.all(moves.map((one) => one.finished.catch(() => null)));
}"""
"""Is over when nothing fades or moves any more."""


def _wrong(page, *looks):
    """Return what stays wrong with the page at rest: what is new has its name a moment later."""
    deadline = time.monotonic() + SETTLED_S
    while True:
        for part in in_page, in_panels:
            part(page, AT_REST)
        wrong = [found for look in looks for found in look()]
        if not wrong or time.monotonic() > deadline:
            return wrong
        page.wait_for_timeout(100)


def _resize(page, width, height):
    page.set_viewport_size({"width": width, "height": height})
    box_at_rest(page.frame_locator("#view").locator("[data-dock-region='right']"))


def _keep(page, name):
    folder = os.environ.get(KEEP_PICTURES)
    if folder:
        page.screenshot(path=Path(folder) / f"{name}.png")


SAID = """(doc) => [...doc.querySelectorAll("*")].filter((e) => e.checkVisibility())
.flatMap((e) => [
  ...[...e.childNodes].filter((n) => n.nodeType === 3).map((n) => n.data.trim()),
  e.title, e.getAttribute("aria-label"), e.placeholder,
]).filter((text) => typeof text === "string" && text !== "")"""


GOING = "fährt zum Blickpunkt bei „Sofa“ (sicher): Gewinn 41, 6,2 s Fahrt"
BLOCKED = "blockiert: merkt sich das Hindernis voraus und fährt zurück"


def _put_until_shown(home, event, shown):
    """Publish an event, again while it is not shown: a line that is full or broken loses it."""
    deadline = time.monotonic() + PATIENCE_MS / 1e3
    while not shown.is_visible():
        assert time.monotonic() < deadline, "the event is not shown"
        home.put(keys.EVENT, event)
        shown.page.wait_for_timeout(500)


def test_nothing_of_the_page_is_left_in_english(at_first, parts):
    _, home = parts
    contact = "blocked: marking what is ahead and backing off"
    event = encode(Event(stamp_ns=home.stamp_ns, kind="contact", text=contact))
    english, german = (json.loads((WORDS / f"{name}.json").read_text()) for name in ("en", "de"))
    _tab(at_first, "Suche").click()
    expect(at_first.frame_locator("#view").get_by_text(GOING)).to_be_visible()
    _tab(at_first, "Sitzung").click()
    _put_until_shown(home, event, at_first.frame_locator("#view").get_by_text(BLOCKED).first)
    both = set(german.values())
    others = {text for key, text in english.items() if text != german[key]} - both
    assert at_first.locator("html").get_attribute("lang") == "de"
    assert in_panels(at_first, "(doc) => doc.documentElement.lang") == "de"
    said = set()
    for name in _views(at_first):
        said |= {*in_page(at_first, SAID), *in_panels(at_first, SAID)}
        _keep(at_first, f"german-{name}")
    assert {"Leertaste", "Stufen für: Hut", "Woran der Roboter sich erinnert"} <= said
    # Said by the robot.
    assert {GOING, BLOCKED} <= said
    # Names of what it knows, too.
    assert said & others == set()


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (390, 844)])
def test_every_list_opens_from_the_plan(at_first, width, height):
    page = at_first
    _resize(page, width, height)
    _open(page, "plan")
    for name in SIDES:
        page.locator(f".plan-tools [data-opens={name}]").click()
        expect(page.locator(f"#{name}")).to_be_visible()
        _keep(page, f"{width}-plan-{name}")
        page.locator(f"#{name}-close").click()
    assert _wrong(page, lambda: in_page(page, CUT_OFF)) == []


@pytest.mark.parametrize(("width", "height"), [(390, 844), (720, 450), (1024, 768)])
def test_nothing_is_cut_off_on_a_small_screen_or_enlarged(at_first, width, height):
    _resize(at_first, width, height)
    assert _wrong(at_first, lambda: in_page(at_first, CUT_OFF)) == []
    for name in _views(at_first):
        part = in_panels if name in TABS else in_page
        # viser's tabs can be dragged: while a press on one ends, the panel takes no pointer.
        wrong = _wrong(at_first, functools.partial(part, at_first, CUT_OFF))
        _keep(at_first, f"{width}-{name}")
        assert wrong == [], name


SLOW = """() => {
  for (const e of document.querySelectorAll(".gauges dd, #latency")) e.classList.add("slow");
}"""
"""Shows every gauge as on a slow link, until its next figure comes."""


def test_theme_and_a_collapsed_panel_are_those_of_each_document_of_the_scene(at_first):
    at_first.set_viewport_size({"width": 820, "height": 1180})
    _use_theme(at_first, "light")
    scene = at_first.frame_locator("#view").locator("html")
    at_first.locator("#fold").click()
    at_first.evaluate("document.getElementById('view').contentWindow.location.reload()")
    expect(_tab(at_first, "Fahren")).to_be_visible()
    for name, value in (("folded", ""), ("theme", "light")):
        expect(scene).to_have_attribute(f"data-ip-{name}", value)
    expect(scene).to_have_attribute("data-mantine-color-scheme", "light")
    _tab(at_first, "Fahren").click()
    expect(scene).not_to_have_attribute("data-ip-folded", "")
    _tab(at_first, "Suche").click()


def test_every_control_has_a_name_and_every_text_contrast_in_both_themes(at_first):
    for theme in ("dark", "light"):
        _use_theme(at_first, theme)
        for name in _views(at_first):
            wrong = _wrong(
                at_first,
                *(functools.partial(part, at_first, UNNAMED) for part in (in_page, in_panels)),
                lambda: at_first.evaluate(f"({SLOW})() ?? ({LOW_CONTRAST})(document)"),
                lambda: in_panels(at_first, LOW_CONTRAST),
            )
            assert wrong == [], (theme, name)
            _keep(at_first, f"{theme}-{name}")


HALF_READ = """async () => {
  const { nameFields } = await import("/assets/panel_names.js");
  const frame = document.body.appendChild(document.createElement("iframe"));
  const inner = frame.contentDocument;
  inner.open();
  inner.write("<head>");
  const hadBody = inner.body !== null;
  nameFields(inner);
  inner.write("<body><div><label>Pinsel</label><input></div>");
  inner.close();
  await new Promise((done) => setTimeout(done, 600));
  const name = inner.querySelector("input").getAttribute("aria-label");
  frame.remove();
  return [hadBody, name];
}"""


def test_fields_have_names_where_the_page_adopts_a_document_that_is_half_read(at_first):
    assert at_first.evaluate(HALF_READ) == [False, "Pinsel"]


def _states(home, stage):
    """Have the robot do one thing after the other; yields what the page calls each."""
    home.find = stage.find_of()
    home.goal = msgspec.structs.replace(home.goal, outcome="found")
    for state, word in (
        ("found", "Gefunden"),
        ("stopped", "Gestoppt"),
        ("exhausted", "Nicht gefunden"),
        ("lost", "Wartet"),
    ):
        home.state = state
        yield word
        home.find = None
    home.state = "manual"
    home.status_changes = {"drive": DriveStatus(mode="manual", intervention="0.4 m")}
    yield "Manuell"


WATCHED = """() => {
  for (const id of ["lease-request", "lease-over", "log-out"]) {
    document.getElementById(id).hidden = false;
  }
  document.getElementById("lease-take").hidden = true;
  document.getElementById("holder").textContent = "Annas Tablet";
}"""


@pytest.mark.parametrize(
    ("theme", "width", "height"),
    [("light", 1440, 900), ("dark", 390, 844), ("light", 820, 1180)],
)
def test_every_state_is_whole_named_and_readable(at_first, parts, stage, theme, width, height):
    page, home = parts
    _use_theme(page, theme)
    page.set_viewport_size({"width": width, "height": height})
    _tab(page, "Suche").click()
    checks = [functools.partial(in_page, page, CUT_OFF)] + [
        functools.partial(part, page, check)
        for check in (UNNAMED, LOW_CONTRAST)
        for part in (in_page, in_panels)
    ]
    for word in _states(home, stage):
        expect(page.locator("#state")).to_have_text(word)
        page.wait_for_timeout(400)
        _keep(page, f"{width}-{word}")
        assert _wrong(page, *checks) == [], word
    home.begin_again()
    expect(page.locator("#state")).to_have_text("Sucht")
    assert page.evaluate(f"({WATCHED})() ?? ({CUT_OFF})(document)") == []
    assert page.evaluate(f"({WATCHED})() ?? ({LOW_CONTRAST})(document)") == []


def test_a_notice_leaves_the_tabs_free_where_the_page_is_enlarged(at_first, parts, stage):
    page, home = parts
    page.set_viewport_size({"width": 720, "height": 450})
    next(_states(home, stage))
    right = page.frame_locator("#view").locator("[data-dock-region='right']")
    notice, panel = boxes_at_rest(page.locator("#notice"), right)
    assert notice["x"] + notice["width"] <= panel["x"]


WALKS = [
    WalkStatus(step="turn", turn_deg=125.0, walk_m=12.5, way_m=25.0, look_up_deg=-35.0),
    WalkStatus(step="look", turn_deg=0.0, walk_m=0.0, way_m=0.0, look_up_deg=-35.0),
    WalkStatus(step="walk", turn_deg=0.0, walk_m=12.5, way_m=25.0, look_up_deg=-35.0),
]

WHOLE_WALK = """() => ["walk-do", "walk-then"].every((id) => {
  const text = document.createRange();
  text.selectNodeContents(document.getElementById(id));
  const inner = text.getBoundingClientRect();
  const card = document.getElementById("walk").getBoundingClientRect();
  const notices = document.querySelector(".stack").getBoundingClientRect();
  return card.left >= 0 && card.right <= innerWidth
    && (notices.top >= card.bottom || notices.bottom <= card.top)
    && inner.left > card.left && inner.right < card.right
    && inner.top > card.top && inner.bottom < card.bottom;
})"""


@pytest.mark.parametrize(("width", "height"), [(390, 844), (844, 390), (970, 768), (1120, 768)])
def test_directions_for_a_camera_in_the_hand_are_whole(at_first, parts, width, height):
    page, home = parts
    _resize(page, width, height)
    for walk in WALKS:
        home.status_changes = {"walk": walk}
        expect(page.locator("#walk")).to_have_attribute("data-step", walk.step)
        _keep(page, f"{width}-walk-{walk.step}")
        assert page.evaluate(WHOLE_WALK), walk.step


FOCUSED = """() => {
  let [doc, e] = [document, document.activeElement];
  if (e.tagName === "IFRAME") [doc, e] = [e.contentDocument, e.contentDocument.activeElement];
  const style = doc.defaultView.getComputedStyle(e);
  const isSeen = style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 1;
  return [e.id || e.getAttribute("aria-label") || e.textContent.trim(), isSeen || e === doc.body];
}"""


def test_the_keyboard_alone_reaches_everything_and_escape_closes_it(at_first):
    page = at_first
    _tab(page, "Fahren").click()
    # Its fields have their names a moment after it is shown.
    expect(page.frame_locator("#view").get_by_label("Tempolimit, %")).not_to_have_count(0)
    page.locator("#help-open").focus()
    met = {}
    for _ in range(40):
        page.keyboard.press("Tab")
        name, is_seen = page.evaluate(FOCUSED)
        met[name] = is_seen
    assert {"stop", "lease-take", "theme", "plan-open", "Ziele", "camera-size", "Karte"} <= set(met)
    assert {"Tempolimit, %", "Hinfahren", "Löschen"} <= set(met)
    assert [name for name, is_seen in met.items() if not is_seen] == []
    opener = page.locator(".scene-tools [data-opens=goals]")
    opener.focus()
    page.keyboard.press("Enter")
    expect(page.locator("#goals-close")).to_be_focused()
    page.keyboard.press("Escape")
    expect(page.locator("#goals")).to_be_hidden()
    expect(opener).to_be_focused()
    page.keyboard.press("p")
    page.locator("#plan-export summary").focus()
    page.keyboard.press("Enter")
    expect(page.get_by_text("ROS-Karte (PGM)")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.get_by_text("ROS-Karte (PGM)")).to_be_hidden()
    expect(page.locator("#plan")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator("#plan-open")).to_be_focused()


def test_buttons_of_the_panels_are_large_enough_for_fingers(at_first):
    _tab(at_first, "Fahren").click()
    button = at_first.frame_locator("#view").get_by_role("button", name="Hinfahren")
    devtools = at_first.context.new_cdp_session(at_first)
    devtools.send("Emulation.setTouchEmulationEnabled", {"enabled": True})
    try:
        assert box_at_rest(button)["height"] >= 32
    finally:
        devtools.send("Emulation.setTouchEmulationEnabled", {"enabled": False})


MOVING = """(doc) => [...doc.querySelectorAll("*")].filter((e) => {
  const style = doc.defaultView.getComputedStyle(e);
  const lasting = style.transitionDuration.split(", ").some((s) => parseFloat(s) > 0);
  return style.animationName !== "none" || lasting;
}).map((e) => e.className)"""


def test_less_motion_is_honoured(at_first):
    at_first.emulate_media(reduced_motion="reduce")
    assert in_page(at_first, MOVING) == []
    assert in_panels(at_first, MOVING) == []
    at_first.emulate_media(reduced_motion="no-preference")
    assert in_panels(at_first, MOVING) != [], "the check sees motion"
