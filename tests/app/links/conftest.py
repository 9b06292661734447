"""A chat endpoint on loopback that does what a test tells it."""

import json
import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from ippon.guidance.prior import PROVIDER
from ippon.vocabulary import MATTERPORT_40
from tests import later

ChatConfig = later.names("app.links.language_model.chat", "ChatConfig")
LanguageModel = later.names("app.links.language_model.language_model", "LanguageModel")

KEY = "sk-very-secret-0123456789"
OBJECT = json.dumps({label: {"reason": "because", "level": "NEAR"} for label in MATTERPORT_40})

Make = Callable[..., Any]
Script = Callable[["ChatServer", dict[str, Any], BaseHTTPRequestHandler], None]


class ChatServer:
    """Keeps every request and answers by `script`."""

    def __init__(self) -> None:
        self.requests: list[dict[str, Any]] = []
        self.headers: list[dict[str, str]] = []
        self.script: Script = say("")
        self.stopped = threading.Event()
        server = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                length = int(self.headers["Content-Length"])
                body = json.loads(self.rfile.read(length))
                server.requests.append(body)
                server.headers.append({name.title(): value for name, value in self.headers.items()})
                server.script(server, body, self)

            def log_message(self, format: str, *args: object) -> None:  # noqa: A002
                pass

        self._http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._http.daemon_threads = True
        self._thread = threading.Thread(target=self._http.serve_forever, args=(0.02,))
        self._thread.start()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self._http.server_address[1]}/v1"

    def close(self) -> None:
        self.stopped.set()
        self._http.shutdown()
        self._thread.join()
        self._http.server_close()


def send(handler: BaseHTTPRequestHandler, status: int, body: bytes, **headers: str) -> None:
    handler.send_response(status)
    handler.send_header("Content-Length", str(len(body)))
    for name, value in headers.items():
        handler.send_header(name.replace("_", "-"), value)
    handler.end_headers()
    handler.wfile.write(body)


def completion(text: str | None, **message: object) -> bytes:
    choice = {"message": {"role": "assistant", "content": text, **message}, "finish_reason": "stop"}
    return json.dumps({"id": "x", "object": "chat.completion", "choices": [choice]}).encode()


def say(*texts: str) -> Script:
    """Answer with one text after the other; the last one again and again."""

    def script(server: ChatServer, _: dict[str, Any], handler: BaseHTTPRequestHandler) -> None:
        text = texts[min(len(server.requests), len(texts)) - 1]
        send(handler, 200, completion(text))

    return script


@pytest.fixture
def chat_server() -> Iterator[ChatServer]:
    server = ChatServer()
    yield server
    server.close()


@pytest.fixture
def speak() -> Callable[..., Script]:
    return say


@pytest.fixture
def reply_with() -> Callable[..., Script]:
    """Answer with raw status and body."""

    def make(status: int, body: bytes, **headers: str) -> Script:
        def script(_: ChatServer, __: dict[str, Any], handler: BaseHTTPRequestHandler) -> None:
            send(handler, status, body, **headers)

        return script

    return make


@pytest.fixture
def completed() -> Callable[..., bytes]:
    return completion


@pytest.fixture
def make_model(chat_server: Any) -> Iterator[Make]:
    made: list[Any] = []

    def make(timeout_s: float = 120.0, cache_dir: Path | None = None, **config: Any) -> Any:
        settings = {"base_url": chat_server.url, "model": "tiny", "api_key": KEY} | config
        made.append(LanguageModel(ChatConfig(timeout_s=timeout_s, **settings), cache_dir=cache_dir))
        return made[-1]

    yield make
    for model in made:
        model.close()


def is_prior(answer: Any) -> bool:
    return answer.guidance.provider == PROVIDER and bool(answer.failed)
