"""Real zenoh sessions over loopback."""

import socket
from collections.abc import Iterator

import pytest
import zenoh

from app.links.session import open_client, open_router


@pytest.fixture
def free_endpoint() -> str:
    """Return a loopback endpoint that nobody listens on."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{listener.getsockname()[1]}"


@pytest.fixture
def sessions(free_endpoint: str) -> Iterator[tuple[zenoh.Session, zenoh.Session]]:
    """Yield a router on a free loopback port, and a client of it."""
    router = open_router(free_endpoint)
    client = open_client(free_endpoint)
    yield router, client
    client.close()
    router.close()
