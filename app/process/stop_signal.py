"""A stop flag that is safe to set in a signal handler."""

import contextlib
import os
import select
import signal
from collections.abc import Generator
from types import FrameType
from typing import Final, Protocol

_ENDING: Final = (signal.SIGINT, signal.SIGTERM)


class StopSignal(Protocol):
    """Interface of a stop flag; `threading.Event` fulfils it as well."""

    def is_set(self) -> bool:
        """Return whether to stop."""
        ...

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it is set or the time has passed; return whether it is set."""
        ...


class ProcessStopSignal:
    """Set by SIGINT and SIGTERM, from its construction on.

    Not a `threading.Event`, whose `set` in a signal handler deadlocks if the interrupted thread
    holds the event's lock.
    """

    def __init__(self) -> None:
        self._wanted = False
        self._raises = False
        self._read, self._write = os.pipe()
        os.set_blocking(self._write, False)
        for number in _ENDING:
            signal.signal(number, self._handle)

    def set(self) -> None:
        """Request the loop to stop."""
        if not self._wanted:
            self._wanted = True
            os.write(self._write, b"!")

    def is_set(self) -> bool:
        """Return whether to stop."""
        return self._wanted

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it is set or the time has passed; return whether it is set."""
        select.select([self._read], [], [], timeout)
        return self._wanted

    @contextlib.contextmanager
    def interrupting(self) -> Generator[None]:
        """Let the signals raise `KeyboardInterrupt`, too: for work that looks at no flag.

        Raised at its end at the latest, for where a destructor or a callback of a library has
        swallowed it.
        """
        self._raises = True
        try:
            self._check()
            yield
        finally:
            self._raises = False
        self._check()

    def _handle(self, _number: int, _frame: FrameType | None) -> None:
        self.set()
        if self._raises:
            raise KeyboardInterrupt

    def _check(self) -> None:
        if self._wanted:
            raise KeyboardInterrupt


def interrupt(_number: int, _frame: FrameType | None) -> None:
    """Handle a signal as Ctrl-C."""
    raise KeyboardInterrupt
