"""The lines of the recorders in the Session tab."""

from app.messages.recording import RecordingStatus
from app.nodes.console.panels.record import recording_lines
from app.view.words import ENGLISH

ONE = RecordingStatus(state="recording", text="recording", session="/tmp/monday", seconds=61.0)
OTHER = RecordingStatus(state="off", text="not recording: ended by Anna", session="/tmp/tuesday")


def test_each_recorder_has_its_line_and_two_are_said_to_be_two():
    assert "No recorder is running" in recording_lines((), ENGLISH)
    alone = recording_lines((ONE,), ENGLISH)
    assert "Recording: 1:01, 0 MB" in alone
    assert "recorders" not in alone
    both = recording_lines((ONE, OTHER), ENGLISH)
    assert both.count("2 recorders write this robot") == 1
    assert all(text in both for text in ("monday", "tuesday", "ended by Anna"))
