import json
import threading
import time

import httpx
import msgspec
import pytest
import websockets.sync.client
from viser import __version__ as viser_version
from viser._messages import ShareUrlRequest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from app.messages.lease import LeaseReply
from app.nodes.console import gateway, shell_socket, viser_proxy
from app.nodes.console.access import OpenAccess
from app.nodes.console.backend import start_viser
from app.nodes.console.bulletin import Bulletin
from app.nodes.console.commands import CommandError
from app.nodes.console.gateway import Gateway
from app.nodes.console.guard import Hosts
from app.nodes.console.visitors import Visitor, Visitors, acting


class Navigator:
    """Takes control requests."""

    def __init__(self):
        self.actions = []
        self.problem = None
        self.is_free = True
        self.counts_renewals = False
        self.who = None

    def may_touch(self, visitor):
        return self.is_free

    async def lease(self, action):
        if action != "renew" or self.counts_renewals:
            self.actions.append(action)
        if self.problem is not None:
            raise CommandError(self.problem)
        self.who = acting()
        if action == "renew" and not acting().in_play:
            return LeaseReply(standing="watches", epoch=3, detail="Nobody holds control.")
        reply = LeaseReply(standing="holds", epoch=3, detail="You hold control.")
        acting().take_note(reply)
        return reply

    async def control(self, request):
        self.actions.append(request.action)
        self.who = acting()
        if self.problem is not None:
            raise CommandError(self.problem)
        return "stopped"


@pytest.fixture(scope="module")
def visitors():
    """Everyone who comes by in this module."""
    return Visitors()


@pytest.fixture(scope="module")
def backend(visitors):
    """A viser server behind its secret."""
    backend = start_viser(visitors)
    yield backend
    backend.close()


@pytest.fixture
def navigator():
    """A navigator that remembers what it was asked."""
    return Navigator()


@pytest.fixture
def bulletin():
    """A bulletin with one notice."""
    bulletin = Bulletin()
    bulletin.post(b'{"type":"state","link":"live"}')
    return bulletin


@pytest.fixture
def client(stage, backend, bulletin, navigator, visitors):
    """A browser's requests, without the browser."""
    served = stage.Served(
        Gateway(backend, bulletin, navigator, OpenAccess(visitors), Hosts("127.0.0.1"))
    )
    yield served
    served.close()


def test_the_page_is_ours_and_runs_nothing_inline(client):
    page = client.get("/")
    assert page.status_code == 200
    assert "IPPON" in page.text
    assert "<script>" not in page.text
    assert "style=" not in page.text
    policy = page.headers["content-security-policy"]
    assert "script-src 'self';" in policy
    assert "frame-ancestors 'none'" in policy
    assert page.headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize("name", ["shell.css", "shell.js", "view.css", "icon.svg"])
def test_assets_are_served_with_their_type(client, name):
    answer = client.get(f"/assets/{name}")
    assert answer.status_code == 200
    assert answer.headers["content-type"].split(";")[0] in {
        "text/css",
        "text/javascript",
        "image/svg+xml",
    }


@pytest.mark.parametrize(
    "path",
    ["/assets/index.html", "/assets/..%2f__init__.py", "/assets/../../pyproject.toml", "/x"],
)
def test_no_other_file_is_served(client, path):
    assert client.get(path).status_code == 404


def test_the_scene_may_connect_to_this_server_only(client):
    page = client.get("/view/?darkMode")
    assert page.status_code == 200
    assert '<link rel="stylesheet" href="/assets/view.css">' in page.text
    policy = page.headers["content-security-policy"]
    assert "connect-src 'self' data: blob:" in policy
    assert "'unsafe-eval'" not in policy
    assert "'unsafe-inline'" not in policy.partition("script-src")[2].partition(";")[0]
    assert "<script>" not in page.text


