"""Data of a session over time."""

import numpy as np
import pytest

from app.messages import keys
from app.messages.control import encode
from app.messages.motion import StampedTransform, encode_transforms
from app.messages.status import Event
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


def test_a_timeline_that_states_a_terabyte_is_refused():
    assert unpack_timeline(pack_timeline(SessionTimeline())) == SessionTimeline()
    # Magic number, descriptor for a size of eight bytes, window, size, and an empty last block.
    bomb = b"\x28\xb5\x2f\xfd" + b"\xc0\x58" + (1 << 40).to_bytes(8, "little") + b"\x01\0\0"
    with pytest.raises(RecordingError, match="it states 1099511627776 bytes"):
        unpack_timeline(bomb)
