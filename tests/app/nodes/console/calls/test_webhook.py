"""The webhook against a real HTTP server that answers, is slow, hangs, fails or closes."""

import hashlib
import hmac
import json
import queue
import socket
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from app.nodes.console.calls.call import Call, Occasion
from app.nodes.console.calls.webhook import (
    MAX_WAITING,
    SIGNATURE,
    Patience,
    Webhook,
    place_of,
    read_secret,
)
from app.nodes.console.config import ConsoleConfig, ConsoleError
from tests.ports import free_port

SECRET = b"a-secret"
QUICK = Patience(timeout_s=0.5, pauses_s=(0.02, 0.05))
PATIENT = Patience(timeout_s=20.0, pauses_s=(0.02, 0.05))


class Server:
    """Answers with what the next of its plans says; a plan is a status or a function."""

    def __init__(self):
        self.plans = []
        """What the next requests get, a list; or a function that returns it for a body."""
        self.bodies = []
        self.released = threading.Event()
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                outer.bodies.append((dict(self.headers), body))
                if callable(outer.plans):
                    plan = outer.plans(json.loads(body))
                else:
                    plan = outer.plans.pop(0) if outer.plans else 200
                if callable(plan):
                    plan(self)
                    return
                self.send_response(plan)
                self.send_header("Location", "http://127.0.0.1:1/")
                self.end_headers()

            def log_message(self, *_):
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self.url = f"http://127.0.0.1:{self._server.server_port}/hook?token=hidden"
        threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True).start()

    def hang(self, _):
        self.released.wait(20)

    def close_at_once(self, handler):
        handler.connection.shutdown(socket.SHUT_RDWR)

    def trickle(self, handler):
        """A header without an end: each byte is in time, the answer is not."""
        handler.wfile.write(b"HTTP/1.1 200 OK\r\nX: ")
        while not self.released.wait(0.1):
            try:
                handler.wfile.write(b"x")
            except OSError:
                return

    def close(self):
        self.released.set()
        self._server.shutdown()
        self._server.server_close()


@pytest.fixture(scope="module")
def server():
    server = Server()
    yield server
    server.close()


@pytest.fixture
def patience():
    return PATIENT


@pytest.fixture
def hook(server, patience):
    server.plans, server.bodies = [], []
    notes = queue.Queue()
    webhook = Webhook(server.url, SECRET, "ippon", lambda *note: notes.put(note), patience)
    webhook.start()
    webhook.notes = notes
    yield webhook
    webhook.close()


def call(number=1, text="<b>Anna's</b> keys: confirm or reject it"):
    occasion = Occasion(
        kind="found", text=text, goal_id=3, object="keys", position_world=(1.0, 2.0, 0.5)
    )
    return Call(number=number, title="Found", occasion=occasion, wall_ns=1_700_000_000_000_000_000)


def outcome(hook):
    """Return what was noted last about a call, and how often it was tried again."""
    again = 0
    while True:
        _, text = hook.notes.get(timeout=20)
        if not text.endswith("it is tried again"):
            return text, again
        again += 1


def test_a_call_arrives_signed_as_json(hook, server):
    hook.send(call())
    assert outcome(hook) == ("arrived", 0)
    headers, body = server.bodies[0]
    told = json.loads(body)
    assert told["text"] == "<b>Anna's</b> keys: confirm or reject it"
    assert (told["kind"], told["title"], told["robot"]) == ("found", "Found", "ippon")
    assert (told["goal_id"], told["position_world"], told["count"]) == (3, [1.0, 2.0, 0.5], 1)
    assert told["time"] == "2023-11-14T22:13:20+00:00"
    expected = hmac.new(SECRET, body, hashlib.sha256).hexdigest()
    assert headers[SIGNATURE] == f"sha256={expected}"
    assert headers["Content-Type"] == "application/json"


def test_a_server_that_fails_is_tried_again_with_the_same_call(hook, server):
    server.plans = [500, server.close_at_once, 204]
    hook.send(call())
    assert outcome(hook) == ("arrived after 3 attempts", 2)
    assert len({body for _, body in server.bodies}) == 1


@pytest.mark.parametrize(("status", "tries"), [(503, 3), (429, 3), (404, 1), (302, 1)])
def test_attempts_are_bounded_and_a_refusal_is_final(hook, server, status, tries):
    server.plans = [status] * 5
    hook.send(call())
    times = f" after {tries} attempts" if tries > 1 else ""
    assert outcome(hook) == (f"did not arrive{times}: the answer was {status}", tries - 1)
    assert len(server.bodies) == tries


