"""All goals as the page lists them: searched for, waiting, ended, and saved searches."""

import msgspec

from app.messages.control import SavedSearches
from app.messages.status import GoalStatus
from app.view.model.scene_model import SceneModel


class GoalList(msgspec.Struct, frozen=True, kw_only=True):
    """Goals in the order in which they are listed."""

    active: list[GoalStatus]
    """All goals of a tour; goals that have ended stay here until the next ones start."""
    waiting: list[GoalStatus]
    ended: list[GoalStatus]
    """The latest first."""
    saved: SavedSearches


def goal_list(model: SceneModel) -> GoalList:
    """Return the goals of a model."""
    status, saved = model.status, model.saved_searches
    if status is None:
        return GoalList(active=[], waiting=[], ended=[], saved=saved)
    present = [] if status.goal is None else [status.goal]
    return GoalList(
        active=status.tour or present,
        waiting=status.queue,
        ended=status.history[::-1],
        saved=saved,
    )
