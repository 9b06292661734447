"""Requests over zenoh: a JSON message in, a JSON message out, always a reply."""

import itertools
import logging
import time
from collections.abc import Callable
from typing import Any, TypeVar

import msgspec
import zenoh

from app.links.session import LinkError
from app.messages import keys
from app.messages.control import ErrorReply, M, decode, encode
from app.messages.recording import Exchange

logger = logging.getLogger(__name__)

R = TypeVar("R", bound=msgspec.Struct)

MAX_QUOTED = 500
"""Bytes of a malformed request that its record keeps."""


class RequestRefusedError(Exception):
    """The request was understood and cannot be met; the text says why."""


def serve(
    session: zenoh.Session, key: str, kind: type[M], handle: Callable[[M], msgspec.Struct]
) -> "zenoh.Queryable[None]":
    """Answer requests on a key; what is malformed or refused gets an `ErrorReply`.

    Args:
        session: An open session.
        key: Key of the requests.
        kind: What a request must be.
        handle: Returns the reply, or raises `RequestRefusedError`. Called in a thread of zenoh:
            it must be quick.

    What was asked and answered is published on `key`/exchange, for those who record. There a
    message may be lost behind a slow listener, which its number shows: a Stop never waits for one.
    """
    numbers = itertools.count(1)
    exchanges = session.declare_publisher(
        f"{key}/{keys.EXCHANGE}", congestion_control=zenoh.CongestionControl.DROP
    )

    def answer(query: zenoh.Query) -> None:
        payload = query.payload.to_bytes() if query.payload is not None else b""
        with query:
            reply = encode(_reply_to(query, kind, handle))
            query.reply(key, reply, encoding=zenoh.Encoding.APPLICATION_JSON)
        exchanges.put(_exchange(next(numbers), payload, reply))

    return session.declare_queryable(key, answer)


def _exchange(number: int, payload: bytes, reply: bytes) -> bytes:
    """Write an exchange; a request that is no JSON stands in it as text."""
    try:
        msgspec.json.decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError):
        payload = msgspec.json.encode(payload[:MAX_QUOTED].decode(errors="replace"))
    return encode(
        Exchange(
            number=number,
            wall_ns=time.time_ns(),
            request=msgspec.Raw(payload),
            reply=msgspec.Raw(reply),
        )
    )


def _reply_to(
    query: zenoh.Query, kind: type[M], handle: Callable[[M], msgspec.Struct]
) -> msgspec.Struct:
    payload = query.payload.to_bytes() if query.payload is not None else b""
    try:
        return handle(decode(payload, kind))
    except msgspec.DecodeError as error:
        fields = ", ".join(field.name for field in msgspec.structs.fields(kind))
        return ErrorReply(
            error=f"not a {kind.__name__} ({error}); it is a JSON object with: {fields}"
        )
    except RequestRefusedError as error:
        return ErrorReply(error=str(error))
    except Exception:  # The asker must get an answer whatever is wrong here.
        logger.exception("request on %s", query.key_expr)
        return ErrorReply(error="the navigator failed to handle this request; see its log")


def ask(
    session: zenoh.Session, key: str, message: msgspec.Struct, kind: type[R], timeout_s: float
) -> R:
    """Send a request and return its reply.

    Raises:
        RequestRefusedError: The other side says what is wrong.
        LinkError: No reply, or one that is not understood.
    """
    replies: Any = session.get(
        key,
        payload=encode(message),
        encoding=zenoh.Encoding.APPLICATION_JSON,
        timeout=timeout_s,
        priority=zenoh.Priority.REAL_TIME,
    )
    for reply in replies:
        sample = reply.ok if reply.ok is not None else reply.err
        payload = sample.payload.to_bytes()
        try:
            return decode(payload, kind)
        except msgspec.DecodeError as error:
            try:
                refused = decode(payload, ErrorReply)
            except msgspec.DecodeError:
                raise LinkError(f"the reply on {key} is not understood: {error}") from error
            raise RequestRefusedError(refused.error) from None
    raise LinkError(f"no reply on {key} within {timeout_s:g} s")


def last_message(session: zenoh.Session, key: str, timeout_s: float) -> bytes | None:
    """Return what was published last on a latched key, None when nobody answers."""
    replies: Any = session.get(key, timeout=timeout_s)
    for reply in replies:
        if reply.ok is not None:
            return reply.ok.payload.to_bytes()
    return None
