"""The recorder on a real network."""

import random
import shutil
import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import msgspec
import pytest

from app.links.network.latched_topic import LatchedTopic
from app.links.network.requests import RequestRefusedError, ask, last_message, serve
from app.links.network.sender import Sender
from app.links.network.subscription import is_alive
from app.messages import keys
from app.messages.control import ControlReply, ControlRequest, encode
from app.messages.recording import RecordingGap, RecordingStatus, RecordRequest
from app.messages.status import Event
from app.nodes import recorder
from app.nodes.recorder import Recorder, RecorderConfig
from app.nodes.recorder_network import RecorderNetwork
from app.nodes.review.player import Player
from app.nodes.review.session_figures import review_session
from app.recording.channels import GAP_KEY
from app.recording.notes import read_notes
from app.recording.reading.recording import Recording
from app.recording.reading.repair import check
from app.recording.writing.limits import RecordingLimits
from app.recording.writing.session import SUMMARY
from app.recording.writing.write_queue import WriteQueue
from app.ros2.ippon_ros2.zenoh_side import stream_publisher
from app.view.words import Words
from tests.app.nodes.console.drawn_home import status_of
from tests.app.relay import Relay

ROBOT = "test/robot-1"


def _await(condition, timeout_s=15.0):
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        found = condition()
        if found:
            return found
        time.sleep(0.02)
    raise TimeoutError


def _await_status(session, wanted):
    """Wait for a status of the recorder; it is asked again where it had no time to answer."""

    def answer():
        payload = last_message(session, f"{ROBOT}/{keys.RECORDING}", 2.0)
        if payload is None:
            return None
        status = msgspec.json.decode(payload, type=RecordingStatus)
        return status if wanted(status) else None

    return _await(answer)


@pytest.fixture
def record(sessions, free_endpoint, tmp_path, monkeypatch):
    """Start a recorder in a thread; returns a function that ends it and opens what it wrote."""
    stop, come = threading.Event(), []
    write = Recorder._write

    def write_and_note(recorder, arrival):
        write(recorder, arrival)
        come.append((arrival.key, arrival.payload))

    def wait_for(key, *payloads):
        """Wait until messages of a key are recorded, or one of any content."""
        wanted = {(key, payload) for payload in payloads}
        _await(lambda: wanted <= set(come) if wanted else key in dict(come))

    monkeypatch.setattr(Recorder, "_write", write_and_note)
    threads = []

    def start(**options):
        config = RecorderConfig(connect=free_endpoint, robot=ROBOT, root=tmp_path / "s", **options)
        threads.append(threading.Thread(target=Recorder(config).run, args=(stop,)))
        threads[0].start()
        _await(lambda: last_message(sessions[1], f"{ROBOT}/{keys.RECORDING}", 1.0))

        def finish():
            stop.set()
            threads[0].join(20)
            return [Recording(folder) for folder in sorted((tmp_path / "s").iterdir())]

        return finish

    start.wait_for = wait_for
    yield start
    stop.set()
    for thread in threads:
        thread.join(20)


def _request(session, action, text=""):
    request = RecordRequest(action=action, text=text, requester="Anna")
    return ask(session, f"{ROBOT}/{keys.RECORD}", request, RecordingStatus, timeout_s=8.0)


def test_what_is_said_is_recorded_with_who_asked_for_it(sessions, record):
    _, client = sessions
    serve(client, f"{ROBOT}/{keys.CONTROL}", ControlRequest, lambda _: ControlReply(state="paused"))
    finish = record(limits=RecordingLimits(min_free_gb=0.0))
    payloads = [b"%d" % n for n in range(200)]
    for payload in payloads:
        client.put(f"{ROBOT}/some/thing", payload)
    request = ControlRequest(action="pause", requester="Anna")
    ask(client, f"{ROBOT}/{keys.CONTROL}", request, ControlReply, timeout_s=5.0)
    _request(client, "note", "a note")
    with pytest.raises(RequestRefusedError, match="the note is empty"):
        _request(client, "note", " ")
    record.wait_for("some/thing", *payloads)
    record.wait_for(f"{keys.CONTROL}/{keys.EXCHANGE}")
    (recording,) = finish()
    assert [m.payload for m in recording.all_messages(("some/thing",))] == payloads
    exchange = recording.first(f"{keys.CONTROL}/{keys.EXCHANGE}")
    content = msgspec.json.decode(exchange.payload)
    assert (content["number"], content["request"]["requester"]) == (1, "Anna")
    assert content["reply"]["state"] == "paused"
    assert recording.index.complete
    (note,) = read_notes(recording.path)
    assert (note.text, note.author) == ("a note", "Anna")
    recording.close()


