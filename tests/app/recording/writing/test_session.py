"""Limits, thinning, notes, markers, and a recorder that is killed."""

import errno
import io
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from app.messages import keys
from app.messages.cdr import decode
from app.messages.control import encode
from app.messages.recording import RecordingGap
from app.messages.scene import FoundObject
from app.messages.status import Event
from app.recording.channels import GAP_KEY
from app.recording.errors import RecordingError
from app.recording.notes import Note, add_note, notes_path, read_notes
from app.recording.reading.recording import Recording
from app.recording.writing.limits import RecordingLimits, check_limits
from app.recording.writing.markers import encode_markers
from app.recording.writing.session import THUMBNAIL, Session, session_name
from app.recording.writing.subsampling import Arrived, _stamp_of
from app.recording.writing.writer import SessionWriter
from tests.locations import ROOT

GB = 10**9


@pytest.mark.parametrize(
    ("written", "free", "stop", "text"),
    [
        (1 * GB, 100 * GB, False, ""),
        (7.5 * GB, 100 * GB, False, r"7.5 of 8 GB"),
        (8 * GB, 100 * GB, True, r"limit of 8 GB; the robot continues"),
        (1 * GB, 2.1 * GB, False, r"2.1 GB are free"),
        (1 * GB, 1.9 * GB, True, r"1.9 GB are free on the disk and 2 GB must stay"),
    ],
)
def test_limits_warn_first_and_stop_then(written, free, stop, text):
    verdict = check_limits(RecordingLimits(), int(written), int(free))
    assert verdict.stop is stop
    assert text in verdict.text
    assert bool(verdict.text) is bool(text)


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"max_gb": 0.0}, "size limit of a recording must be positive; got 0"),
        ({"min_free_gb": -1.0}, "free disk space must not be negative; got -1"),
        ({"max_gb": float("nan")}, "must be positive; got nan"),
    ],
)
def test_limits_that_are_none_are_refused(wrong, text):
    with pytest.raises(ValueError, match=text):
        RecordingLimits(**wrong)


def test_depth_and_heatmaps_are_thinned_together_and_nothing_else(made_up, tmp_path):
    session = Session(tmp_path, "home/3", RecordingLimits(min_free_gb=0.0), 1, sensor_hz=2.0)
    for time_ns, key, payload in made_up.all_messages(6.0):
        session.add(key, payload, time_ns, 0.0)
    session.close()
    recording = Recording(session.writer.folder)
    stamps = {}
    for key, kind in [
        (keys.DEPTH, "sensor_msgs/msg/CompressedImage"),
        (keys.HEATMAP, "ippon_msgs/msg/Heatmap"),
    ]:
        heads = [decode(m.payload, kind).header.stamp for m in recording.all_messages([key])]
        stamps[key] = [(h.sec, h.nanosec) for h in heads]
    assert stamps[keys.DEPTH] == stamps[keys.HEATMAP]
    assert len(stamps[keys.DEPTH]) == 12
    assert len(recording.times_ns(keys.COLOR)) == 30
    recording.close()


def _rest(session, made_up, ticks, heatmap_every=1, phase=0):
    """Record a robot that stands with its search over, at five images a second."""
    pose = next(payload for key, payload in made_up.messages_of(0, 1) if key == keys.TF)
    for tick in ticks:
        for n, (key, payload) in enumerate(made_up.messages_of(tick, tick + 1)):
            if key != keys.EVENT and (key != keys.HEATMAP or tick % heatmap_every == phase):
                time_ns = made_up.START_NS + tick * 10**9 // made_up.HZ + n * 1000
                sent = pose if key == keys.TF else payload
                session.add(key, sent, time_ns, tick / made_up.HZ)


