"""Texts for the operator: the present reason, and the events of a step."""

from typing import Final

from ippon.mission.snapshot import MissionEvent

WAITING: Final = "waiting for a goal"


class Journal:
    """Keeps the present reason until it is replaced, and events until they are taken."""

    def __init__(self) -> None:
        self.why = WAITING
        self._events: list[MissionEvent] = []
        self._map_is_full = False

    def report_dropped(self, blocks: int, limit_mb: float) -> None:
        """Note once that the map has begun to drop blocks.

        Args:
            blocks: Blocks dropped in this step.
            limit_mb: Limit of the map's memory, megabytes.
        """
        if blocks and not self._map_is_full:
            self._map_is_full = True
            self.note(
                "map_full",
                f"the map has reached its bound of {limit_mb:.0f} MB: the parts that were seen "
                "longest ago are dropped; ippon navigate --map-memory-mb sets the bound",
            )

    def note(
        self, kind: str, text: str, find: int | None = None, goal_id: int | None = None
    ) -> None:
        """Keep an event for the next snapshot.

        Args:
            kind: Kind of the event.
            text: One line for the operator.
            find: Number of the find that was judged.
            goal_id: Number of the goal whose search ended.
        """
        self._events.append(MissionEvent(kind=kind, text=text, find=find, goal_id=goal_id))

    def take(self) -> tuple[MissionEvent, ...]:
        """Return the events since the last call, the oldest first."""
        events, self._events = tuple(self._events), []
        return events
