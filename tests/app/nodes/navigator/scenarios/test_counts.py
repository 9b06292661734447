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
FOUND_S = 240.0


@pytest.fixture
def search(launch, free_endpoint, tmp_path):
    search = FaultySearch(launch, free_endpoint, tmp_path)
    search.start_navigator()
    search.search("chair", count=9)
    search.start_robot()
    yield search
    search.close()


def succeed(search):
    """Kill the navigator, and start the next one; return its first status with the goal."""
    search.navigator.child.kill()
    search.navigator.child.wait()
    search.start_navigator()
    return search.wait_for(lambda s: s.frames > 3 and s.goal is not None)


def test_a_rejected_find_stays_rejected_and_a_counted_one_counts_after_a_crash(search):
    status = search.wait_for(lambda s: s.goal is not None and len(s.goal.counted) == 2, FOUND_S)
    wrong, right = status.goal.counted
    assert (wrong.number, right.number) == (1, 2)

    status = succeed(search)
    assert [one.number for one in status.goal.counted] == [1, 2], "both still count"
    key = f"r/{keys.FEEDBACK}"
    confirm = FeedbackRequest(verdict="confirm", find=2)
    assert ask(search.session, key, confirm, Accepted, 20.0)
    told = subprocess.run(
        [sys.executable, "-m", "app", "ask", "--reject", "1", "--connect", search.endpoint,
         "--robot", "r", "--timeout-s", "20"],
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert told.returncode == 0, told.stderr
    status = search.wait_for(lambda s: s.goal.rejected == 1)
    assert [(one.number, one.confirmed) for one in status.goal.counted] == [(2, True)]
    again = FeedbackRequest(verdict="reject", find=1)
    with pytest.raises(RequestRefusedError, match="there is no find 1"):
        ask(search.session, key, again, Accepted, 20.0)

    status = succeed(search)
    assert (status.goal.rejected, status.goal.outcome) == (1, "active")
    assert [(one.number, one.confirmed) for one in status.goal.counted] == [(2, True)]
    status = search.wait_for(lambda s: len(s.goal.counted) > 1, FOUND_S)
    later = status.goal.counted[1]
    assert later.number > 2, "no number is used twice"
    for before in (wrong, right):
        assert math.dist(before.position_world, later.position_world) > APART_M
