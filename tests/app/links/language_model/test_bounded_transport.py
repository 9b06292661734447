"""Endpoints that misbehave below HTTP: real sockets, one answer for each connection."""

import socket
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

import pytest

from tests import later

chat = later.module("app.links.language_model.chat")

LIMIT_S = 1.0
LONG_S = 20.0
"""How long a server would go on."""
Serve = Callable[[socket.socket], None]


@pytest.fixture
def serve() -> Iterator[Callable[..., Any]]:
    listener = socket.create_server(("127.0.0.1", 0))
    over, endpoints = threading.Event(), list[Any]()

    def start(answer: Serve, timeout_s: float = LIMIT_S) -> Any:
        def loop() -> None:
            while not over.is_set():
                with suppress(OSError):
                    connection, _ = listener.accept()
                    connection.recv(65536)
                    with connection, suppress(OSError):
                        answer(connection)

        threading.Thread(target=loop, daemon=True).start()
        url = f"http://127.0.0.1:{listener.getsockname()[1]}/v1"
        endpoints.append(
            chat.ChatEndpoint(chat.ChatConfig(base_url=url, model="m", timeout_s=timeout_s))
        )
        return endpoints[-1]

    yield start
    over.set()
    listener.shutdown(socket.SHUT_RDWR)
    listener.close()
    for endpoint in endpoints:
        endpoint.close()


def drip(data: bytes) -> Serve:
    def answer(connection: socket.socket) -> None:
        end = time.monotonic() + LONG_S
        connection.sendall(b"HTTP/1.1 200 OK\r\n")
        while time.monotonic() < end:
            connection.sendall(data)
            time.sleep(0.2)

    return answer


def flood(data: bytes) -> Serve:
    def answer(connection: socket.socket) -> None:
        end = time.monotonic() + LONG_S
        while time.monotonic() < end:
            connection.sendall(data)

    return answer


@pytest.mark.parametrize(
    "answer",
    [
        drip(b"X: y\r\n"),
        drip(b"\r\n" + b"x"),
        flood(b"HTTP/1.1 100 Continue\r\n\r\n"),
        lambda _: time.sleep(LONG_S),
    ],
    ids=["headers", "body", "continue", "silence"],
)
def test_no_answer_takes_longer_than_its_time(serve: Callable[..., Any], answer: Serve) -> None:
    endpoint = serve(answer)
    begun = time.monotonic()
    with pytest.raises(chat.ChatError):
        endpoint.ask(lambda _: [{"role": "user", "content": "?"}], {"type": "object"})
    assert time.monotonic() - begun < 0.5 * LONG_S


@pytest.mark.parametrize("begun", [b"", b"HTTP/1.1 200 OK\r\n\r\n{"], ids=["silence", "body"])
def test_closing_ends_a_request_that_waits(serve: Callable[..., Any], begun: bytes) -> None:
    asked, over = threading.Event(), threading.Event()

    def answer(connection: socket.socket) -> None:
        connection.sendall(begun)
        asked.set()
        over.wait(LONG_S)

    endpoint = serve(answer, timeout_s=600.0)
    question = [{"role": "user", "content": "?"}]
    with ThreadPoolExecutor(1) as pool:
        asking = pool.submit(endpoint.ask, lambda _: question, {"type": "object"})
        try:
            assert asked.wait(LONG_S)
            endpoint.close()
            error = asking.exception(timeout=0.5 * LONG_S)
        finally:
            over.set()
    assert str(error) == "the provider was closed"
