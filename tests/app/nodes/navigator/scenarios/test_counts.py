"""Two chairs over the wire: each find is judged by itself, also after the navigator was killed."""

import math
import subprocess
import sys

import pytest

from app.links.network.requests import RequestRefusedError, ask
from app.messages import keys
from app.messages.control import Accepted, FeedbackRequest
from tests.app.faulty_search import FaultySearch

pytestmark = [pytest.mark.process, pytest.mark.slow]

APART_M = 0.3
FOUND_S = 400.0
"""Several times what it takes on an idle machine."""


@pytest.fixture
def search(launch, free_endpoint, tmp_path):
    search = FaultySearch(launch, free_endpoint, tmp_path)
    search.start_navigator()
    search.search("chair", count=9)
    # A chair is beside it.
    search.start_robot(start="5")
    yield search
    search.close()


def succeed(search):
    """Kill the navigator, and start the next one; return its first status with the goal."""
    search.navigator.child.kill()
    search.navigator.child.wait()
    search.start_navigator()
    return search.wait_for(lambda s: s.frames > 3 and s.goal is not None)


# In pieces: test_persistence.py (the next start), test_goal_service.py (the judgement), and
# test_counts.py of the mission (what was rejected is not found again).
@pytest.mark.large
def test_a_counted_find_counts_and_a_rejected_one_stays_rejected_after_a_crash(search):
    status = search.wait_for(lambda s: s.goal is not None and len(s.goal.counted) == 1, FOUND_S)
    (found,) = status.goal.counted
    assert found.number == 1

    status = succeed(search)
    assert found in status.goal.counted, "it still counts"
    told = subprocess.run(
        [sys.executable, "-m", "app", "ask", "--reject", "1", "--connect", search.endpoint,
         "--robot", "r", "--timeout-s", "60"],
        capture_output=True, text=True, check=False, timeout=150,
    )  # fmt: skip
    assert told.returncode == 0, told.stderr
    status = search.wait_for(lambda s: s.goal.rejected == 1)
    assert found not in status.goal.counted
    again = FeedbackRequest(verdict="reject", find=1)
    with pytest.raises(RequestRefusedError, match="there is no find 1"):
        ask(search.session, f"r/{keys.FEEDBACK}", again, Accepted, 20.0)

    status = succeed(search)
    assert (status.goal.rejected, status.goal.outcome) == (1, "active")
    assert found not in status.goal.counted
    for one in status.goal.counted:
        assert math.dist(found.position_world, one.position_world) > APART_M
