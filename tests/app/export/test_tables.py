"""The finds of a session for other programs."""

import json

import msgspec
import pytest

from app.export.session_data import read_session_data
from app.export.tables import write_finds
from app.messages import keys
from app.messages.control import encode
from app.messages.status import GoalStatus
from app.recording.writing.limits import RecordingLimits
from app.recording.writing.session import Session
from tests.app.recording.conftest import START_NS, status_of


def _goal(number, outcome, at=None):
    return GoalStatus(goal_id=number, object="keys", outcome=outcome, position_world=at)


@pytest.fixture
def session(tmp_path):
    """A tour of two goals of which one was found; another one ended before the recording."""
    session = Session(tmp_path, "home/3", RecordingLimits(min_free_gb=0.0), START_NS)
    tour = [_goal(4, "found", (1.0, 2.0, 0.5)), _goal(5, "active")]
    status = msgspec.structs.replace(
        status_of(1), goal=tour[1], tour=tour, history=[_goal(1, "found", (9.0, 9.0, 0.0))]
    )
    session.add(keys.STATUS, encode(status), START_NS, 0.0)
    session.close()
    return read_session_data(session.writer.folder)


def test_all_goals_of_a_tour_and_none_of_before_the_recording(session, tmp_path):
    write_finds(session, tmp_path / "finds.json")
    session.recording.close()
    goals = json.loads((tmp_path / "finds.json").read_text())["goals"]
    assert [(goal["goal_id"], goal["outcome"]) for goal in goals] == [(4, "found"), (5, "active")]
    assert goals[0]["position_world"] == [1.0, 2.0, 0.5]
