"""Child processes that end with the command that started them."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from typing import Final

GRACE_S: Final = 5.0
PROGRAM: Final = (sys.executable, "-P", "-m", "app")
"""Command line of this program; -P keeps a folder `app` in the working directory from shadowing
it."""


class Child:
    """One process of this program, in a process group of its own."""

    def __init__(
        self, name: str, arguments: Sequence[str], environment: Mapping[str, str] | None = None
    ) -> None:
        """Start the process, with variables that differ from those of this process."""
        self.name = name
        self.stopped = False
        """`stop` was called."""
        # In a session of its own, so that Ctrl-C reaches only the parent, which ends the children
        # in order.
        self._process = subprocess.Popen(  # noqa: S603 (this program itself)
            [*PROGRAM, *arguments, "--parent-pid", str(os.getpid())],
            start_new_session=True,
            env={**os.environ, **(environment or {})},
            stdin=subprocess.DEVNULL,
            stdout=sys.stderr,
        )

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def ended(self) -> int | None:
        """Return the exit status, None while the process runs."""
        return self._process.poll()

    def wait(self) -> int:
        """Wait for the end and return the exit status, negative for a signal."""
        return self._process.wait()

    def stop(self) -> None:
        """Terminate the process; kill it if it does not end."""
        self.stopped = True
        if self._process.poll() is not None:
            return
        with contextlib.suppress(ProcessLookupError):
            self._process.terminate()
        try:
            self._process.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()


def wait_for_end(children: Sequence[Child], seconds: float) -> Child | None:
    """Wait at most `seconds` and return the first child that has ended."""
    deadline = time.monotonic() + seconds
    while True:
        for child in children:
            if child.ended() is not None:
                return child
        if time.monotonic() >= deadline:
            return None
        time.sleep(0.05)


def free_port(first: int, tries: int = 100) -> int:
    """Return the first free port of 127.0.0.1 from `first` on.

    Raises:
        OSError: None of `tries` ports is free.
    """
    for port in range(first, first + tries):
        if port_is_free(port):
            return port
    raise OSError(f"no free port among {first} to {first + tries - 1}")


def port_is_free(port: int) -> bool:
    """Return whether a port of 127.0.0.1 is free."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True
