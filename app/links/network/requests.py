"""Requests over zenoh: a JSON request and a JSON reply, a refusal where too many wait."""

import itertools
import logging
import time
from collections.abc import Callable
from typing import Any, TypeVar

import msgspec
import zenoh

from app.links.network.query_queue import RATE_HZ, QueryQueue
from app.links.network.session import LinkError
from app.messages import keys
from app.messages.control import ControlRequest, ErrorReply, M, decode, encode, is_stop
from app.messages.lease import Credential
from app.messages.recording import Exchange

logger = logging.getLogger(__name__)

R = TypeVar("R", bound=msgspec.Struct)

Authorize = Callable[[msgspec.Struct, Credential | None], None]
"""Accepts a request, or raises `RequestRefusedError`."""

MAX_QUOTED = 500
"""Bytes of a malformed request that its record keeps."""
_TIMED_OUT = b"Timeout"
"""Error reply of zenoh at a timeout."""
_AGAIN_S = 0.1
_MOST_STOP_BYTES = 1000


class RequestRefusedError(Exception):
    """A valid request was refused; the text says why."""


def allow_all(_: msgspec.Struct, __: Credential | None) -> None:
    """Accept every request."""


def serve(
    session: zenoh.Session,
    key: str,
    kind: type[M],
    handle: Callable[[M], msgspec.Struct],
    authorize: Authorize = allow_all,
    on_stop: Callable[[], None] | None = None,
) -> QueryQueue:
    """Answer requests on a key; malformed, refused and too frequent ones get an `ErrorReply`.

    Args:
        session: An open session.
        key: Key of the requests.
        kind: What a request must be.
        handle: Returns the reply, or raises `RequestRefusedError`. Called in the thread of the
            key, which answers one request at a time.
        authorize: Checks the request and its credential before `handle` is called.
        on_stop: Called in zenoh's network thread when a Stop comes, before its turn in the thread
            of the key: it must return at once and not use the session.

    Request and reply are published on `key`/exchange, for recordings. A slow subscriber may lose
    one, which shows in its number; a Stop never waits for a subscriber, nor behind other requests.
    """

    def handle_permitted(message: M, who: Credential | None) -> msgspec.Struct:
        authorize(message, who)
        return handle(message)

    return serve_with_credential(session, key, kind, handle_permitted, on_stop)


def serve_with_credential(
    session: zenoh.Session,
    key: str,
    kind: type[M],
    handle: Callable[[M, Credential | None], msgspec.Struct],
    on_stop: Callable[[], None] | None = None,
) -> QueryQueue:
    """Answer requests on a key as `serve` does; the handler gets the credential as well."""
    numbers = itertools.count(1)
    exchanges = session.declare_publisher(
        f"{key}/{keys.EXCHANGE}", congestion_control=zenoh.CongestionControl.DROP
    )

    def answer(query: zenoh.Query) -> None:
        payload = query.payload.to_bytes() if query.payload is not None else b""
        with query:
            who, answered = _answer(query, payload, kind, handle)
            reply = encode(answered)
            query.reply(key, reply, encoding=zenoh.Encoding.APPLICATION_JSON)
        name = who.name if who is not None else ""
        exchanges.put(_exchange(next(numbers), name, payload, reply))

    busy = encode(
        ErrorReply(
            error=f"more than {RATE_HZ:g} requests a second come on {key}: this one is refused; "
            "try again when they have ended. Stop is always accepted"
        )
    )

    def refuse(query: zenoh.Query) -> None:
        with query:
            query.reply(key, busy, encoding=zenoh.Encoding.APPLICATION_JSON)

    def stops(query: zenoh.Query) -> bool:
        urgent = _is_stop(query)
        if urgent and on_stop is not None:
            on_stop()
        return urgent

    return QueryQueue(session, key, answer, refuse, stops if kind is ControlRequest else None)


def _is_stop(query: zenoh.Query) -> bool:
    """Return whether a query is a well-formed request to stop."""
    payload = b"" if query.payload is None else query.payload.to_bytes()
    if len(payload) > _MOST_STOP_BYTES or b'"stop"' not in payload:
        return False
    try:
        return is_stop(decode(payload, ControlRequest))
    except msgspec.DecodeError:
        return False


