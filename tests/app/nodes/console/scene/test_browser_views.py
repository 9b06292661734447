"""Two browsers at one console, each with its own choice of what to see."""

import contextlib
import math
import struct
import threading
import time
from unittest.mock import MagicMock

import msgspec
import numpy as np
import pytest
import viser
import websockets.sync.client
import zstandard

from app.messages.motion import robot_transforms
from app.nodes.console.panels.search import SearchPanel
from app.nodes.console.scene.browser_views import OWN, BrowserViews
from app.nodes.console.web.browsers import Browser
from app.view.drawing.camera_follow import CameraFollow
from app.view.drawing.overlay_layer import NOTHING
from app.view.drawing.viser_scene import DARK_FLOOR, LIGHT_FLOOR
from app.view.model.scene_model import SceneModel
from app.view.view_options import ViewOptions
from app.view.words import ENGLISH
from ippon.geometry import base_pose
from tests.app.unwatched_viser import unwatched_viser

PATIENCE_S = 60.0
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (3.0, 3.0, 3.0),
    "fov": 0.9,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 800,
    "image_width": 1000,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


class FakeClient:
    """Speaks as viser's client does, and keeps what it hears of the scene."""

    def __init__(self, port):
        self._socket = websockets.sync.client.connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[f"viser-v{viser.__version__}"],
            max_size=None,
            ping_interval=None,
        )
        self.send(CAMERA)
        self._changed = threading.Condition()
        self._heard = []
        self.batches = []
        threading.Thread(target=self._listen, daemon=True).start()

    def send(self, message):
        self._socket.send(msgspec.msgpack.encode(message))

    def close(self):
        self._socket.close()

    def wait(self, wanted):
        """Return the first message that is wanted."""
        with self._changed:
            assert self._changed.wait_for(
                lambda: any(wanted(m) for m in self._heard), PATIENCE_S
            ), [(m["type"], m.get("name")) for m in self._heard][-12:]
            return next(m for m in self._heard if wanted(m))

    def heard(self):
        with self._changed:
            return list(self._heard)

    def names(self):
        with self._changed:
            return {m.get("name", "") for m in self._heard}

    def _listen(self):
        with contextlib.suppress(websockets.exceptions.ConnectionClosed):
            for data in self._socket:
                size, packed = struct.unpack_from("<QQ", data)
                text = zstandard.ZstdDecompressor().decompress(data[16 : 16 + packed], size)
                with self._changed:
                    self.batches.append(msgspec.msgpack.decode(text)["messages"])
                    self._heard += self.batches[-1]
                    self._changed.notify_all()


class Console:
    """The part of the scene_thread that draws, one step at a time."""

    def __init__(self, server):
        self.server = server
        self.model = SceneModel()
        tab = server.gui.add_tab_group().add_tab("Map")
        clicks = server.gui.add_folder("A click on the map")
        self.changed = threading.Event()
        self.search = SearchPanel(server.gui, MagicMock(say=ENGLISH, recorded=False))
        self.views = BrowserViews(
            server, tab, clicks, CameraFollow(), self.changed.set, search=self.search
        )
        self.browsers = []
        self.join_as = None
        """The browser that comes next; by default a new one."""
        self._came = threading.Semaphore(0)
        self._left = threading.Semaphore(0)
        server.on_client_connect(self._join)
        server.on_client_disconnect(self._leave)

    async def _join(self, client):
        browser = self.join_as or Browser(str(client.client_id), "somebody", "operator")
        self.browsers.append(browser)
        self.views.join(client, self.browsers[-1])
        self._came.release()

    async def _leave(self, client):
        self.views.leave(client)
        self._left.release()

    def open(self):
        browser = FakeClient(self.server.get_port())
        assert self._came.acquire(timeout=PATIENCE_S)
        self.draw()
        return browser

    def draw(self):
        self.changed.clear()
        self.views.draw(self.model, self.model.take_changes())

    def wait_for_goodbye(self):
        assert self._left.acquire(timeout=PATIENCE_S)