@pytest.mark.parametrize("waits", [False, True])
def test_what_was_sent_once_before_the_recording_is_in_it(sessions, record, waits):
    _, client = sessions
    put = stream_publisher(client, f"{ROBOT}/{keys.TF_STATIC}", kept=True)
    put(b"once")
    finish = record(limits=RecordingLimits(min_free_gb=0.0), wait=waits)
    _await(lambda: last_message(client, f"{ROBOT}/{keys.RECORDING}", 1.0))
    if waits:
        _request(client, "start")
    record.wait_for(keys.TF_STATIC, b"once")
    put(b"again")
    record.wait_for(keys.TF_STATIC, b"again")
    (recording,) = finish()
    sent = [m.payload for m in recording.all_messages((keys.TF_STATIC,))]
    assert sent == [b"once", b"again"]
    recording.close()


def test_what_the_navigator_told_before_the_recording_is_in_it(sessions, record):
    router, _ = sessions
    sender = Sender()
    latched = {key: LatchedTopic(router, f"{ROBOT}/{key}", sender) for key in keys.LATCHED}
    for key, topic in latched.items():
        topic.put(key.encode())
        assert last_message(router, f"{ROBOT}/{key}", 5.0) == key.encode(), "sent before it begins"
    finish = record(limits=RecordingLimits(min_free_gb=0.0))
    for key in latched:
        record.wait_for(key, key.encode())
    (recording,) = finish()
    for key in latched:
        assert [m.payload for m in recording.all_messages((key,))] == [key.encode()]
    recording.close()
    sender.close()


def test_after_a_silence_what_was_missed_is_requested_again(sessions, record, monkeypatch):
    monkeypatch.setattr(recorder, "SILENT_S", 1.0)
    router, _ = sessions
    key, asked = f"{ROBOT}/{keys.CONFIGURATION}", []

    def answer(query):
        with query:
            asked.append(b'{"run": %d}' % len(asked))
            query.reply(key, asked[-1])

    router.declare_queryable(key, answer)
    finish = record(limits=RecordingLimits(min_free_gb=0.0))
    _await(lambda: len(asked) > 1)
    record.wait_for(keys.CONFIGURATION, *asked[:2])
    (recording,) = finish()
    sent = [m.payload for m in recording.all_messages((keys.CONFIGURATION,))]
    assert sent[:2] == asked[:2]
    recording.close()


def test_recording_is_switched_on_and_off_by_request(sessions, record):
    _, client = sessions
    finish = record(limits=RecordingLimits(min_free_gb=0.0), wait=True)
    with pytest.raises(RequestRefusedError, match="there is no recording"):
        _request(client, "mark")
    assert _request(client, "start").state == "recording"
    client.put(f"{ROBOT}/a", b"1")
    record.wait_for("a", b"1")
    status = _request(client, "stop")
    assert (status.state, status.text) == ("off", "not recording: ended by Anna")
    client.put(f"{ROBOT}/a", b"2")
    time.sleep(0.3)
    (recording,) = finish()
    assert [m.payload for m in recording.all_messages(("a",))] == [b"1"]
    recording.close()


def test_at_its_limit_a_recording_ends_and_everyone_is_told(sessions, record):
    router, client = sessions
    events = []
    router.declare_subscriber(
        f"{ROBOT}/{keys.EVENT}", lambda s: events.append(s.payload.to_bytes())
    )
    finish = record(limits=RecordingLimits(max_gb=2e-4, min_free_gb=0.0))
    status = encode(status_of(stamp_ns=7 * 10**9))
    rng = random.Random(1)

    def told():
        # What is sent before the recorder's subscription has come through is lost.
        client.put(f"{ROBOT}/{keys.STATUS}", status)
        client.put(f"{ROBOT}/noise", rng.randbytes(60_000))
        return events and events[0]

    told = msgspec.json.decode(_await(told), type=Event)
    assert (told.kind, told.stamp_ns) == ("error", 7 * 10**9), "by the robot's clock"
    assert "limit of 0.0002 GB; the robot continues" in told.text
    (recording,) = finish()
    assert recording.index.complete
    recording.close()


