"""Endpoints that misbehave below HTTP: real sockets, one answer for each connection."""

import socket
import ssl
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

import httpx2
import pytest
import trustme

from tests import later

chat = later.module("app.links.language_model.chat")
bounded = later.module("app.links.language_model.bounded_transport")

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


@pytest.fixture
def tunnel() -> Iterator[tuple[Any, threading.Event]]:
    """A client through a proxy whose endpoint begins an answer over TLS, and when it has."""
    listener = socket.create_server(("127.0.0.1", 0))
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    trustme.CA().issue_cert("llm.example").configure_cert(context)
    begun, over = threading.Event(), threading.Event()

    def serve() -> None:
        with suppress(OSError):
            plain, _ = listener.accept()
            plain.recv(65536)  # CONNECT
            plain.sendall(b"HTTP/1.1 200 OK\r\n\r\n")
            with context.wrap_socket(plain, server_side=True) as connection:
                connection.recv(65536)
                connection.sendall(b"HTTP/1.1 200 OK\r\n\r\n{")
                begun.set()
                while not over.wait(0.2):
                    connection.sendall(b" ")

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    proxy = f"http://127.0.0.1:{listener.getsockname()[1]}"
    unkept = httpx2.Limits(max_keepalive_connections=0)
    unverified = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    unverified.check_hostname, unverified.verify_mode = False, ssl.CERT_NONE
    inner = httpx2.Client(proxy=proxy, verify=unverified, trust_env=False, limits=unkept)
    with httpx2.Client(transport=bounded.BoundedTransport(inner, 1_000_000)) as client:
        yield client, begun
    over.set()
    listener.close()
    thread.join(LONG_S)


def test_an_answer_through_a_proxy_ends_in_time(tunnel: tuple[Any, threading.Event]) -> None:
    client, _ = tunnel
    start = time.monotonic()
    with pytest.raises(bounded.AnswerTooLateError):
        client.get("https://llm.example/v1", timeout=LIMIT_S)
    assert time.monotonic() - start < 0.5 * LONG_S


def test_closing_ends_a_request_through_a_proxy(tunnel: tuple[Any, threading.Event]) -> None:
    client, begun = tunnel
    with ThreadPoolExecutor(1) as pool:
        asking = pool.submit(client.get, "https://llm.example/v1", timeout=LONG_S)
        assert begun.wait(LONG_S)
        client.close()
        error = asking.exception(timeout=0.5 * LONG_S)
    assert isinstance(error, bounded.ClosedError)