def _exchange(number: int, name: str, payload: bytes, reply: bytes) -> bytes:
    """Encode an exchange; a request that is not JSON is included as text."""
    try:
        msgspec.json.decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        payload = msgspec.json.encode(payload[:MAX_QUOTED].decode(errors="replace"))
    return encode(
        Exchange(
            number=number,
            wall_ns=time.time_ns(),
            name=name,
            request=msgspec.Raw(payload),
            reply=msgspec.Raw(reply),
        )
    )


def _answer(
    query: zenoh.Query,
    payload: bytes,
    kind: type[M],
    handle: Callable[[M, Credential | None], msgspec.Struct],
) -> tuple[Credential | None, msgspec.Struct]:
    """Return the credential, if there is one, and the reply."""
    who = None
    try:
        message = decode(payload, kind)
        try:
            who = _credential(query)
        except RequestRefusedError:
            # Stop is accepted from everyone, so also with a credential of another version.
            if not is_stop(message):
                raise
        return who, handle(message, who)
    except msgspec.DecodeError as error:
        fields = ", ".join(field.name for field in msgspec.structs.fields(kind))
        text = f"not a {kind.__name__} ({error}); it is a JSON object with: {fields}"
        return who, ErrorReply(error=text)
    except RequestRefusedError as error:
        return who, ErrorReply(error=str(error))
    except Exception:  # The requester must get a reply to every request.
        logger.exception("request on %s", query.key_expr)
        text = "the navigator failed to handle this request; see its log"
        return who, ErrorReply(error=text)


def _credential(query: zenoh.Query) -> Credential | None:
    if query.attachment is None:
        return None
    try:
        return decode(query.attachment.to_bytes(), Credential)
    except msgspec.DecodeError as error:
        fields = ", ".join(field.name for field in msgspec.structs.fields(Credential))
        raise RequestRefusedError(
            f"the attachment is not a Credential ({error}); it is a JSON object with: {fields}"
        ) from error


def ask(
    session: zenoh.Session,
    key: str,
    message: msgspec.Struct,
    kind: type[R],
    timeout_s: float,
    who: Credential | None = None,
) -> R:
    """Send a request, with a credential if given, and return its reply.

    It is sent once: after a broken connection it is unknown whether it was accepted.

    Raises:
        RequestRefusedError: The request was refused.
        LinkError: No reply, or one that cannot be decoded.
    """
    replies: Any = session.get(
        key,
        payload=encode(message),
        attachment=encode(who) if who is not None else None,
        encoding=zenoh.Encoding.APPLICATION_JSON,
        timeout=timeout_s,
        priority=zenoh.Priority.REAL_TIME,
    )
    for reply in replies:
        sample = reply.ok if reply.ok is not None else reply.err
        payload = sample.payload.to_bytes()
        if reply.ok is None and payload == _TIMED_OUT:
            raise LinkError(f"no reply on {key} within {timeout_s:g} s")
        try:
            return decode(payload, kind)
        except msgspec.DecodeError as error:
            try:
                refused = decode(payload, ErrorReply)
            except msgspec.DecodeError:
                raise LinkError(f"the reply on {key} is not understood: {error}") from error
            raise RequestRefusedError(refused.error) from None
    # zenoh reports this without waiting.
    raise LinkError(
        f"no reply on {key} within {timeout_s:g} s: there is no such endpoint; the navigator may "
        f"still be compiling, or may have another prefix"
    )


def last_message(session: zenoh.Session, key: str, timeout_s: float) -> bytes | None:
    """Return the last message of a latched topic, None without a reply."""
    replies: Any = session.get(key, timeout=timeout_s)
    for reply in replies:
        if reply.ok is not None:
            return reply.ok.payload.to_bytes()
    return None


def ask_until_answered(
    session: zenoh.Session, key: str, message: msgspec.Struct, kind: type[R], timeout_s: float
) -> R:
    """Send a request that may be carried out more than once, such as Stop, until it is answered.

    A line that breaks under load is open again a moment later.

    Raises:
        RequestRefusedError: The request was refused.
        LinkError: No reply within the time.
    """
    deadline, left_s = time.monotonic() + timeout_s, timeout_s
    problem: LinkError | None = None
    while problem is None or left_s > 0.0:
        try:
            return ask(session, key, message, kind, left_s)
        except LinkError as error:
            problem = problem or error
        time.sleep(_AGAIN_S)
        left_s = deadline - time.monotonic()
    raise problem