def _cloud(stage, *indices):
    return stage.cloud_of(np.array(indices), np.zeros(len(indices), np.uint8), 1)


@pytest.fixture
def console(stage):
    with unwatched_viser() as server:
        console = Console(server)
        console.model.on_status(stage.status_of())
        console.model.on_keyframe(_cloud(stage, (0, 0, 0), (20, 0, 0)))
        yield console


def _mode_buttons(message):
    return message["type"] == "GuiButtonGroupMessage" and message["props"]["label"] == "Colour"


def _hides(name):
    return lambda m: (
        m["type"] == "SetSceneNodeVisibilityMessage" and m["name"] == name and not m["visible"]
    )


def _choose(console, browser, word):
    uuid = browser.wait(_mode_buttons)["uuid"]
    browser.send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": word}})
    assert console.changed.wait(PATIENCE_S)
    console.draw()
    return uuid


def test_a_choice_is_each_browsers_own(console):
    first, second = console.open(), console.open()
    second.wait(lambda m: m.get("name") == "/map/0_0")
    uuid = _choose(console, first, "Object")
    assert uuid in console.browsers[0].own_controls
    assert uuid not in console.browsers[1].own_controls
    first.wait(lambda m: m.get("name") == f"{OWN}/map/1_0")
    first.wait(_hides("/map"))
    first.wait(_hides("/finds"))
    second_uuid = _choose(console, second, "Height")
    second.wait(lambda m: m.get("name") == f"{OWN}/map/1_0")
    assert second_uuid != uuid
    modes = {console.views.options_of(n).mode for n in (0, 1)}
    assert modes == {"ooi", "height"}
    first.close()
    second.close()


def test_what_was_chosen_holds_again_when_the_line_was_broken(console):
    first = console.open()
    first.wait(lambda m: m.get("name") == "/map/0_0")
    _choose(console, first, "Object")
    (known,) = console.browsers
    first.close()
    console.wait_for_goodbye()
    console.join_as = known
    again = console.open()
    again.wait(_mode_buttons)
    console.draw()
    again.wait(lambda m: m.get("name") == f"{OWN}/map/1_0")
    assert console.views.options_of(1).mode == "ooi"
    again.close()


def test_what_a_click_does_is_each_browsers_own(console):
    first, second = console.open(), console.open()
    tools = first.wait(lambda m: m.get("props", {}).get("label") == "does")
    tab = next(m for m in first.heard() if m.get("props", {}).get("label") == "A click on the map")
    assert tools["container_uuid"] == tab["uuid"]
    first.send({"type": "GuiUpdateMessage", "uuid": tools["uuid"], "updates": {"value": "Go"}})
    _wait_until(lambda: console.views.tool_of(0).chosen == "go")
    assert console.views.tool_of(1).chosen == "explain"
    assert console.views.tool_of(2) is None, "it has not connected yet"
    first.close()
    second.close()


def test_what_is_typed_is_each_browsers_own_and_stands_there_again(console):
    def is_find(message):
        return message["type"] == "GuiTextMessage" and message["props"]["label"] == "Find"

    first, second = console.open(), console.open()
    field, other = first.wait(is_find), second.wait(is_find)
    assert field["uuid"] != other["uuid"]
    known, unaware = console.browsers
    assert field["uuid"] in known.own_controls, "it may be typed in while another has control"
    typed = {"value": "a red mug"}
    first.send({"type": "GuiUpdateMessage", "uuid": field["uuid"], "updates": typed})
    _wait_until(lambda: known.draft is not None)
    assert known.draft[0] == "a red mug"
    assert unaware.draft is None
    assert not [m for m in second.heard() if m.get("updates") == typed]
    first.close()
    console.wait_for_goodbye()
    console.join_as = known
    again = console.open()
    assert again.wait(is_find)["value"] == "a red mug"
    again.close()
    second.close()