def test_what_changed_while_the_line_was_cut_is_recorded(sessions, free_endpoint):
    router, _ = sessions
    relay, sender, took = Relay(int(free_endpoint.rsplit(":", 1)[1])), Sender(), []
    token = router.liveliness().declare_token(f"{ROBOT}/{keys.NAVIGATOR_ALIVE}")
    levels = LatchedTopic(router, f"{ROBOT}/{keys.LEVELS}", sender)
    network = RecorderNetwork(
        f"tcp/127.0.0.1:{relay.port}", ROBOT, lambda *one: took.append(one), None, None
    )
    try:
        network.open()
        _await(lambda: levels.put(b"before") or (keys.LEVELS, b"before") in took)
        # A gap is told by a token that was there.
        assert is_alive(network._session, f"{ROBOT}/{keys.NAVIGATOR_ALIVE}", 15.0)
        relay.lets_in = False
        relay.cut()
        levels.put(b"meanwhile")
        time.sleep(0.2)
        assert (keys.LEVELS, b"meanwhile") not in took
        relay.lets_in = True
        _await(lambda: (keys.LEVELS, b"meanwhile") in took)
        gap = GAP_KEY, encode(RecordingGap())
        assert gap in took[: took.index((keys.LEVELS, b"meanwhile"))]
    finally:
        network.close()
        sender.close()
        token.undeclare()
        relay.close()


def test_a_disk_that_refuses_ends_the_recording_and_nothing_else(sessions, record, tmp_path):
    _, client = sessions
    (tmp_path / "s").write_text("a file where the folder should be")
    record(limits=RecordingLimits(min_free_gb=0.0))
    status = _await_status(client, lambda status: status.state == "failed")
    assert "cannot be written to" in status.text
    (tmp_path / "s").unlink()
    assert _request(client, "start").state == "recording"


def test_a_folder_that_is_removed_ends_the_recording_once_and_another_can_begin(
    sessions, record, tmp_path, caplog
):
    _, client = sessions
    record(limits=RecordingLimits(min_free_gb=0.0))
    recording = _await_status(client, lambda one: one.state == "recording" and one.session)
    first = Path(recording.session)
    shutil.rmtree(first)
    failed = _await_status(client, lambda status: status.state == "failed")
    assert failed.text == f"the recording ended: No such file or directory ({first})"
    again = _request(client, "start")
    assert again.state == "recording"
    assert (Path(again.session) / "session_0.mcap").exists()
    assert [one.message for one in caplog.records if one.levelname == "ERROR"] == [failed.text]


def test_what_finds_no_room_is_counted():
    backlog = WriteQueue(limit_bytes=10)
    for payload in (b"12345", b"23456", b"34567", b"45678"):
        backlog.put("k", payload)
    gap = GAP_KEY, encode(RecordingGap(dropped=2))
    came = [("k", b"12345"), ("k", b"23456"), gap]
    assert [(one.key, one.payload) for one in backlog.take(0.0)] == came
    backlog.put("k", b"long" * 9)
    backlog.put("k", b"56789")
    gap = GAP_KEY, encode(RecordingGap(dropped=1))
    assert [(one.key, one.payload) for one in backlog.take(0.0)] == [gap, ("k", b"56789")]
    assert backlog.take(0.0) == []


def test_messages_that_are_missing_are_counted_for_their_session_and_told_with_it(tmp_path):
    slow = Recorder(RecorderConfig(robot=ROBOT, root=tmp_path))
    slow._queue = WriteQueue(limit_bytes=10)
    said = "messages are missing because the disk was too slow: 2"
    for n, dropped in enumerate((2, 0, 0)):
        slow._begin()
        path = slow._session.writer.folder
        for payload in (b"12345", b"23456", *dropped * (b"too long",)):
            slow._queue.put("a", payload)
        slow._write_waiting(0.0)
        slow._check_limits()
        assert slow._status.dropped == dropped, n
        slow._end("the test is over")
        assert slow._status.dropped == dropped, n
        assert (said in check(path, repair=False).problems) == (dropped > 0)
        recording = Recording(path)
        assert recording.index.metadata[SUMMARY]["dropped"] == str(dropped)
        player = Player(recording, lambda *_: None)
        assert (said in review_session([player]).problems) == (dropped > 0)
        german = review_session([player], Words("de")).problems
        assert any("Festplatte zu langsam war: 2" in one for one in german) == (dropped > 0)
        recording.close()


