"""Requests over zenoh: a JSON message in, a JSON message out, always a reply."""

import logging
from collections.abc import Callable
from typing import Any, TypeVar

import msgspec
import zenoh

from app.links.session import LinkError
from app.messages.control import ErrorReply, M, decode, encode

logger = logging.getLogger(__name__)

R = TypeVar("R", bound=msgspec.Struct)


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
    """

    def answer(query: zenoh.Query) -> None:
        with query:
            reply = _reply_to(query, kind, handle)
            query.reply(key, encode(reply), encoding=zenoh.Encoding.APPLICATION_JSON)

    return session.declare_queryable(key, answer)


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
