"""The console as a process, against a navigator on real sockets."""

import json
import signal
import socket
import time
from pathlib import Path

import httpx2
import msgspec
import pytest
import websockets.sync.client

from app.nodes.console.config import ConsoleConfig, ConsoleError
from app.nodes.console.node import run_console
from app.nodes.console.scene.scene_thread import SceneThread
from app.view.view_options import ViewOptions


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"host": "0.0.0.0"}, "requires a login: make a file of users"),
        ({"host": "192.168.1.5"}, "IPPON_CONSOLE_PASSWORD"),
        ({"tls_cert": Path("a.pem")}, "both a certificate and its key"),
        ({"tls_proxy": "127.0.0.1"}, "behind a TLS proxy the console requires a login"),
        ({"tls_proxy": "proxy.example.org"}, "the numeric address from which the proxy connects"),
        ({"port": 70_000}, "a port lies in 0 to 65535"),
        ({"robot": "a/**"}, "parts joined by '/'"),
        ({"robot": ""}, "parts joined by '/'"),
        ({"robot": "scout/"}, "parts joined by '/'"),
    ],
)
def test_a_bad_configuration_is_refused_with_a_reason(fields, text):
    with pytest.raises(ConsoleError, match=text.replace("*", r"\*")):
        ConsoleConfig(**fields)


def test_a_taken_port_is_told_before_anything_starts():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(ConsoleError, match=f"port {port} on 127.0.0.1 cannot be used"):
            run_console(ConsoleConfig(port=port))


def test_what_is_no_endpoint_is_told_before_anything_starts():
    with pytest.raises(ConsoleError, match=r"is not a zenoh endpoint, such as tcp/127\.0\.0\.1"):
        run_console(ConsoleConfig(connect="robot.local:7447"))


class Shell:
    """The shell's socket, without the page."""

    def __init__(self, url):
        self.socket = websockets.sync.client.connect(
            url.replace("http:", "ws:") + "/api/ws", origin=url, max_size=None
        )
        self.state = None
        self.replies = {}

    def hear(self, until, timeout_s=20.0):
        """Read until the condition holds for this shell."""
        deadline = time.monotonic() + timeout_s
        while not until(self):
            message = json.loads(self.socket.recv(timeout=max(deadline - time.monotonic(), 0.01)))
            if message["type"] == "state":
                self.state = message
            elif message["type"] == "reply":
                self.replies[message["id"]] = message
        return self.state

    def command(self, action, number):
        self.socket.send(json.dumps({"type": "control", "id": number, "action": action}))
        self.hear(lambda shell: number in shell.replies)
        return self.replies[number]


@pytest.mark.slow
def test_ends_with_an_error_when_a_part_fails(stage, monkeypatch):
    def fail(*_):
        raise KeyError("unexpected")

    monkeypatch.setattr(SceneThread, "_take", fail)
    zenoh_port = stage.free_port()
    home = stage.PublishedHome(zenoh_port)
    config = ConsoleConfig(connect=f"tcp/127.0.0.1:{zenoh_port}", port=0)
    try:
        with pytest.raises(ConsoleError, match=r"a part of it failed \(KeyError"):
            run_console(config)
    finally:
        home.close()


@pytest.fixture
def zenoh_port(stage):
    """A port for the navigator."""
    return stage.free_port()


@pytest.fixture
def console(stage, zenoh_port):
    """A console whose navigator may or may not exist."""
    console = stage.ConsoleProcess(zenoh_port, stage.free_port())
    console.wait_until_up()
    yield console
    console.close()


@pytest.fixture
def shell(console):
    """A shell of that console."""
    shell = Shell(console.url)
    yield shell
    shell.socket.close()


def _live(shell):
    return shell.state is not None and shell.state["link"] == "live"


@pytest.mark.process
def test_waits_for_a_navigator_and_finds_it_again(stage, zenoh_port, shell):
    waiting = shell.hear(lambda s: s.state is not None)
    assert waiting["link"] == "waiting"
    assert f"tcp/127.0.0.1:{zenoh_port}" in waiting["link_text"]
    reply = shell.command("stop", 1)
    assert not reply["ok"]
    assert "no navigator at" in reply["text"]

    home = stage.PublishedHome(zenoh_port)
    state = shell.hear(lambda s: _live(s) and s.state["has_map"])
    assert (state["state"], state["object"], state["robot"]) == ("searching", "hat", "ippon")
    assert shell.command("stop", 2)["text"] == "stopped"
    assert shell.hear(lambda s: s.state["state"] == "stopped")
    home.close()

    shell.hear(lambda s: s.state["link"] == "silent")
    home = stage.PublishedHome(zenoh_port)
    shell.hear(lambda s: _live(s) and s.state["state"] == "searching")
    assert shell.command("stop", 3)["ok"]
    home.close()


@pytest.fixture
def home(stage, zenoh_port):
    """A navigator that is there before the console."""
    home = stage.PublishedHome(zenoh_port)
    yield home
    home.close()


@pytest.mark.process
def test_a_restarted_console_shows_the_whole_map_again(stage, home, zenoh_port):
    home.frozen = True
    for _ in range(25):
        home.tick()
    heights = home.keyframe().centers_world[:, 2]
    below_the_cut = int((heights < ViewOptions().ceiling_m).sum())
    port = stage.free_port()
    for _ in range(2):
        console = stage.ConsoleProcess(zenoh_port, port)
        try:
            console.wait_until_up()
            watcher = stage.SceneWatcher(console.url)
            watcher.read_until(lambda w: sum(w.points.values()) >= 0.95 * below_the_cut)
            watcher.read()
            shown = sum(watcher.points.values())
            watcher.close()
        finally:
            console.kill()
        assert 0.95 * below_the_cut <= shown <= below_the_cut, "the likeliest voxels are boxes"


@pytest.mark.process
def test_broken_messages_neither_end_the_console_nor_reach_the_scene(home, shell, console):
    shell.hear(_live)
    for key in ("status", "map/voxels", "plan/tree", "tf", "camera/color/image_raw/compressed"):
        for payload in (b"", b"{}", b"\xff" * 5000):
            home.put(key, payload)
    home.put("status", json.dumps({"robot": "<b>"}).encode())
    time.sleep(0.5)
    deadline = time.monotonic() + 10.0
    while httpx2.get(f"{console.url}/health", timeout=60.0).json()["state"]["robot"] != "ippon":
        assert time.monotonic() < deadline, "the next whole status is shown"
        shell.hear(_live)
    shell.hear(_live)
    assert console.process.poll() is None


@pytest.mark.process
@pytest.mark.parametrize(("end", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, -15)])
def test_ends_when_told_to_even_while_watched(home, shell, console, end, status):
    shell.hear(_live)
    console.process.send_signal(end)
    assert console.process.wait(60) in {0, status}


@pytest.mark.process
def test_a_navigator_of_another_version_is_named(stage, zenoh_port, shell):
    home = stage.PublishedHome(zenoh_port)
    try:
        home.status_changes = {"version": "9.9"}
        shell.hear(lambda shell: _live(shell) and shell.state["warning"])
        assert shell.state["warning"].startswith("The navigator has version 9.9, this console")
        home.frozen = True
        home.status = lambda: msgspec.structs.replace(stage.status_of(), state="pondering")
        shell.hear(lambda shell: shell.state["link"] == "waiting")
        assert "The navigator's status cannot be read" in shell.state["link_text"]
        assert "pondering" in shell.state["link_text"]
    finally:
        home.close()
