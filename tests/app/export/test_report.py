"""The report of a bag of another program."""

import csv
import dataclasses
import re
from pathlib import Path

import pytest

from app.export.report import RESULT_FILE, part_of
from app.export.session_data import read_session_data
from app.export.tables import write_csv
from app.messages import keys
from app.recording.notes import Note, add_note, notes_path
from app.recording.writing.limits import RecordingLimits
from app.recording.writing.session import Session
from tests.app.messages.robot_messages import odometry
from tests.app.recording.conftest import START_NS


@pytest.fixture
def bag(tmp_path):
    """Write a bag of odometry alone, or of messages of another key; return it as session data."""
    opened = []

    def write(key=keys.ODOM):
        session = Session(tmp_path, "spot", RecordingLimits(min_free_gb=0.0), START_NS)
        for k in range(44):
            payload = odometry(k * 10**9, float(k), 0.0, 0.0)
            session.add(key, payload, START_NS + k * 10**9, float(k))
        session.close()
        opened.append(read_session_data(session.writer.folder))
        return opened[-1]

    yield write
    for one in opened:
        one.recording.close()


def test_the_way_of_a_bag_of_odometry_is_that_of_its_trajectory(bag, tmp_path):
    session = bag()
    write_csv(session, tmp_path / "trajectory.csv")
    with (tmp_path / "trajectory.csv").open() as file:
        last = list(csv.DictReader(file))[-1]
    assert float(last["driven_m"]) == pytest.approx(43.0)
    assert re.findall(r"<td>([^<]*)</td>", part_of(session).row)[-1] == "43.0 m"


def test_the_way_of_a_recording_without_poses_is_not_said(bag):
    assert re.findall(r"<td>([^<]*)</td>", part_of(bag(keys.CONTACT)).row)[-1] == ""


def test_the_command_that_opens_a_session_works_in_any_folder(bag, monkeypatch):
    session = bag()
    monkeypatch.chdir(session.path)
    add_note(session.recording.path, Note(time_ns=START_NS, kind="note", text="here"))
    command = f"ippon review {session.path.parent / session.path.name}"
    assert command in part_of(session).body
    here = dataclasses.replace(session, path=Path())
    assert command in part_of(here).body


def test_notes_that_cannot_be_read_are_a_problem_of_their_session_and_end_no_report(bag):
    session = bag()
    notes_path(session.recording.path).write_text("half a no")
    body = part_of(session).body
    assert re.search(r"<p>the notes in \S+\.notes\.json cannot be read: ", body)
    assert "<h2>Events" not in body


@pytest.mark.parametrize("content", ["{}", "[]", '{"correct": true, "spl": null, "soft_spl": 1}'])
def test_a_result_of_another_program_is_no_ground_truth_and_ends_no_report(bag, content):
    session = bag()
    (session.path / RESULT_FILE).write_text(content)
    assert "spl" not in part_of(session).body.lower()
    (session.path / RESULT_FILE).write_text('{"correct": true, "spl": 0.71, "soft_spl": 1}')
    assert "<dd>0.71</dd>" in part_of(session).body
