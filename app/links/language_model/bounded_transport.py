"""HTTP transport that bounds the duration and the size of every answer."""

import time
from collections.abc import Callable, Iterator

import httpx2


class BoundError(Exception):
    """An answer exceeded a bound."""


class AnswerTooLongError(BoundError):
    """The answer is longer than the limit."""


class AnswerTooLateError(BoundError):
    """The answer did not end within the time of its request."""


class AnswerCompressedError(BoundError):
    """The answer is compressed, although that was not asked for: its size could not be bounded."""


class BoundedTransport(httpx2.BaseTransport):
    """Forwards requests; ends their answers at a deadline and at a size.

    The timeout of a single read does not end an answer that arrives in small pieces, and an SDK
    reads the whole body of an error.
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
        """Send a request; its read timeout bounds the whole answer."""
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
