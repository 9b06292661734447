"""Pictures of finds, kept as the robot took them."""

from typing import Final

from app.messages.status import FindReport, Status, goal_of
from app.nodes.console.scene.find_picture import outlined

_KEPT: Final = 32
_LATE_S: Final = 3.0
"""An image this much later than a find is of something else, if the search went on."""


class FindPictures:
    """Keeps the picture of each find: of a tour, an earlier find may wait for its verdict."""

    def __init__(self) -> None:
        self._kept: dict[tuple[int, int, tuple[float, float, float]], bytes] = {}

    def picture_of(self, find: FindReport, status: Status, image: bytes) -> bytes | None:
        """Return the picture of the find; None if no image of it has arrived.

        Args:
            find: The find that is shown.
            status: The status that reports it.
            image: The latest image of the camera.
        """
        key = (find.goal_id, find.number, find.position_world)
        if key not in self._kept:
            if _is_late(find, status):
                return None
            self._kept[key] = outlined(image, find.box_px)
            if len(self._kept) > _KEPT:
                del self._kept[next(iter(self._kept))]
        return self._kept[key]


def _is_late(find: FindReport, status: Status) -> bool:
    goal = goal_of(status, find.goal_id)
    took_s = None if goal is None else goal.took_s
    return took_s is not None and status.elapsed_s - took_s > _LATE_S
