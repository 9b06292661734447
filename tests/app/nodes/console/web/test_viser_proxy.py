"""What a browser may say to the scene, and what comes back."""

import math
import threading

import httpx2
import msgspec
import pytest
import websockets.sync.client
from viser._messages import ShareUrlRequest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from app.nodes.console.web import viser_proxy
from app.nodes.console.web.browsers import Browser, acting_browser
from tests.app.nodes.console.served import CAMERA, PROTOCOL, closing_code, drain, hear


def test_panels_of_who_watches_do_nothing(client, viser_server, navigator):
    box = viser_server.server.gui.add_checkbox("box", initial_value=False)
    changed = threading.Event()
    box.on_update(lambda _: changed.set())
    click = msgspec.msgpack.encode(
        {"type": "GuiUpdateMessage", "uuid": box._impl.uuid, "updates": {"value": True}}
    )
    with client.socket("/view", subprotocols=[PROTOCOL]) as scene:
        scene.recv(timeout=10)
        navigator.is_free = False
        scene.send(CAMERA)
        scene.send(click)
        assert not changed.wait(0.5)
        navigator.is_free = True
        scene.send(click)
        assert changed.wait(10.0)
    box.remove()


def test_who_watches_may_change_what_this_browser_sees_and_no_more():
    browser = Browser("x" * 20, "browser 1", "supervisor")
    browser.own_controls.add("own")

    def allowed(kind, uuid="", panels=False):
        message = msgspec.msgpack.encode({"type": kind, "uuid": uuid, "updates": {}})
        return viser_proxy._allowed(message, browser, panels=panels)

    assert allowed("GuiUpdateMessage", "own")
    assert not allowed("GuiUpdateMessage", "another")
    assert not allowed("SceneNodeClickMessage", "own")
    assert viser_proxy._allowed(CAMERA, browser, panels=False)
    assert allowed("GuiUpdateMessage", "another", panels=True)
    assert not allowed("ShareUrlRequest", "own", panels=True)


@pytest.mark.parametrize(
    "change",
    [
        {"image_height": 0},
        {"image_width": 0},
        {"wxyz": (0.0, 0.0, 0.0, 0.0)},
        {"wxyz": (1.0, 0.0, 0.0)},
        {"position": (0.0, math.nan, 0.0)},
        {"look_at": (math.inf, 0.0, 0.0)},
        {"fov": 4.0},
        {"fov": "wide"},
    ],
)
def test_a_camera_that_nothing_can_be_computed_with_is_dropped(change):
    browser = Browser("x" * 20, "browser 1", "viewer")
    camera = msgspec.msgpack.decode(CAMERA)
    assert viser_proxy._allowed(msgspec.msgpack.encode(camera), browser, panels=False)
    assert not viser_proxy._allowed(msgspec.msgpack.encode(camera | change), browser, panels=False)


def test_a_panels_click_is_answered_in_the_name_of_its_browser(client, viser_server):
    cookie = client.get("/").headers["set-cookie"].split(";")[0]
    with client.socket("/api/ws", cookie=cookie) as shell:
        name = hear(shell, "you")["name"]
    button = viser_server.server.gui.add_button("press")
    pressed = threading.Event()
    seen = []
    button.on_click(lambda _: (seen.append(acting_browser()), pressed.set()))
    click = msgspec.msgpack.encode(
        {"type": "GuiUpdateMessage", "uuid": button._impl.uuid, "updates": {"value": True}}
    )
    with client.socket("/view", subprotocols=[PROTOCOL], cookie=cookie) as scene:
        scene.recv(timeout=10)
        scene.send(CAMERA)
        scene.send(click)
        assert pressed.wait(10.0)
    assert [browser.name for browser in seen] == [name]
    button.remove()


def test_the_scene_comes_through_with_its_subprotocol(client):
    with client.socket("/view", subprotocols=[PROTOCOL]) as scene:
        assert scene.subprotocol == PROTOCOL
        assert len(scene.recv(timeout=10)) > 100


def test_nobody_can_ask_for_a_public_tunnel(client, viser_server, monkeypatch):
    asked = []
    monkeypatch.setattr(viser_server.server, "request_share_url", lambda *_, **__: asked.append(1))
    request = msgspec.msgpack.encode({"type": "ShareUrlRequest"})
    with client.socket("/view", subprotocols=[PROTOCOL]) as scene:
        scene.recv(timeout=10)
        scene.send(request)
        scene.send(b"\xc1 no msgpack")
        scene.send(b"")
    headers = viser_server.headers_of(Browser("x" * 20, "Anna", "operator"))
    # Past the proxy too: viser itself has no handler left.
    with websockets.sync.client.connect(
        viser_server.url, additional_headers=headers, subprotocols=[PROTOCOL], max_size=None
    ) as direct:
        direct.recv(timeout=10)
        direct.send(request)
    assert ShareUrlRequest not in viser_server.server._websock_server._incoming_handlers
    assert asked == []


@pytest.mark.parametrize("headers", [{}, {"X-Ippon-Backend": "guess"}])
def test_viser_refuses_whoever_lacks_the_secret(viser_server, headers):
    with pytest.raises(InvalidStatus) as refused:
        websockets.sync.client.connect(
            viser_server.url, additional_headers=headers, subprotocols=[PROTOCOL]
        )
    assert refused.value.response.status_code == 403
    plain = httpx2.get(viser_server.url.replace("ws:", "http:"), headers=headers, timeout=60.0)
    assert plain.status_code == 403


def test_text_is_no_scene_message_and_ends_the_scene(client):
    with client.socket("/view", subprotocols=[PROTOCOL]) as scene:
        scene.recv(timeout=10)
        scene.send("hello")
        assert closing_code(scene) == 1007


def test_an_oversized_message_ends_the_scene(client):
    scene = client.socket("/view", subprotocols=[PROTOCOL])
    scene.recv(timeout=10)
    with pytest.raises(ConnectionClosed):
        _send_and_drain(scene, b"x" * (8 * 2**20 + 1))
    assert client.get("/health").status_code == 200


def _send_and_drain(socket, message):
    socket.send(message)
    drain(socket)
