"""The thread that plays: a session that goes on while it is shown."""

import math
import threading
from types import SimpleNamespace

import msgspec
import pytest

from app.links.network import inbox as inbox_module
from app.links.network.inbox import Inbox
from app.messages import keys
from app.nodes.console.scene.state_feed import StateFeed
from app.nodes.review import playback as playback_module
from app.nodes.review.playback import Playback, ReviewCommand, ReviewState
from app.nodes.review.player import Player
from app.recording.errors import RecordingError
from app.recording.notes import notes_path
from app.view.model.seek_history import SEEK_HISTORY

PATIENCE_S = 120.0


class _Board(StateFeed):
    """Lets a test wait for a state."""

    def __init__(self):
        super().__init__()
        self._changed = threading.Condition()

    def post(self, notice):
        super().post(notice)
        with self._changed:
            self._changed.notify_all()

    def wait(self, test):
        def holds():
            return self.notice is not None and test(
                msgspec.json.decode(self.notice, type=ReviewState)
            )

        with self._changed:
            assert self._changed.wait_for(holds, PATIENCE_S), self.notice


def test_the_timeline_of_a_session_that_is_recorded_grows(made_up, tmp_path, monkeypatch):
    monkeypatch.setattr(playback_module, "FOLLOW_S", 0.2)
    session = made_up.write_session(tmp_path, seconds=3.0, end=False)
    session.writer.flush()
    later = [m for m in made_up.all_messages(6.0) if m[0] > made_up.START_NS + 3 * 10**9]
    board, failures = _Board(), []
    playback = Playback((lambda *_: None,), board, failures.append)
    playback.start()
    try:
        playback.show([session.writer.folder])
        assert playback.session.duration_s == pytest.approx(2.8, abs=0.05)
        assert "was not ended" in playback.session.problems[0]
        playback.command(ReviewCommand(action="seek", value=2.0))
        for time_ns, key, payload in later:
            session.add(key, payload, time_ns, (time_ns - made_up.START_NS) * 1e-9)
        session.writer.flush()
        board.wait(lambda state: state.growing and playback.session.duration_s > 5.7)
        assert playback.session.marks[-1].kind == "found"
        playback.command(ReviewCommand(action="speed", value=16.0))
        playback.command(ReviewCommand(action="play"))
        board.wait(lambda state: state.position_s == pytest.approx(5.8, abs=0.05))
        session.close()
        board.wait(lambda state: not state.growing and not state.playing)
        assert not playback.session.problems
    finally:
        playback.close()
    assert not failures


def test_a_session_that_is_being_recorded_is_no_broken_one(made_up, tmp_path, caplog):
    session = made_up.write_session(tmp_path, seconds=3.0, end=False)
    session.writer.flush()
    board, failures = _Board(), []
    playback = Playback((lambda *_: None,), board, failures.append)
    playback.start()
    try:
        playback.show([session.writer.folder])
        board.wait(lambda state: state.growing)
        assert not caplog.records
        session.writer.abandon()
        board.wait(lambda state: not state.growing)
        playback.show([session.writer.folder])
        assert "was not ended" in caplog.text
    finally:
        playback.close()
    assert not failures


def test_a_session_is_shown_without_the_notes_that_cannot_be_read(made_up, tmp_path):
    writer = made_up.write_session(tmp_path, seconds=1.0).writer
    notes = notes_path(writer.path)
    notes.write_text("half a no")
    board, failures = _Board(), []
    playback = Playback((lambda *_: None,), board, failures.append)
    playback.start()
    try:
        playback.show([writer.folder])
        assert playback.session.notes == []
        (problem,) = playback.session.problems
        assert problem.startswith(f"the notes in {notes} cannot be read: ")
        playback.command(ReviewCommand(action="note", text="here"))
        board.wait(lambda state: "cannot be read" in state.problem)
        assert notes.read_text() == "half a no"
    finally:
        playback.close()
    assert not failures


def test_a_page_sends_no_note_that_could_not_be_read_again():
    sent = msgspec.json.encode(ReviewCommand(action="note", text=2001 * "x"))
    with pytest.raises(msgspec.ValidationError, match="length <= 2000"):
        msgspec.json.decode(sent, type=ReviewCommand)


def test_what_went_wrong_is_said_until_it_goes_well(made_up, tmp_path, monkeypatch):
    monkeypatch.setattr(playback_module, "FOLLOW_S", 0.05)
    session = made_up.write_session(tmp_path, seconds=1.0, end=False)
    session.writer.flush()
    broken, looked, refresh = threading.Event(), threading.Event(), Player.refresh

    def fail(player):
        looked.set()
        if broken.is_set():
            raise RecordingError("the share is gone")
        return refresh(player)

    def full(*_):
        raise RecordingError("no space left")

    monkeypatch.setattr(Player, "refresh", fail)
    board, failures = _Board(), []
    playback = Playback((lambda *_: None,), board, failures.append)
    playback.start()
    try:
        playback.show([session.writer.folder])
        broken.set()
        board.wait(lambda state: state.problem == "the share is gone")
        broken.clear()
        board.wait(lambda state: state.problem == "")
        with monkeypatch.context() as patched:
            patched.setattr(playback_module, "add_note", full)
            playback.command(ReviewCommand(action="note", text="here"))
            board.wait(lambda state: state.problem == "no space left")
        for _ in range(2):
            looked.clear()
            assert looked.wait(PATIENCE_S)
        board.wait(lambda state: state.problem == "no space left")
        playback.command(ReviewCommand(action="note", text="here"))
        board.wait(lambda state: state.problem == "")
    finally:
        playback.close()
        session.writer.abandon()
    assert not failures


