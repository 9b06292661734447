"""Ports for servers that tests start."""

import random
import socket
from typing import Final

_PORTS: Final = range(10_000, 32_000)
"""Below those that systems give to outgoing connections: one of these may take a port that was free
before the server listens on it."""


def free_port() -> int:
    """Return a loopback port that nobody listens on."""
    while True:
        port = random.Random().choice(_PORTS)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port


def free_endpoint() -> str:
    """Return a loopback endpoint of zenoh that nobody listens on."""
    return f"tcp/127.0.0.1:{free_port()}"
