"""Exit statuses after a search."""

import pytest

from app.cli.exit_status import exit_status
from app.messages.status import GoalStatus


@pytest.mark.parametrize(
    ("outcome", "status"), [("found", 0), ("exhausted", 1), ("cancelled", 1), ("out_of_reach", 4)]
)
def test_the_exit_status_tells_a_find_from_one_out_of_reach(outcome, status):
    assert exit_status(GoalStatus(goal_id=7, object="hat", outcome=outcome)) == status
