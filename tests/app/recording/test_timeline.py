"""Data of a session over time."""

import msgspec
import numpy as np
import pytest

from app.messages import keys
from app.messages.control import encode
from app.messages.motion import StampedTransform, encode_transforms
from app.messages.status import Event, GoalStatus
from app.recording import timeline as timeline_module
from app.recording.errors import RecordingError
from app.recording.timeline import SessionTimeline, pack_timeline, unpack_timeline

S = 1_000_000_000


def tf(parent, child, x, stamp_ns=0):
    T = np.eye(4)
    T[0, 3] = x
    return encode_transforms(
        (StampedTransform(stamp_ns=stamp_ns, parent=parent, child=child, T_parent_child=T),)
    )


def test_a_robot_that_drives_by_odometry_under_localisation_leaves_a_trail():
    timeline = SessionTimeline()
    timeline.take(keys.TF_STATIC, tf("base_footprint", "base_link", 0.0), 0)
    timeline.take(keys.TF, tf("map", "odom", 1.0), 0)
    for k in range(11):
        timeline.take(keys.TF, tf("odom", "base_footprint", 0.1 * k, k * S), k * S)
    assert timeline.driven_m() == pytest.approx(1.0)
    assert (timeline.trail[0].x, timeline.trail[-1].time_ns) == (1.0, 10 * S)
    stored = unpack_timeline(pack_timeline(timeline))
    assert stored.trail == timeline.trail


def test_a_search_that_was_cancelled_is_not_marked_as_without_a_find():
    timeline = SessionTimeline()
    for kind in ("cancelled", "exhausted"):
        timeline.take(keys.EVENT, encode(Event(stamp_ns=1, kind=kind, text="the hat")), S)
    assert [mark.kind for mark in timeline.marks] == ["cancelled", "exhausted"]


def _add_statuses(timeline, made_up, seconds, **changes):
    first_ns = timeline.statuses[-1].time_ns + S // 2 if timeline.statuses else 0
    for k in range(2 * seconds):
        frames = 10 * (len(timeline.statuses) + 1) + k
        status = msgspec.structs.replace(made_up.status_of(frames), path_length_m=2.0, **changes)
        timeline.add(status, first_ns + k * S // 2)


def test_of_a_robot_that_rests_a_status_is_kept_every_ten_seconds(made_up):
    timeline = SessionTimeline()
    over = GoalStatus(goal_id=1, object="hat", outcome="found")
    _add_statuses(timeline, made_up, 3600, state="found", goal=over)
    assert len(timeline.statuses) == 360
    _add_statuses(timeline, made_up, 30, state="stopped", goal=over)
    assert [one.status.state for one in timeline.statuses[359:361]] == ["found", "stopped"]
    assert len(timeline.statuses) == 363
    _add_statuses(timeline, made_up, 30)
    assert len(timeline.statuses) == 423, "of a search that goes on, two in a second"
    assert timeline.statuses[363].status.state == "searching"


def test_a_timeline_that_is_too_long_is_stored_with_fewer_statuses(made_up, monkeypatch):
    timeline = SessionTimeline()
    _add_statuses(timeline, made_up, 1000)
    timeline.add(msgspec.structs.replace(made_up.status_of(0), map_revision=0), 2000 * S)
    _add_statuses(timeline, made_up, 1000)
    (before,) = timeline.ended
    monkeypatch.setattr(timeline_module, "_MAX_BYTES", len(msgspec.json.encode(timeline)) // 2)
    stored = unpack_timeline(pack_timeline(timeline))
    assert 1000 <= len(stored.statuses) < 2000
    (ended,) = stored.ended
    first = timeline.statuses[before.n_statuses]
    assert stored.statuses[ended.n_statuses] == first
    assert stored.last == timeline.last


def test_a_timeline_that_states_a_terabyte_is_refused():
    assert unpack_timeline(pack_timeline(SessionTimeline())) == SessionTimeline()
    # Magic number, descriptor for a size of eight bytes, window, size, and an empty last block.
    bomb = b"\x28\xb5\x2f\xfd" + b"\xc0\x58" + (1 << 40).to_bytes(8, "little") + b"\x01\0\0"
    with pytest.raises(RecordingError, match="it states 1099511627776 bytes"):
        unpack_timeline(bomb)
