import msgspec
import pytest

from app.messages.driving import DriveStatus
from app.messages.status import GoalStatus
from app.view.shown_state import shown_state
from tests.app.nodes.console.drawn_home import find_of, status_of

GOAL = GoalStatus(goal_id=1, object="hat", outcome="found")
CONFIRMED = msgspec.structs.replace(GOAL, confirmed=True)

PERHAPS = msgspec.structs.replace(find_of(), perhaps=True)


@pytest.mark.parametrize(
    ("state", "changes", "shown"),
    [
        ("searching", {}, "searching"),
        ("starting", {"goal": None}, "ready"),
        ("starting", {"goal": None, "frames": 0}, "starting"),
        ("starting", {}, "starting"),
        ("found", {"goal": GOAL, "find": find_of()}, "found"),
        ("found", {"goal": GOAL, "find": PERHAPS}, "perhaps"),
        ("found", {"goal": CONFIRMED, "find": PERHAPS}, "confirmed"),
        # Of a tour the confirmed find is not reported any more.
        ("found", {"goal": CONFIRMED}, "confirmed"),
        ("manual", {"drive": DriveStatus(mode="manual")}, "manual"),
        ("manual", {"drive": DriveStatus(waypoint=(1.0, 2.0))}, "going"),
        ("stopped", {"goal": CONFIRMED, "find": find_of()}, "stopped"),
    ],
)
def test_what_was_judged_is_told_from_what_waits(state, changes, shown):
    assert shown_state(status_of(state, **changes)) == shown