def test_another_servers_address_in_the_url_is_dropped(client):
    answer = client.get("/view/?darkMode&websocket=ws://evil.example", follow_redirects=False)
    assert answer.status_code == 303
    assert answer.headers["location"] == "/view/?darkMode"


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example:8080", "", "[::", "a b"])
def test_foreign_host_names_are_refused(client, host):
    answer = client.get("/", headers={"Host": host})
    assert answer.status_code == 403
    assert "answers to 127.0.0.1" in answer.text


@pytest.mark.parametrize("host", ["localhost:8080", "127.0.0.1:9", "[::1]:8080"])
def test_every_name_of_this_machine_is_served(client, host):
    answer = client.get("/health", headers={"Host": host, "Origin": f"http://{host}"})
    assert answer.status_code == 200


@pytest.mark.parametrize("path", ["/api/ws", "/view"])
@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:9999"])
def test_websockets_from_other_pages_are_refused(client, path, origin):
    with pytest.raises(InvalidStatus) as refused:
        client.socket(path, origin=origin)
    assert refused.value.response.status_code == 403


def test_stop_from_another_page_is_refused(client, navigator):
    answer = client.post("/api/stop", headers={"Origin": "http://evil.example"})
    assert answer.status_code == 403
    assert navigator.actions == []


@pytest.mark.parametrize("origin", ["http://[", "http://[::1", "http://\u2100", "//", ""])
def test_an_origin_that_is_none_is_refused(client, navigator, origin):
    answer = client.post("/api/stop", headers={"Origin": origin.encode("utf-8")})
    assert answer.status_code == 403
    assert navigator.actions == []


def test_stop_by_http(client, navigator):
    assert client.post("/api/stop").json() == {"ok": True, "text": "stopped"}
    navigator.problem = "no navigator at tcp/127.0.0.1:7447"
    answer = client.post("/api/stop")
    assert (answer.status_code, answer.json()["ok"]) == (502, False)
    assert "no navigator" in answer.json()["text"]
    assert navigator.actions == ["stop", "stop"]


def test_health_tells_the_state(client):
    assert client.get("/health").json()["link"] == "live"


def _hear(socket, kind=None):
    """Return the next message, or the next of a kind; "you" only where it is asked for."""
    while True:
        message = json.loads(socket.recv(timeout=10))
        if message["type"] == kind or (kind is None and message["type"] != "you"):
            return message


def test_the_shell_hears_the_state_and_its_echo(client, bulletin):
    with client.socket("/api/ws") as shell:
        assert _hear(shell) == {"type": "state", "link": "live"}
        shell.send('{"type":"ping","t":12.5}')
        assert _hear(shell) == {"type": "pong", "t": 12.5}
        bulletin.post(b'{"type":"state","link":"silent"}')
        assert _hear(shell)["link"] == "silent"


def test_the_shell_gets_an_answer_to_every_command(client, navigator):
    with client.socket("/api/ws") as shell:
        _hear(shell)
        shell.send('{"type":"control","id":7,"action":"stop"}')
        assert _hear(shell) == {"type": "reply", "id": 7, "ok": True, "text": "stopped"}
        navigator.problem = "the navigator gave no answer within 2 s"
        shell.send('{"type":"control","id":8,"action":"resume"}')
        reply = _hear(shell)
        assert (reply["id"], reply["ok"], reply["text"]) == (8, False, navigator.problem)


def _closing_code(socket):
    with pytest.raises(ConnectionClosed) as closed:
        _drain(socket)
    received = closed.value.rcvd
    assert received is not None
    return received.code


def _drain(socket):
    while True:
        socket.recv(timeout=10)


@pytest.mark.parametrize(
    "text",
    ["", "no json", "[]", '{"type":"shoot"}', '{"type":"control","id":1,"action":"explode"}',
     '{"type":"ping","t":1,"more":2}', '{"type":"ping","t":1}' + " " * 5000, b"\x00\xff"],
)  # fmt: skip
def test_what_is_no_message_ends_the_shell_and_commands_nothing(client, navigator, text):
    with client.socket("/api/ws") as shell:
        _hear(shell)
        shell.send(text)
        assert _closing_code(shell) == 1007
    assert navigator.actions == []


def test_a_page_is_told_who_it_is_and_a_browser_stays_the_same(client):
    assert "HttpOnly; Path=/; SameSite=Strict" in client.get("/").headers["set-cookie"]
    cookie = f"ippon={client.http.cookies['ippon']}"
    with client.socket("/api/ws", cookie=cookie) as shell:
        you = _hear(shell, "you")
    assert you["name"].startswith("browser ")
    assert (you["role"], you["standing"], you["has_login"]) == ("supervisor", "watches", False)
    assert "set-cookie" not in client.get("/").headers
    with client.socket("/api/ws", cookie=cookie) as again:
        assert _hear(again, "you") == you
    with client.socket("/api/ws") as other:
        assert _hear(other, "you")["name"] != you["name"]


def test_what_a_page_asks_is_asked_in_its_name(client, navigator):
    with client.socket("/api/ws") as shell:
        name = _hear(shell, "you")["name"]
        shell.send('{"type":"control","id":7,"action":"pause"}')
        _hear(shell, "reply")
    assert navigator.who.name == name


def test_control_is_taken_renewed_and_lost_as_the_page_is_told(client, navigator):
    navigator.counts_renewals = True
    with client.socket("/api/ws") as shell:
        assert _hear(shell, "you")["standing"] == "watches"
        shell.send('{"type":"lease","id":1,"action":"request"}')
        assert _hear(shell, "reply") == {
            "type": "reply", "id": 1, "ok": True, "text": "You hold control.",
        }  # fmt: skip
        assert _hear(shell, "you")["standing"] == "holds"
        deadline = time.monotonic() + 10.0
        while navigator.actions.count("renew") < 3:
            assert time.monotonic() < deadline
            time.sleep(0.05)
        shell.send('{"type":"lease","id":2,"action":"release"}')
        _hear(shell, "reply")
    assert {"request", "renew", "release"} == set(navigator.actions)
    navigator.problem = "Anna holds control"
    with client.socket("/api/ws") as shell:
        shell.send('{"type":"lease","id":3,"action":"take"}')
        assert _hear(shell, "reply")["text"] == "Anna holds control"


CAMERA = msgspec.msgpack.encode(
    {
        "type": "ViewerCameraMessage",
        "wxyz": (1.0, 0.0, 0.0, 0.0),
        "position": (0.0, 0.0, 1.0),
        "fov": 1.0,
        "near": 0.1,
        "far": 100.0,
        "image_height": 480,
        "image_width": 640,
        "look_at": (1.0, 0.0, 0.0),
        "up_direction": (0.0, 0.0, 1.0),
    }
)
"""A client is one for viser once it has said where it looks from."""


def test_a_page_that_sleeps_keeps_no_lease(client, navigator, monkeypatch):
    navigator.counts_renewals = True
    monkeypatch.setattr(shell_socket, "ASLEEP_S", 0.2)
    monkeypatch.setattr(shell_socket, "RENEW_S", 0.05)
    with client.socket("/api/ws") as shell:
        shell.send('{"type":"lease","id":1,"action":"request"}')
        _hear(shell, "reply")
        time.sleep(0.5)
        renewals = navigator.actions.count("renew")
        time.sleep(0.3)
        assert navigator.actions.count("renew") == renewals
        shell.send('{"type":"alive"}')
        deadline = time.monotonic() + 10.0
        while navigator.actions.count("renew") == renewals:
            assert time.monotonic() < deadline
            time.sleep(0.02)


def test_panels_of_who_watches_do_nothing(client, backend, navigator):
    box = backend.server.gui.add_checkbox("box", initial_value=False)
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
    def allowed(kind, uuid="", may_touch=False):
        message = msgspec.msgpack.encode({"type": kind, "uuid": uuid, "updates": {}})
        return viser_proxy._allowed(message, may_touch, {"own"})

    assert allowed("GuiUpdateMessage", "own")
    assert not allowed("GuiUpdateMessage", "another")
    assert not allowed("SceneNodeClickMessage", "own")
    assert allowed("ViewerCameraMessage")
    assert allowed("GuiUpdateMessage", "another", may_touch=True)
    assert not allowed("ShareUrlRequest", "own", may_touch=True)


def test_a_panels_click_is_answered_in_the_name_of_its_browser(client, backend):
    client.get("/")
    cookie = f"ippon={client.http.cookies['ippon']}"
    with client.socket("/api/ws", cookie=cookie) as shell:
        name = _hear(shell, "you")["name"]
    button = backend.server.gui.add_button("press")
    pressed = threading.Event()
    seen = []
    button.on_click(lambda _: (seen.append(acting()), pressed.set()))
    click = msgspec.msgpack.encode(
        {"type": "GuiUpdateMessage", "uuid": button._impl.uuid, "updates": {"value": True}}
    )
    with client.socket("/view", subprotocols=[PROTOCOL], cookie=cookie) as scene:
        scene.recv(timeout=10)
        scene.send(CAMERA)
        scene.send(click)
        assert pressed.wait(10.0)
    assert [visitor.name for visitor in seen] == [name]
    button.remove()


PROTOCOL = f"viser-v{viser_version}"


def test_the_scene_comes_through_with_its_subprotocol(client):
    with client.socket("/view", subprotocols=[PROTOCOL]) as scene:
        assert scene.subprotocol == PROTOCOL
        assert len(scene.recv(timeout=10)) > 100


def test_nobody_can_ask_for_a_public_tunnel(client, backend, monkeypatch):
    asked = []
    monkeypatch.setattr(backend.server, "request_share_url", lambda *_, **__: asked.append(1))
    request = msgspec.msgpack.encode({"type": "ShareUrlRequest"})
    with client.socket("/view", subprotocols=[PROTOCOL]) as scene:
        scene.recv(timeout=10)
        scene.send(request)
        scene.send(b"\xc1 no msgpack")
        scene.send(b"")
    headers = backend.headers_of(Visitor("x" * 20, "Anna", "operator"))
    # Past the proxy too: viser itself has no handler left.
    with websockets.sync.client.connect(
        backend.url, additional_headers=headers, subprotocols=[PROTOCOL], max_size=None
    ) as direct:
        direct.recv(timeout=10)
        direct.send(request)
    assert ShareUrlRequest not in backend.server._websock_server._incoming_handlers
    assert asked == []


@pytest.mark.parametrize("headers", [{}, {"X-Ippon-Backend": "guess"}])
def test_viser_refuses_whoever_lacks_the_secret(backend, headers):
    with pytest.raises(InvalidStatus) as refused:
        websockets.sync.client.connect(
            backend.url, additional_headers=headers, subprotocols=[PROTOCOL]
        )
    assert refused.value.response.status_code == 403
    plain = httpx.get(backend.url.replace("ws:", "http:"), headers=headers)
    assert plain.status_code == 403


def test_text_is_no_scene_message_and_ends_the_scene(client):
    with client.socket("/view", subprotocols=[PROTOCOL]) as scene:
        scene.recv(timeout=10)
        scene.send("hello")
        assert _closing_code(scene) == 1007


def test_an_oversized_message_ends_the_scene(client):
    scene = client.socket("/view", subprotocols=[PROTOCOL])
    scene.recv(timeout=10)
    with pytest.raises(ConnectionClosed):
        _send_and_drain(scene, b"x" * (8 * 2**20 + 1))
    assert client.get("/health").status_code == 200


def _send_and_drain(socket, message):
    socket.send(message)
    _drain(socket)


def test_beyond_so_many_pages_a_further_one_is_turned_away(client, monkeypatch):
    monkeypatch.setattr(gateway, "MAX_SOCKETS", 2)
    with client.socket("/api/ws") as one, client.socket("/api/ws") as two:
        _hear(one)
        _hear(two)
        with client.socket("/api/ws") as three:
            assert _closing_code(three) == 1013
    deadline = time.monotonic() + 10.0
    while True:
        with client.socket("/api/ws") as again:
            if json.loads(_first(again)).get("type"):
                break
        assert time.monotonic() < deadline


def _first(socket):
    try:
        return socket.recv(timeout=10)
    except ConnectionClosed:
        return "{}"