def test_a_server_that_hangs_or_trickles_holds_up_neither_callers_nor_other_calls(hook, server):
    bad = {"one": server.hang, "two": server.trickle}
    server.plans = lambda told: bad.get(told["text"], 200)
    started = time.monotonic()
    hook.send(call(1, "one"))
    hook.send(call(2, "two"))
    assert time.monotonic() - started < 5.0
    while len(server.bodies) < 2:
        time.sleep(0.01)
    hook.send(call(3, "three"))
    assert hook.notes.get(timeout=20) == (3, "arrived")


@pytest.mark.parametrize("patience", [QUICK])
def test_a_server_that_hangs_or_trickles_is_tried_again_and_given_up(hook, server):
    server.plans = [server.hang, server.trickle, server.hang]
    hook.send(call())
    assert outcome(hook) == ("did not arrive after 3 attempts: no answer within 0.5 s", 2)


def test_no_server_is_told_and_what_waits_is_bounded_and_given_up_at_the_end(server, caplog):
    notes = queue.Queue()
    url = f"http://127.0.0.1:{free_port()}/"
    webhook = Webhook(url, SECRET, "ippon", lambda *note: notes.put(note), QUICK)
    webhook.start()
    webhook.notes = notes
    webhook.send(call())
    text, again = outcome(webhook)
    assert (text.startswith("did not arrive after 3 attempts: "), again) == (True, 2)
    webhook.close()
    server.plans = [server.hang] * (MAX_WAITING + 1)
    webhook = Webhook(server.url, SECRET, "ippon", lambda *note: notes.put(note), Patience())
    webhook.start()
    for number in range(MAX_WAITING + 1):
        webhook.send(call(number))
    assert notes.get(timeout=20) == (32, "not sent: 32 calls wait for the webhook")
    started = time.monotonic()
    webhook.close()
    assert time.monotonic() - started < 4.0
    assert "32 calls had not arrived at the webhook" in caplog.text


def test_a_proxy_that_cannot_be_used_is_told_at_the_start(monkeypatch):
    monkeypatch.setenv("ALL_PROXY", "socks5://127.0.0.1:1")
    with pytest.raises(ConsoleError, match=r"the environment cannot be used: .*SOCKS"):
        Webhook("https://example.org", SECRET, "ippon", print)
    Webhook("http://127.0.0.1:1", SECRET, "ippon", print)._loop.close()


def test_what_nobody_expected_of_an_address_is_told():
    notes = queue.Queue()
    hook = Webhook(
        "http://xn--.invalid-\\u00e9..x/", SECRET, "r", lambda *note: notes.put(note), PATIENT
    )
    hook.start()
    hook.notes = notes
    hook.send(call())
    assert outcome(hook) == ("did not arrive after 3 attempts: InvalidCodepoint", 2)
    hook.close()


def test_the_secret_comes_from_a_file_or_the_environment(tmp_path):
    assert read_secret({"IPPON_NOTIFY_SECRET": " abc "}, None) == b"abc"
    file = tmp_path / "secret"
    file.write_text("def\n", encoding="utf-8")
    assert read_secret({"IPPON_NOTIFY_SECRET": "abc"}, file) == b"def"
    with pytest.raises(ConsoleError, match="set IPPON_NOTIFY_SECRET, or name a file"):
        read_secret({}, None)
    with pytest.raises(ConsoleError, match=r"no secret in .*: FileNotFoundError"):
        read_secret({}, tmp_path / "none")
    file.write_text("two words", encoding="utf-8")
    with pytest.raises(ConsoleError, match="must hold the secret alone"):
        read_secret({}, file)


@pytest.mark.parametrize(
    ("url", "problem"),
    [
        ("example.org/hook", "no scheme http or https"),
        ("ftp://example.org", "no scheme http or https"),
        ("http://", "or no host"),
        ("http://host:port/", "or no host"),
        ("https://anna:pw@example.org/", "takes no user and password"),
    ],
)
def test_an_address_that_cannot_work_is_refused_without_repeating_it(url, problem):
    with pytest.raises(ConsoleError, match=problem) as refused:
        ConsoleConfig(notify=url)
    assert url not in str(refused.value)


def test_a_secret_without_an_address_is_refused_and_a_path_is_not_shown(tmp_path):
    with pytest.raises(ConsoleError, match="name an address, too"):
        ConsoleConfig(notify_secret=tmp_path)
    assert place_of("https://example.org:8443/services/T0/x?y=z") == "https://example.org:8443"
