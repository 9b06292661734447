"""The recorders of one robot, told apart by the folders that they write to."""

from collections import deque
from itertools import pairwise
from typing import Final

from app.messages.recording import RecordingStatus

_HEARD: Final = 8
"""Statuses that are kept: those of 2 s from two recorders."""


class Recorders:
    """Takes the statuses of all recorders, which come under one key."""

    def __init__(self) -> None:
        self._heard: deque[RecordingStatus] = deque(maxlen=_HEARD)

    def add(self, status: RecordingStatus) -> None:
        """Take a status."""
        self._heard.append(status)

    def clear(self) -> None:
        """Forget all recorders."""
        self._heard.clear()

    @property
    def statuses(self) -> tuple[RecordingStatus, ...]:
        """The last status of each recorder by its folder; of one that changes its folder, one."""
        last = {status.session: status for status in self._heard}
        changes = sum(a.session != b.session for a, b in pairwise(self._heard))
        # A recorder does not return to an earlier folder.
        if changes < len(last):
            return tuple(self._heard)[-1:]
        return tuple(last[session] for session in sorted(last))