def _wait_until(condition):
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_a_browser_gets_a_change_of_colours_as_one(console, stage):
    columns = 150
    many = [(16 * x, 0, k) for x in range(columns) for k in range(3)]
    console.model.on_voxels(_cloud(stage, *many))
    browser = console.open()
    last = f"{OWN}/map/{columns - 1}_0"
    _choose(console, browser, "Object")
    browser.wait(lambda m: m.get("name") == last)
    _choose(console, browser, "Height")
    browser.wait(lambda m: m.get("name") == last and "colors" in m.get("updates", {}))
    recoloured = [
        sum("colors" in message.get("updates", {}) for message in batch)
        for batch in browser.batches
    ]
    assert [n for n in recoloured if n] == [columns]
    browser.close()


def test_whoever_sees_the_common_drawing_has_none_of_its_own(console, stage):
    first, second = console.open(), console.open()
    _choose(console, first, "Object")
    console.model.on_voxels(_cloud(stage, (40, 0, 0)))
    console.draw()
    console.views.highlight_for_all(NOTHING)
    first.wait(lambda m: m.get("name") == f"{OWN}/map/2_0")
    second.wait(lambda m: m.get("name") == "/map/2_0")
    assert not [name for name in second.names() if name.startswith(OWN)]
    first.close()
    second.close()


def test_a_browser_that_leaves_is_forgotten_and_may_be_drawn_for_meanwhile(console, stage):
    browser = console.open()
    _choose(console, browser, "Object")
    (known,) = console.browsers
    browser.close()
    console.wait_for_goodbye()
    console.model.on_voxels(_cloud(stage, (60, 0, 0)))
    console.draw()
    assert known.own_controls == set()
    assert console.views.options_of(0) == ViewOptions()
    assert np.allclose(console.views.bounds()[0], 0.0)
    console.draw()


@pytest.mark.parametrize("value", [math.nan, math.inf, -1e30])
def test_a_slider_of_a_browser_at_a_value_that_it_has_not_ends_nothing(console, value):
    browser = console.open()
    for label in ("Cut above, m", "Object threshold"):
        slider = browser.wait(lambda m, label=label: m.get("props", {}).get("label") == label)
        console.changed.clear()
        update = {"value": value}
        browser.send({"type": "GuiUpdateMessage", "uuid": slider["uuid"], "updates": update})
        assert console.changed.wait(PATIENCE_S)
        console.draw()
    options = console.views.options_of(0)
    assert options.ceiling_m == (None if not value < 0.0 else pytest.approx(0.4))
    assert 0.05 <= options.object_threshold <= 0.95
    browser.close()


def test_the_floor_follows_the_theme_of_each_browser(console):
    def floor(colors):
        def wanted(message):
            if message.get("name") != "/floor" or "props" not in message:
                return False
            props = message["props"]
            return (tuple(props["cell_color"]), tuple(props["section_color"])) == colors

        return wanted

    first, second = console.open(), console.open()
    for one in (first, second):
        one.wait(floor(DARK_FLOOR))
    console.browsers[1].has_light_theme = True
    console.draw()
    second.wait(floor(LIGHT_FLOOR))
    T_world_base = base_pose(1.0, 2.0, 3.0, 0.0)
    console.model.on_transforms(robot_transforms(1, T_world_base, np.eye(4), "camera"))
    console.draw()
    for one in (first, second):
        one.wait(lambda m: m.get("name") == "/floor" and m.get("position", [0.0])[-1] > 2.9)
    third = console.open()
    third.wait(floor(DARK_FLOOR))
    assert not any(map(floor(LIGHT_FLOOR), first.heard()))
    assert not any(map(floor(LIGHT_FLOOR), third.heard()))
    for one in (first, second, third):
        one.close()
        console.wait_for_goodbye()
