"""Ports for servers that tests start, and domains for their ROS 2."""

import itertools
import os
import random
import socket
from collections.abc import Iterator
from typing import Final

_UNSAFE: Final = 10_080
"""Browsers open no page at this port and at some below it (the bad ports of the Fetch standard)."""
_PORTS: Final = range(_UNSAFE + 1, 32_000)
"""Below those that systems give to outgoing connections: one of these may take a port that was free
before the server listens on it."""
_DOMAINS: Final = range(1, 100)
_FIRST_OF_DDS: Final = 7410
_PER_DOMAIN: Final = 250
"""The first process in a domain of ROS 2 listens on UDP port 7410 + 250 * domain."""
_WORKERS: Final = 8


def own_numbers(numbers: range, worker: str) -> list[int]:
    """Return the part of a range that a worker of pytest uses alone.

    A server listens seconds after its port was chosen, and no probe shows that another worker has
    chosen the same one meanwhile.

    Args:
        numbers: What all workers share.
        worker: Its name, such as "gw2"; empty where there is one process alone.
    """
    number = int(worker.removeprefix("gw")) % _WORKERS if worker else _WORKERS - 1
    return list(numbers[number::_WORKERS])


def _in_turn(numbers: range) -> Iterator[int]:
    """Yield the numbers of this worker again and again, from a random one on.

    Another run of the tests on this machine begins elsewhere.
    """
    own = own_numbers(numbers, os.environ.get("PYTEST_XDIST_WORKER", ""))
    first = random.Random().randrange(len(own))
    return itertools.cycle(own[first:] + own[:first])


_ports, _domains = _in_turn(_PORTS), _in_turn(_DOMAINS)


def free_port() -> int:
    """Return a loopback port that nobody listens on and that no other test was given."""
    return next(port for port in _ports if _is_free(port, socket.SOCK_STREAM))


def free_endpoint() -> str:
    """Return a loopback endpoint of zenoh that nobody listens on."""
    return f"tcp/127.0.0.1:{free_port()}"


def free_domain() -> int:
    """Return a domain of ROS 2 without processes, and that no other test was given."""
    return next(
        domain
        for domain in _domains
        if _is_free(_FIRST_OF_DDS + _PER_DOMAIN * domain, socket.SOCK_DGRAM)
    )


def _is_free(port: int, kind: socket.SocketKind) -> bool:
    with socket.socket(type=kind) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
        return True
