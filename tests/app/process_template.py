"""Starts processes of the product as copies of one that has its imports and kernels.

Imports and kernels take two seconds of a core, and the tests start a hundred processes. What a
process starts itself begins as for users, with an interpreter of its own: so do all processes of
the demo.
"""

import atexit
import faulthandler
import functools
import gc
import importlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from typing import Final

import psutil

from tests.locations import ROOT

COMMANDS: Final = ("navigate", "sim", "console")
"""Commands that the template is ready for."""
_CHUNK: Final = 65536
_POLL_S: Final = 0.01


class Copy:
    """A process of the product, copied from the template; used as a `subprocess.Popen` is."""

    def __init__(
        self, arguments: Sequence[str], stdout: int, stderr: int, environment: Mapping[str, str]
    ) -> None:
        """Start `ippon ...`.

        Args:
            arguments: The command line.
            stdout: File descriptor to write to; `subprocess.PIPE` for `communicate` to read.
            stderr: File descriptor to write to.
            environment: All variables.
        """
        self.args, self.returncode = list(arguments), None
        self._output, self._said = None, b""
        if stdout == subprocess.PIPE:
            self._output, stdout = os.pipe()
        request = {"arguments": self.args, "environment": dict(environment)}
        self.pid: int = _template().ask(request, stdout, stderr)
        if self._output is not None:
            os.close(stdout)

    def poll(self) -> int | None:
        """Return the exit status, negative for a signal; None while the process runs."""
        if self.returncode is None:
            self.returncode = _template().ask({"ended": self.pid})
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the end; return the exit status."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while (status := self.poll()) is None:
            if deadline is not None and time.monotonic() > deadline:
                raise subprocess.TimeoutExpired(self.args, timeout or 0.0)
            time.sleep(_POLL_S)
        return status

    def communicate(self, timeout: float | None = None) -> tuple[str, None]:
        """Wait for the end; return all that was written to standard output."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while self._output is not None:
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            if not select.select([self._output], [], [], left)[0]:
                raise subprocess.TimeoutExpired(self.args, timeout or 0.0)
            said = os.read(self._output, _CHUNK)
            self._said += said
            if not said:
                os.close(self._output)
                self._output = None
        self.wait(None if deadline is None else max(0.0, deadline - time.monotonic()))
        return self._said.decode(), None

    def send_signal(self, number: int) -> None:
        """Send a signal, unless the process has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def terminate(self) -> None:
        """Send SIGTERM."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """Send SIGKILL."""
        self.send_signal(signal.SIGKILL)


class _Template:
    """The process that is copied, as seen from the tests."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._socket, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__, str(theirs.fileno())],
                cwd=ROOT,
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                start_new_session=True,
            )
        atexit.register(self._close)

    def ask(self, request: object, *descriptors: int) -> int | None:
        """Send a request; return the answer."""
        message = json.dumps(request).encode() + b"\n"
        with self._lock:
            sent = socket.send_fds(self._socket, [message], descriptors)
            self._socket.sendall(message[sent:])
            answer = self._socket.recv(_CHUNK)
        assert answer, f"the template ended with {self._process.poll()}"
        return json.loads(answer)

    def _close(self) -> None:
        self._socket.close()
        self._process.wait()


_template = functools.cache(_Template)
"""Of this process of pytest."""


def _serve(connection: socket.socket) -> list[str] | None:
    """Copy this process for each request.

    Returns:
        In a copy, its command line; None at the end.
    """
    while True:
        message, descriptors, _, _ = socket.recv_fds(connection, _CHUNK, 2)
        if not message:
            return None
        while not message.endswith(b"\n"):
            message += connection.recv(_CHUNK)
        request = json.loads(message)
        if "ended" in request:
            pid, status = os.waitpid(request["ended"], os.WNOHANG)
            connection.sendall(
                json.dumps(os.waitstatus_to_exitcode(status) if pid else None).encode()
            )
            continue
        pid = os.fork()
        if pid == 0:
            os.setsid()
            for number, descriptor in enumerate(descriptors, start=1):
                os.dup2(descriptor, number)
                os.close(descriptor)
            os.environ.clear()
            os.environ.update(request["environment"])
            return request["arguments"]
        for descriptor in descriptors:
            os.close(descriptor)
        connection.sendall(json.dumps(pid).encode())


def _prepare() -> None:
    """Import what the commands need, and load the kernels."""
    from app.process.environment import prevent_spinning
    from app.process.kernel_cache import use_kernel_cache

    prevent_spinning()
    use_kernel_cache()
    nodes = "cli.nodes.console", "cli.nodes.navigate", "cli.nodes.sim", "nodes.robot_sim"
    for name in ("__main__", *nodes):
        importlib.import_module(f"app.{name}")
    from app.nodes.console.web import assets
    from app.nodes.navigator.config import NavigatorConfig
    from app.nodes.navigator.warm_up import warm_up

    warm_up(NavigatorConfig(), lambda _: None)
    # What viser's client unpacks to is the same for all consoles.
    assets.unpack_client = functools.cache(assets.unpack_client)
    assets.Assets()
    # Only the thread that copies is in the copy.
    assert psutil.Process().num_threads() == 1
    gc.collect()
    gc.freeze()


def main() -> None:
    """Be the template, and in a copy, a process of the product."""
    faulthandler.enable()
    with socket.socket(fileno=int(sys.argv[1])) as connection:
        _prepare()
        arguments = _serve(connection)
    if arguments is None:
        return
    sys.argv[1:] = arguments
    from app.__main__ import main

    main()


if __name__ == "__main__":
    main()
