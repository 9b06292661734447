"""A wish to end that a signal may set at any moment."""

import os
import select
import signal
from typing import Protocol


class StopSignal(Protocol):
    """What a loop asks; `threading.Event` is one, too."""

    def is_set(self) -> bool:
        """Tell whether to end."""
        ...

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it is set or the seconds are over; returns whether it is set."""
        ...


class ProcessStopSignal:
    """Set by SIGINT and SIGTERM.

    Not a `threading.Event`: setting one from a signal handler waits for ever when the signal comes
    while the same thread holds the event's lock.
    """

    def __init__(self) -> None:
        self._wanted = False
        self._read, self._write = os.pipe()
        os.set_blocking(self._write, False)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: self.set())

    def set(self) -> None:
        """Ask the loop to end."""
        if not self._wanted:
            self._wanted = True
            os.write(self._write, b"!")

    def is_set(self) -> bool:
        """Tell whether to end."""
        return self._wanted

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it is set or the seconds are over; returns whether it is set."""
        select.select([self._read], [], [], timeout)
        return self._wanted
