"""Bounds on connections: their number, and how long one may be silent."""

import asyncio
import ssl
from collections import OrderedDict
from typing import Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol

MAX_IDLE: Final = 128
"""Maximum number of connections without a pending request; beyond it the oldest is dropped, so that
new connections succeed while the port is flooded."""
REQUEST_S: Final = 10.0
"""Time after which a TLS handshake, or a request with an incomplete head, is dropped."""


class BoundedProtocol(H11Protocol):
    """uvicorn's HTTP protocol with a time limit for the first request of a connection."""

    def connection_made(self, transport: Any) -> None:
        """Accept a connection; if there are too many, drop the longest idle one."""
        super().connection_made(transport)
        self._deadline = self.loop.call_later(REQUEST_S, self._drop_if_silent)
        _bound(self, transport)

    def connection_lost(self, exc: Exception | None) -> None:
        """Remove the connection."""
        self._deadline.cancel()
        _idle_of(self.server_state).pop(self, None)
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Pass the connection to the WebSocket, which has its own bounds."""
        self._deadline.cancel()
        _idle_of(self.server_state).pop(self, None)
        super().handle_websocket_upgrade(event)

    def _drop_if_silent(self) -> None:
        if not self.cycle:
            self.transport.abort()


class TlsProtocol(asyncio.Protocol):
    """The TLS handshake of a connection that `BoundedProtocol` serves; it counts as idle.

    A server that is given the context itself tells of a connection after its handshake only, and
    waits a minute for any number of them.
    """

    def __init__(self, context: ssl.SSLContext, **parts: Any) -> None:
        self._context = context
        self._served = BoundedProtocol(**parts)

    def connection_made(self, transport: Any) -> None:
        """Begin the handshake."""
        self._task = asyncio.get_running_loop().create_task(self._encrypt(transport))

    async def _encrypt(self, transport: asyncio.Transport) -> None:
        first, served = _FirstBytes(), self._served
        _bound(served, transport)
        try:
            encrypted = await asyncio.get_running_loop().start_tls(
                transport, first, self._context, server_side=True, ssl_handshake_timeout=REQUEST_S
            )
        except OSError:
            return
        finally:
            _idle_of(served.server_state).pop(served, None)
        if encrypted is None:
            return  # It was closed meanwhile.
        encrypted.set_protocol(served)
        served.connection_made(encrypted)
        if first.data:
            served.data_received(first.data)


class _FirstBytes(asyncio.Protocol):
    """Receives what comes with the end of a handshake, before the connection is served."""

    data = b""

    def data_received(self, data: bytes) -> None:
        """Keep the bytes."""
        self.data += data


def _bound(protocol: BoundedProtocol, transport: asyncio.Transport) -> None:
    """Count a connection, and drop the oldest ones that are silent if there are too many."""
    idle = _idle_of(protocol.server_state)
    idle[protocol] = transport
    # Connections with a pending request or a WebSocket are not idle.
    waiting = [other for other in idle if _is_waiting(other)]
    for other in waiting[:-MAX_IDLE]:
        idle.pop(other).abort()


def _is_waiting(protocol: H11Protocol) -> bool:
    return not protocol.cycle or protocol.cycle.response_complete


def _idle_of(server_state: Any) -> OrderedDict[BoundedProtocol, asyncio.Transport]:
    """Return the idle connections of one server, which share its state."""
    idle = getattr(server_state, "ippon_idle", None)
    if idle is None:
        idle = server_state.ippon_idle = OrderedDict()
    return idle
