"""Bounds on connections: how many, and for how long one may say nothing."""

import asyncio
from collections import OrderedDict
from typing import Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol

MAX_IDLE: Final = 128
"""Connections that have not asked for anything yet, or not again; beyond, the oldest is dropped:
who floods the port loses his own, and a new_browser gets through."""
REQUEST_S: Final = 10.0
"""A request whose head is not complete by then is dropped."""


class BoundedProtocol(H11Protocol):
    """uvicorn's HTTP, which by itself waits for ever for a connection's first request."""

    def connection_made(self, transport: Any) -> None:
        """Take a connection, in place of the one that idles for longest where there are many."""
        super().connection_made(transport)
        self._deadline = self.loop.call_later(REQUEST_S, self._drop_if_silent)
        idle = _idle_of(self.server_state)
        idle[self] = transport
        # The ones in the middle of a request or a WebSocket are not idle: they stay.
        for other in list(idle):
            if len(idle) <= MAX_IDLE:
                break
            idle.pop(other)
            if _is_waiting(other):
                other.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self._deadline.cancel()
        _idle_of(self.server_state).pop(self, None)
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Hand over to the WebSocket: what follows has bounds of its own."""
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