def test_a_page_may_ask_for_any_number(made_up, tmp_path):
    folder = made_up.write_session(tmp_path, seconds=3.0).writer.folder
    board, failures = _Board(), []
    playback = Playback((lambda *_: None,), board, failures.append)
    playback.start()
    try:
        playback.show([folder])
        for value in (1e308, math.inf):
            playback.command(ReviewCommand(action="seek", value=-value))
            board.wait(lambda state: state.position_s == 0.0)
            playback.command(ReviewCommand(action="step", value=value))
            board.wait(lambda state: state.position_s > 2.5)
            playback.command(ReviewCommand(action="step", value=-value))
            board.wait(lambda state: state.position_s == 0.0)
            playback.command(ReviewCommand(action="seek", value=value))
            board.wait(lambda state: state.ended)
    finally:
        playback.close()
    assert not failures


def test_a_jump_while_playing_lands_where_it_was_asked_to(made_up, tmp_path, monkeypatch):
    folder = made_up.write_session(tmp_path, seconds=6.0).writer.folder
    clock_s, seek = [0.0], Player.seek

    def slow(player, position_s):
        seek(player, position_s)
        clock_s[0] += 0.3

    monkeypatch.setattr(Player, "seek", slow)
    monkeypatch.setattr(
        playback_module, "time", SimpleNamespace(monotonic=lambda: clock_s[0], time_ns=lambda: 0)
    )
    board, failures = _Board(), []
    playback = Playback((lambda *_: None,), board, failures.append)
    playback.start()
    try:
        playback.show([folder])
        playback.command(ReviewCommand(action="speed", value=16.0))
        playback.command(ReviewCommand(action="play"))
        board.wait(lambda state: state.playing)
        assert msgspec.json.decode(board.notice, type=ReviewState).position_s == 0.0
        playback.command(ReviewCommand(action="seek", value=2.0))
        board.wait(lambda state: state.position_s > 0.0)
        state = msgspec.json.decode(board.notice, type=ReviewState)
        assert (state.playing, state.position_s) == (True, 2.0)
    finally:
        playback.close()
    assert not failures


def test_a_browser_takes_no_picture_of_an_earlier_review_for_one_of_this(session_folder):
    versions = []
    for _ in range(2):
        board, failures = _Board(), []
        playback = Playback((lambda *_: None,), board, failures.append)
        playback.start()
        try:
            playback.show([session_folder])
            board.wait(lambda state: state.version > 0)
            versions.append(msgspec.json.decode(board.notice, type=ReviewState).version)
        finally:
            playback.close()
        assert not failures
    first, second = versions
    assert first < second < 2**53, "JavaScript reads it as a number"


def test_no_voxel_is_lost_where_the_scene_is_slower_than_the_playback(
    made_up, tmp_path, monkeypatch
):
    monkeypatch.setattr(inbox_module, "_LIMIT", 20)
    folder = made_up.write_session(tmp_path, seconds=20.0).writer.folder
    inbox, board, failures = Inbox((keys.MAP_VOXELS, keys.TF)), _Board(), []
    drawn, stop = [], threading.Event()

    def draw():
        while not stop.wait(0.2):
            drawn.extend(inbox.drain(0.0))

    scene = threading.Thread(target=draw)
    playback = Playback((inbox.put,), board, failures.append, has_room=inbox.has_room)
    playback.start()
    scene.start()
    try:
        playback.show([folder])
        playback.command(ReviewCommand(action="seek", value=0.0))
        playback.command(ReviewCommand(action="speed", value=16.0))
        board.wait(lambda state: state.speed == 16.0 and state.position_s == 0.0)
        playback.command(ReviewCommand(action="play"))
        board.wait(lambda state: state.ended and not state.playing)
    finally:
        playback.close()
        stop.set()
        scene.join()
    drawn.extend(inbox.drain(0.0))
    assert not failures
    assert inbox.dropped == 0
    assert [key for key, _ in drawn].count(keys.TF) >= 100


@pytest.mark.parametrize("frames", [-1, 1])
def test_many_steps_show_the_last_moment_where_the_scene_is_slower(
    made_up, tmp_path, monkeypatch, frames
):
    monkeypatch.setattr(inbox_module, "_LIMIT", 80)
    folder = made_up.write_session(tmp_path, seconds=12.0).writer.folder
    topics = (SEEK_HISTORY, keys.STATUS, keys.MAP_VOXELS, keys.TF)
    inbox, board, failures = Inbox(topics, anew=(SEEK_HISTORY,)), _Board(), []
    playback = Playback((inbox.put,), board, failures.append, has_room=inbox.has_room)
    playback.start()
    try:
        playback.show([folder])
        playback.command(ReviewCommand(action="seek", value=0.0 if frames > 0 else 12.0))
        for n in range(50):
            playback.command(ReviewCommand(action="step", value=frames))
            if n % 2:
                playback.image_at(0.0, 0)  # what waits is done, and the steps before it
        board.wait(lambda state: state.position_s == pytest.approx(1.8 if frames < 0 else 10.0))
    finally:
        playback.close()
    assert not failures
    assert inbox.dropped == 0
    shown = [payload for key, payload in inbox.drain(0.0) if key == keys.STATUS]
    # The status of a moment comes after its image.
    at_ns = msgspec.json.decode(shown[-1])["stamp_ns"]
    assert at_ns == pytest.approx(1.6e9 if frames < 0 else 9.8e9)