@pytest.mark.parametrize("step_s", [86_400.0, -86_400.0])
def test_a_clock_that_is_set_meanwhile_does_not_tear_the_session(tmp_path, monkeypatch, step_s):
    one = Recorder(RecorderConfig(robot=ROBOT, root=tmp_path))
    one._begin()
    path, start_ns = one._session.writer.folder, one._session.start_ns
    one._queue.put("a", b"1")
    set_ns = time.time_ns() + int(step_s * 1e9)
    monkeypatch.setattr(time, "time_ns", lambda: set_ns)
    one._queue.put("a", b"2")
    one._write_waiting(0.0)
    one._answer(RecordRequest(action="mark", text="here"))
    one._check_limits()
    assert 0.0 <= one._status.seconds < 60.0
    (note,) = read_notes(one._session.writer.path)
    one._end("the test is over")
    assert 0.0 <= one._status.seconds < 60.0
    recording = Recording(path)
    first, second = recording.all_messages(("a",))
    times_ns = [start_ns, first.time_ns, second.time_ns, note.time_ns, start_ns + 60 * 10**9]
    assert times_ns == sorted(times_ns)
    assert recording.index.problems == []
    recording.close()


def _while_it_writes(recorder, monkeypatch, act):
    """Do something in the midst of the first message's writing, as on a slow disk."""
    session, acts = recorder._session, [act]
    write = session.add

    def add(*message):
        if acts:
            acts.pop()()
        write(*message)

    monkeypatch.setattr(session, "add", add)


def test_what_came_before_the_end_while_the_disk_was_slow_is_recorded(tmp_path, monkeypatch):
    slow = Recorder(RecorderConfig(robot=ROBOT, root=tmp_path))
    slow._begin()
    path = slow._session.writer.folder
    slow._queue.put("a", b"1")
    _while_it_writes(slow, monkeypatch, lambda: slow._queue.put("a", b"2"))
    reply = Future()
    slow._requests.append((RecordRequest(action="stop"), reply))
    slow._step()
    assert reply.result(0).state == "off"
    recording = Recording(path)
    assert [m.payload for m in recording.all_messages(("a",))] == [b"1", b"2"]
    recording.close()


def test_an_end_that_was_refused_while_the_disk_was_slow_ends_nothing(tmp_path, monkeypatch):
    slow = Recorder(RecorderConfig(robot=ROBOT, root=tmp_path))
    slow._begin()
    reply = Future()
    slow._queue.put("a", b"1")
    _while_it_writes(slow, monkeypatch, reply.cancel)
    monkeypatch.setattr(slow, "_write_waiting", _after_the_first(slow._write_waiting))
    slow._requests.append((RecordRequest(action="stop"), reply))
    slow._step()
    assert reply.cancelled()
    assert slow._session is not None
    slow._end("the test is over")


def _after_the_first(write):
    """Leave out the first call: the message comes once a step has written what was there."""
    calls = []

    def later(timeout_s):
        calls.append(timeout_s)
        if len(calls) > 1:
            write(timeout_s)

    return later


def test_what_was_refused_because_the_disk_was_slow_is_not_done_later(tmp_path, monkeypatch):
    monkeypatch.setattr(recorder, "REPLY_S", 0.05)
    slow = Recorder(RecorderConfig(robot=ROBOT, root=tmp_path))
    slow._begin()
    with pytest.raises(RequestRefusedError, match="busy writing; try again"):
        slow._handle(RecordRequest(action="mark", text="here"))
    slow._requests.append((RecordRequest(action="mark", text="there"), Future()))
    slow._heard_at = time.monotonic()
    slow._step()
    assert [note.text for note in read_notes(slow._session.writer.path)] == ["there"]
    slow._end("the test is over")


def test_a_mark_that_the_slow_disk_took_is_not_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(recorder, "REPLY_S", 0.05)
    slow = Recorder(RecorderConfig(robot=ROBOT, root=tmp_path))
    slow._begin()
    begun, add = threading.Event(), recorder.add_note

    def add_late(path, note):
        begun.set()
        time.sleep(0.3)
        add(path, note)

    monkeypatch.setattr(recorder, "add_note", add_late)
    slow._heard_at = time.monotonic()
    with ThreadPoolExecutor() as pool:
        # Taken before the wait for its reply begins, which ends before it is carried out.
        monkeypatch.setattr(slow._queue, "wake", lambda: pool.submit(slow._step) and begun.wait(20))
        status = slow._handle(RecordRequest(action="mark", text="here"))
    assert status.state == "recording"
    assert [note.text for note in read_notes(slow._session.writer.path)] == ["here"]
    slow._end("the test is over")