@pytest.mark.parametrize("sensor_hz", [2.0, 0.0])
def test_of_a_robot_that_rests_fewer_images_and_whole_maps_are_kept(made_up, tmp_path, sensor_hz):
    session = Session(tmp_path, "home/3", RecordingLimits(min_free_gb=0.0), 1, sensor_hz=sensor_hz)
    _rest(session, made_up, range(5 * 65))
    for time_ns, key, payload in made_up.all_messages(6.0):
        session.add(key, payload, time_ns + 65 * 10**9, 65.0 + (time_ns - made_up.START_NS) * 1e-9)
    session.close()
    recording = Recording(session.writer.folder)

    def count(key, from_s, until_s):
        after_s = (recording.times_ns(key) - made_up.START_NS) * 1e-9
        return int(np.count_nonzero((after_s > from_s) & (after_s < until_s)))

    few = {keys.DEPTH: 6, keys.HEATMAP: 6, keys.COLOR: 60, keys.MAP_KEYFRAME: 1}
    whole = {keys.DEPTH: 300, keys.HEATMAP: 300, keys.COLOR: 300, keys.MAP_KEYFRAME: 30}
    expected = few if sensor_hz else whole
    resting = {key: count(key, 4.99, 64.99) for key in expected}
    assert resting == pytest.approx(expected, abs=1)
    assert {count(key, 4.99, 64.99) for key in (keys.STATUS, keys.TF, keys.MAP_VOXELS)} == {300}
    # What comes before and the search that follows have all of their images.
    assert count(keys.COLOR, -1.0, 4.99) == 25
    assert count(keys.COLOR, 64.99, 71.0) == 30
    assert count(keys.DEPTH, 64.99, 71.0) == (12 if sensor_hz else 30)
    recording.close()


@pytest.mark.parametrize("phase", [0, 1, 2])
def test_a_heatmap_of_a_robot_that_rests_has_its_images(made_up, tmp_path, phase):
    session = Session(tmp_path, "home/3", RecordingLimits(min_free_gb=0.0), 1, sensor_hz=2.0)
    _rest(session, made_up, range(5 * 65), 3, phase)
    session.close()
    recording = Recording(session.writer.folder)
    seen, depths, colors = (
        {_stamp_of(Arrived(m.key, m.payload, 0)) for m in recording.all_messages([key])}
        for key in (keys.HEATMAP, keys.DEPTH, keys.COLOR)
    )
    recording.close()
    assert seen <= depths
    assert seen <= colors
    resting = [sum(s > 5 * 10**9 for s in stamps) for stamps in (seen, depths, colors)]
    assert resting == pytest.approx([6, 9, 63], abs=3)


def test_the_next_whole_map_after_a_gap_is_kept_of_a_robot_that_rests(made_up, tmp_path):
    session = Session(tmp_path, "home/3", RecordingLimits(min_free_gb=0.0), 1, sensor_hz=2.0)
    _rest(session, made_up, range(5 * 20))
    session.add(GAP_KEY, encode(RecordingGap()), made_up.START_NS + 20 * 10**9, 20.0)
    _rest(session, made_up, range(5 * 20, 5 * 40))
    session.close()
    recording = Recording(session.writer.folder)
    after_s = (recording.times_ns(keys.MAP_KEYFRAME) - made_up.START_NS) * 1e-9
    # Nothing is thinned for five seconds, and of later ones the first is kept.
    assert np.count_nonzero(after_s > 25.0) == 1
    recording.close()


@pytest.mark.parametrize("heatmap_every", [1, 4, 1000])
def test_a_depth_image_that_waited_does_not_pass_for_a_clock_that_was_set_back(
    made_up, tmp_path, heatmap_every
):
    session = Session(tmp_path, "home/3", RecordingLimits(min_free_gb=0.0), 1, sensor_hz=2.0)
    _rest(session, made_up, range(5 * 32), heatmap_every)
    session.close()
    recording = Recording(session.writer.folder)
    assert recording.index.problems == []
    recording.close()


def test_the_picture_of_a_find_is_the_image_of_its_time_also_where_that_is_not_kept(
    made_up, tmp_path
):
    session = Session(tmp_path, "home/3", RecordingLimits(min_free_gb=0.0), 1, sensor_hz=2.0)
    _rest(session, made_up, range(52))
    found = encode(Event(stamp_ns=0, kind="found", text="found the hat"))
    session.add(keys.EVENT, found, made_up.START_NS + 11 * 10**9, 11.0)
    session.close()
    recording = Recording(session.writer.folder)
    picture = Image.open(io.BytesIO(recording.attachment(THUMBNAIL)))
    assert np.asarray(picture).mean() == pytest.approx(5 * 51, abs=2)
    recording.close()


