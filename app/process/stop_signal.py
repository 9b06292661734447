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
    """Set by SIGINT and SIGTERM.

    Not a `threading.Event`, whose `set` in a signal handler deadlocks if the interrupted thread
    holds the event's lock.
    """

    def __init__(self) -> None:
        self._wanted = False
        self._read, self._write = os.pipe()
        os.set_blocking(self._write, False)
        for number in _ENDING:
            signal.signal(number, lambda *_: self.set())

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
def interruptible() -> Generator[None]:
    """Let SIGINT and SIGTERM raise `KeyboardInterrupt`: for work that looks at no flag."""
    before = {number: signal.signal(number, interrupt) for number in _ENDING}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def interrupt(_number: int, _frame: FrameType | None) -> None:
    """Handle a signal as Ctrl-C."""
    raise KeyboardInterrupt
