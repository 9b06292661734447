"""HTTP transport that bounds the duration and the size of every answer, and can be closed."""

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import httpx2


class BoundError(Exception):
    """An answer exceeded a bound."""


class AnswerTooLongError(BoundError):
    """The answer is longer than the limit."""


class AnswerTooLateError(BoundError):
    """The answer did not end within the time of its request."""


class AnswerCompressedError(BoundError):
    """The answer is compressed, although that was not asked for: its size could not be bounded."""


class ClosedError(BoundError):
    """The transport was closed."""


class BoundedTransport(httpx2.BaseTransport):
    """Forwards requests; ends their answers at a deadline and at a size.

    The timeout of a single read does not end an answer, nor its headers, that arrive in small
    pieces, and an SDK reads the whole body of an error. The inner client must not keep connections
    alive: each is cut at the deadline of its request.
    """

    def __init__(self, inner: httpx2.Client, max_bytes: int) -> None:
        self._inner = inner
        self._max_bytes = max_bytes
        self._lock = threading.Lock()
        self._live: set[_Deadline] = set()
        """Those of the requests under way."""
        self._closed = False

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        """Send a request; its read timeout bounds the whole answer."""
        deadline = self._begin(float(request.extensions["timeout"]["read"]))
        request.extensions = {**request.extensions, "trace": deadline.trace}
        request.headers["Accept-Encoding"] = "identity"
        try:
            response = self._inner.send(request, stream=True)
        except httpx2.TransportError:
            deadline.cancel()
            if deadline.over is not None:
                raise deadline.over from None
            raise
        if response.headers.get("Content-Encoding", "identity").strip().lower() != "identity":
            deadline.cancel()
            response.close()
            raise AnswerCompressedError
        return httpx2.Response(
            response.status_code,
            headers=response.headers,
            stream=_BoundedStream(response, deadline, self._max_bytes),
            extensions=response.extensions,
        )

    def close(self) -> None:
        """Close the connections; requests under way fail with `ClosedError`."""
        with self._lock:
            self._closed = True
            live = tuple(self._live)
        # Closing a socket does not wake the thread that waits for it to receive.
        for deadline in live:
            deadline.cut(ClosedError)
        self._inner.close()

    def _begin(self, left_s: float) -> "_Deadline":
        with self._lock:
            if self._closed:
                raise ClosedError
            deadline = _Deadline(left_s, self._live.discard)
            self._live.add(deadline)
        return deadline


class _Deadline:
    """Cuts the connection of one request when its time is over."""

    def __init__(self, left_s: float, on_end: Callable[["_Deadline"], None]) -> None:
        self.over: type[BoundError] | None = None
        """Why the connection was cut."""
        self._on_end = on_end
        self._socket: socket.socket | None = None
        self._timer = threading.Timer(left_s, self.cut, (AnswerTooLateError,))
        self._timer.daemon = True
        self._timer.start()

    def cancel(self) -> None:
        """Let the connection be."""
        self._timer.cancel()
        self._on_end(self)

    def trace(self, event: str, info: dict[str, Any]) -> None:
        """Note the connection of the request; the HTTP client tells of it."""
        # Through a proxy, the events of TLS begin with "proxy." or "socks.".
        if event.endswith((".connect_tcp.complete", ".start_tls.complete")):
            self._socket = info["return_value"].get_extra_info("socket")
            self._shut()

    def cut(self, why: type[BoundError]) -> None:
        """Cut the connection, now or as soon as there is one."""
        self.over = self.over or why
        self._shut()

    def _shut(self) -> None:
        if self.over is not None and self._socket is not None:
            with suppress(OSError):  # It is closed already.
                self._socket.shutdown(socket.SHUT_RDWR)


class _BoundedStream(httpx2.SyncByteStream):
    def __init__(self, response: httpx2.Response, deadline: _Deadline, max_bytes: int) -> None:
        self._response = response
        self._deadline = deadline
        self._max_bytes = max_bytes

    def __iter__(self) -> Iterator[bytes]:
        received = 0
        try:
            for chunk in self._response.iter_raw():
                received += len(chunk)
                if received > self._max_bytes:
                    raise AnswerTooLongError
                yield chunk
        except httpx2.TransportError:
            if self._deadline.over is None:
                raise
        if self._deadline.over is not None:
            raise self._deadline.over  # What ends with its connection may be a part.

    def close(self) -> None:
        self._deadline.cancel()
        self._response.close()
