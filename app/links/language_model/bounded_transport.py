"""HTTP that ends: a bound on the time and on the size of every answer, whoever sends it."""

import time
from collections.abc import Callable, Iterator

import httpx2


class BoundError(Exception):
    """An answer was given up."""


class AnswerTooLongError(BoundError):
    """The answer is longer than the transport takes."""


class AnswerTooLateError(BoundError):
    """The answer did not end within the time of its request."""


class AnswerCompressedError(BoundError):
    """The answer is compressed, although that was not asked for: its size could not be bounded."""


class BoundedTransport(httpx2.BaseTransport):
    """Passes requests on; their answers end at a deadline and at a size.

    A server that trickles never runs into the time-out of a single read, and an SDK that reads the
    body of an error reads all of it.
    """

    def __init__(
        self,
        inner: httpx2.Client,
        max_bytes: int,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._inner = inner
        self._max_bytes = max_bytes
        self._clock = clock

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        """Send a request; its read time-out counts for the whole answer."""
        deadline = self._clock() + float(request.extensions["timeout"]["read"])
        request.headers["Accept-Encoding"] = "identity"
        response = self._inner.send(request, stream=True)
        if response.headers.get("Content-Encoding", "identity").strip().lower() != "identity":
            response.close()
            raise AnswerCompressedError
        return httpx2.Response(
            response.status_code,
            headers=response.headers,
            stream=_BoundedStream(response, deadline, self._max_bytes, self._clock),
            extensions=response.extensions,
        )

    def close(self) -> None:
        """Close the connections."""
        self._inner.close()


class _BoundedStream(httpx2.SyncByteStream):
    def __init__(
        self,
        response: httpx2.Response,
        deadline: float,
        max_bytes: int,
        clock: Callable[[], float],
    ) -> None:
        self._response = response
        self._deadline = deadline
        self._max_bytes = max_bytes
        self._clock = clock

    def __iter__(self) -> Iterator[bytes]:
        received = 0
        for chunk in self._response.iter_raw():
            received += len(chunk)
            if received > self._max_bytes:
                raise AnswerTooLongError
            if self._clock() > self._deadline:
                raise AnswerTooLateError
            yield chunk

    def close(self) -> None:
        self._response.close()
