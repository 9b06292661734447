"""A process that sends messages as fast as it can: `python -m tests.app.flooder FILE`."""

import sys
import time
from pathlib import Path

import msgspec
import zenoh

from app.links.network.session import open_client


class Flood(msgspec.Struct, frozen=True, kw_only=True):
    """Messages that are sent in turn for a time."""

    endpoint: str
    seconds: float
    puts: list[tuple[str, bytes]] = []
    queries: list[tuple[str, bytes]] = []


def _ignore(_):
    pass


def _say(what):
    sys.stdout.write(f"{what}\n")
    sys.stdout.flush()


def run(flood):
    """Send, and return how many messages were sent."""
    session = open_client(flood.endpoint, 30.0)
    publishers = [
        # Blocking: at the rate at which the other side receives, and not one lost on this side.
        (session.declare_publisher(key, congestion_control=zenoh.CongestionControl.BLOCK), payload)
        for key, payload in flood.puts
    ]
    ignore = zenoh.handlers.Callback(_ignore, indirect=False)
    _say("floods")
    until, sent = time.monotonic() + flood.seconds, 0
    while time.monotonic() < until:
        for publisher, payload in publishers:
            publisher.put(payload)
        for key, payload in flood.queries:
            session.get(key, ignore, payload=payload, timeout=2.0)
        sent += len(publishers) + len(flood.queries)
    session.close()
    return sent


if __name__ == "__main__":
    _say(run(msgspec.json.decode(Path(sys.argv[1]).read_bytes(), type=Flood)))
