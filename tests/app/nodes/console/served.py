"""The console served: its gateway on a socket, its process, and a browser's scene without one."""

import asyncio
import json
import os
import struct
import subprocess
import sys
import threading
import time

import httpx2
import msgspec
import pytest
import uvicorn
import viser
import websockets.sync.client
import zstandard
from websockets.exceptions import ConnectionClosed

from app.nodes.console.node import server_settings
from tests.app.process_template import Copy
from tests.locations import ROOT

PROTOCOL = f"viser-v{viser.__version__}"
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


class _Server(uvicorn.Server):
    """Looks every 10 ms whether it should end, where uvicorn's own looks ten times a second."""

    async def main_loop(self):
        while not await self.on_tick(0):
            await asyncio.sleep(0.01)


class Served:
    """The gateway on a real socket, and a browser's requests to it."""

    def __init__(self, gateway, tls=None, proxy=None):
        self._server = _Server(server_settings(gateway.app(), port=0, tls=tls, proxy=proxy))
        self._thread = threading.Thread(target=self._server.run, daemon=True)
        self._thread.start()
        deadline = time.monotonic() + 20.0
        while not self._server.started:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        self.port = self._server.servers[0].sockets[0].getsockname()[1]
        self.host = f"127.0.0.1:{self.port}"
        self.origin = f"http{'s' * (tls is not None)}://{self.host}"
        # Nothing is verified: to read the certificates of all authorities takes longer than most
        # tests.
        headers = {"Origin": self.origin}
        self.http = httpx2.Client(base_url=self.origin, headers=headers, verify=False, timeout=60.0)
        self.get, self.post = self.http.get, self.http.post

    def socket(self, path, *, origin=None, subprotocols=None, cookie=None):
        return websockets.sync.client.connect(
            f"ws://{self.host}{path}",
            origin=origin or self.origin,
            subprotocols=subprotocols,
            additional_headers={"Cookie": cookie} if cookie else None,
            max_size=None,
        )

    def close(self):
        self.http.close()
        self._server.should_exit = True
        self._thread.join(10)


class ConsoleProcess:
    """The console as its own process."""

    def __init__(
        self, zenoh_port, port, users=None, language="en", robot="ippon", *, as_users=False
    ):
        """Start it; `as_users` with an interpreter of its own, to be measured."""
        self.url = f"http://127.0.0.1:{port}"
        where = ["--connect", f"tcp/127.0.0.1:{zenoh_port}", "--robot", robot, "--port", str(port)]
        login = [] if users is None else ["--users", str(users)]
        command = ["console", *where, "--language", language, *login]
        if as_users:
            self.process = subprocess.Popen([sys.executable, "-m", "app", *command], cwd=ROOT)
        else:
            self.process = Copy(command, 1, 2, os.environ)

    def wait_until_up(self, timeout_s=180.0):
        deadline = time.monotonic() + timeout_s
        with httpx2.Client(timeout=1.0) as client:
            while time.monotonic() < deadline:
                assert self.process.poll() is None, "the console has ended"
                try:
                    answer = client.get(f"{self.url}/health")
                    return answer.json() if answer.is_success else None
                except httpx2.TransportError:
                    time.sleep(0.05)
        self.close()
        raise TimeoutError("the console does not answer")

    def kill(self):
        self.process.kill()
        self.process.wait(60)

    def close(self):
        self.process.terminate()
        try:
            self.process.wait(60)
        except subprocess.TimeoutExpired:
            self.kill()


class SceneWatcher:
    """A browser's scene without the browser: reads what viser sends, as viser's client does."""

    def __init__(self, url):
        self.points = {}
        """Points of every cloud of the map, by name."""
        self.bytes = 0
        self._socket = websockets.sync.client.connect(
            url.replace("http:", "ws:") + "/view",
            origin=url,
            subprotocols=[PROTOCOL],
            max_size=None,
            ping_interval=None,
        )

    def close(self):
        self._socket.close()

    def read(self, quiet_s=0.5, timeout_s=10.0):
        """Read until nothing has come for a while."""
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            try:
                self._take(self._socket.recv(timeout=quiet_s))
            except TimeoutError:
                return

    def read_until(self, condition, timeout_s=20.0):
        deadline = time.monotonic() + timeout_s
        while not condition(self):
            self._take(self._socket.recv(timeout=max(deadline - time.monotonic(), 0.01)))

    def _take(self, data):
        self.bytes += len(data)
        size, packed = struct.unpack_from("<QQ", data)
        text = zstandard.ZstdDecompressor().decompress(data[16 : 16 + packed], size)
        content = msgspec.msgpack.decode(text)
        lengths = content.get("binaryBufferLengths") or ()
        for message in content["messages"]:
            name = message.get("name", "")
            if name.startswith("/map/"):
                changed = message.get("props") or message.get("updates") or {}
                if isinstance(changed.get("points"), dict):
                    self.points[name] = lengths[changed["points"]["__binary_index"]] // 6


def hear(socket, kind=None):
    """Return the next message, or the next of a kind; "you" only where it is asked for."""
    while True:
        message = json.loads(socket.recv(timeout=10))
        if message["type"] == kind or (kind is None and message["type"] != "you"):
            return message


def closing_code(socket):
    with pytest.raises(ConnectionClosed) as closed:
        drain(socket)
    received = closed.value.rcvd
    assert received is not None
    return received.code


def drain(socket):
    while True:
        socket.recv(timeout=10)


def first(socket):
    try:
        return socket.recv(timeout=10)
    except ConnectionClosed:
        return "{}"
