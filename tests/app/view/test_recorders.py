"""The recorders of one robot."""

from app.messages.recording import RecordingStatus
from app.view.recorders import Recorders


def sessions_after(*sessions):
    recorders = Recorders()
    for n, session in enumerate(sessions):
        recorders.add(RecordingStatus(state="recording", text=str(n), session=session))
    return [(one.session, one.text) for one in recorders.statuses]


def test_statuses_of_two_folders_in_turn_come_from_two_recorders():
    assert sessions_after() == []
    assert sessions_after("a", "a") == [("a", "1")]
    assert sessions_after("b", "a", "b", "a", "b") == [("a", "3"), ("b", "4")]


def test_one_recorder_that_begins_another_recording_stays_one():
    assert sessions_after("", "a", "a", "b") == [("b", "3")]
    assert sessions_after("a", "b", "a", "b") != sessions_after("a", "a", "b", "b")


def test_a_recorder_that_ended_is_forgotten():
    assert sessions_after("a", "b", "a", "b", *"bbbbbbbb") == [("b", "11")]
