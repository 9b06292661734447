"""What the operator is told: why the robot does what it does, and what happened in a step."""

from typing import Final

from ippon.mission.snapshot import MissionEvent

WAITING: Final = "waiting for a goal"


class Journal:
    """One line that stays until another takes its place, and events that are told once."""

    def __init__(self) -> None:
        self.why = WAITING
        self._events: list[MissionEvent] = []
        self._map_is_full = False

    def map_dropped(self, blocks: int, limit_mb: float) -> None:
        """Tell once that the map has begun to give up blocks."""
        if blocks and not self._map_is_full:
            self._map_is_full = True
            self.note(
                "map_full",
                f"the map has reached its bound of {limit_mb:.0f} MB: what was seen longest ago is "
                "given up, far parts first; ippon navigate --map-memory-mb sets the bound",
            )

    def note(self, kind: str, text: str) -> None:
        """Keep an event for the next snapshot."""
        self._events.append(MissionEvent(kind=kind, text=text))

    def take(self) -> tuple[MissionEvent, ...]:
        """Return the events since the last call, the oldest first."""
        events, self._events = tuple(self._events), []
        return events
