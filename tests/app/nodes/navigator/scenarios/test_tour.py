"""A tour over the wire: `ippon ask` names two objects, and both are found in one search."""

import json
import subprocess
import sys

import pytest

from app.links.network.requests import RequestRefusedError, ask
from app.messages import keys
from app.messages.control import Accepted, ControlReply, ControlRequest, FeedbackRequest
from tests.app.nodes.navigator.test_node import Operator

pytestmark = [pytest.mark.process, pytest.mark.slow]


@pytest.fixture
def operator(launch, free_endpoint):
    launch("navigate", "--listen", free_endpoint, "--robot", "r")
    operator = Operator(free_endpoint)
    operator.ready()
    yield operator
    operator.session.close()


# In pieces: test_ask.py asks, test_goal_service.py judges and cancels, and test_tour.py of the
# mission finds both.
@pytest.mark.large
def test_two_objects_asked_for_with_and_are_found_in_one_tour(operator, launch, free_endpoint):
    where = ("--connect", free_endpoint, "--robot", "r")
    home = ("--home", "8", "--start", "1", "--width", "240")
    launch("sim", *where, *home, "--speed", "max")
    asked = subprocess.run(
        [sys.executable, "-m", "app", "ask", "my sofa and the bed", "--follow", "--json",
         *where],
        capture_output=True, text=True, check=False, timeout=280,
    )  # fmt: skip
    assert asked.returncode == 0, asked.stderr
    accepted, joined, *lines = (json.loads(line) for line in asked.stdout.splitlines())
    assert (accepted["goal_id"], accepted["joined"]) == (1, None)
    assert (joined["goal_id"], joined["joined"], joined["position"]) == (2, 1, 0)
    ends = [line for line in lines if line["outcome"] == "found"]
    assert {line["object"] for line in ends} == {"sofa", "bed"}
    assert all(len(line["position_world"]) == 3 for line in ends)

    status = operator.wait_for(lambda s: s.state == "found")
    assert [(g.object, g.outcome) for g in status.tour] == [("sofa", "found"), ("bed", "found")]
    assert (status.queue, status.history) == ([], [])
    found = [event for event in operator.events if event.kind == "found"]
    assert sorted(event.goal_id for event in found) == [1, 2]
    # What was announced last is confirmed; the other is rejected by its number, and searched for.
    last, first = found[-1].goal_id, found[0].goal_id
    assert status.find.goal_id == last
    operator.ask(keys.FEEDBACK, FeedbackRequest(verdict="confirm"), Accepted)
    status = operator.wait_for(lambda s: s.find is not None and s.find.goal_id == first)
    with pytest.raises(RequestRefusedError, match=f"no find of goal {last} to confirm"):
        operator.ask(keys.FEEDBACK, FeedbackRequest(verdict="reject", goal_id=last), Accepted)
    operator.ask(keys.FEEDBACK, FeedbackRequest(verdict="reject", goal_id=first), Accepted)
    status = operator.wait_for(lambda s: s.goal is not None and s.goal.outcome == "active")
    assert status.goal.goal_id == first
    cancel = ControlRequest(action="cancel", goal_id=first)
    assert ask(operator.session, f"r/{keys.CONTROL}", cancel, ControlReply, 20.0)
    status = operator.wait_for(lambda s: any(g.goal_id == first for g in s.history))
    outcomes = {g.goal_id: g.outcome for g in status.history}
    assert outcomes == {first: "cancelled"}
    assert status.goal.goal_id == last
