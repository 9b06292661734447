"""Bounds on connections: their number, and how long one may be silent."""

import asyncio
from collections import OrderedDict
from typing import Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol

MAX_IDLE: Final = 128
"""Maximum number of connections without a pending request; beyond it the oldest is dropped, so that
new connections succeed while the port is flooded."""
REQUEST_S: Final = 10.0
"""Time after which a request with an incomplete head is dropped."""


class BoundedProtocol(H11Protocol):
    """uvicorn's HTTP protocol with a time limit for the first request of a connection."""

    def connection_made(self, transport: Any) -> None:
        """Accept a connection; if there are too many, drop the longest idle one."""
        super().connection_made(transport)
        self._deadline = self.loop.call_later(REQUEST_S, self._drop_if_silent)
        idle = _idle_of(self.server_state)
        idle[self] = transport
        # Connections with a pending request or a WebSocket are not idle.
        for other in list(idle):
            if len(idle) <= MAX_IDLE:
                break
            idle.pop(other)
            if _is_waiting(other):
                other.transport.abort()

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


def _is_waiting(protocol: H11Protocol) -> bool:
    return not protocol.cycle or protocol.cycle.response_complete


def _idle_of(server_state: Any) -> OrderedDict[BoundedProtocol, asyncio.Transport]:
    """Return the idle connections of one server, which share its state."""
    idle = getattr(server_state, "ippon_idle", None)
    if idle is None:
        idle = server_state.ippon_idle = OrderedDict()
    return idle