def test_notes_lie_beside_the_recording_which_stays_as_it_is(session_folder):
    path = session_folder / "session_0.mcap"
    before = path.read_bytes()
    add_note(path, Note(time_ns=9, kind="note", text="here it is", author="Anna"))
    add_note(path, Note(time_ns=3, kind="mark", text=""))
    assert [note.time_ns for note in read_notes(path)] == [3, 9]
    assert path.read_bytes() == before
    notes_path(path).write_text("nonsense")
    with pytest.raises(RecordingError, match="cannot be read"):
        add_note(path, Note(time_ns=4, kind="mark", text=""))
    assert notes_path(path).read_text() == "nonsense"


def test_markers_have_an_edge_for_every_node_but_the_root(made_up):
    find = FoundObject(label="hat", probability=1.0, center_world=(1.0, 2.0, 0.0), size_m=(1, 1, 1))
    markers = decode(
        encode_markers(made_up.tree_of(7), (find,), 5), "visualization_msgs/msg/MarkerArray"
    ).markers
    assert [marker.ns for marker in markers] == ["tree", "finds", "names"]
    assert len(markers[0].points) == 12
    assert decode(encode_markers(None, (), 5), "visualization_msgs/msg/MarkerArray").markers == []


def test_sessions_of_one_second_get_folders_of_their_own(tmp_path):
    limits = RecordingLimits(min_free_gb=0.0)
    sessions = [Session(tmp_path, "r", limits, 1) for _ in range(3)]
    assert len({session.writer.folder for session in sessions}) == 3
    for session in sessions:
        session.close()
    assert session_name("ippon/home 3", 0.0).endswith("_ippon_home_3")


def test_a_session_that_cannot_begin_leaves_no_folder(tmp_path, monkeypatch):
    def refuse(_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(SessionWriter, "flush", refuse)
    with pytest.raises(OSError, match="No space left"):
        Session(tmp_path, "r", RecordingLimits(min_free_gb=0.0), 1)
    assert list(tmp_path.iterdir()) == []


KILL = """
import mmap, os, random, signal, struct, sys, time
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from app.recording.writing.limits import RecordingLimits
from app.recording.writing.session import Session
RATE = 20.0  # a second of the session lasts 50 ms

def write(folder, last):
    session = Session(folder, "r", RecordingLimits(min_free_gb=0.0), 0)
    start, n = time.monotonic(), 0
    while True:
        now = RATE * (time.monotonic() - start)
        while n / 100.0 <= now:
            session.add("count", b"%d" % n, n * 10_000_000, n / 100.0)
            n += 1
        last[:8] = struct.pack("q", n - 1)
        session.writer.flush_if_due(now)
        time.sleep(0.002)

random.seed(7)
for k in range(50):
    last = mmap.mmap(-1, 8)
    folder = Path(sys.argv[1]) / str(k)
    child = os.fork()
    if child == 0:
        write(folder, last)
    moment = random.randrange(100, 400)
    while struct.unpack("q", last[:8])[0] < moment:
        time.sleep(random.uniform(0.0, 0.001))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    print(folder, struct.unpack("q", last[:8])[0], flush=True)
"""


@pytest.mark.process
def test_killed_at_any_of_fifty_moments_all_but_the_last_second_is_there(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", KILL, str(tmp_path), str(ROOT)],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    lines = [line.rsplit(" ", 1) for line in done.stdout.splitlines()]
    assert len(lines) == 50
    for folder, last in lines:
        (session,) = Path(folder).iterdir()
        recording = Recording(session)
        numbers = [int(m.payload) for m in recording.all_messages()]
        recording.close()
        assert numbers == list(range(len(numbers)))
        assert (int(last) - numbers[-1]) / 100.0 < 1.0
