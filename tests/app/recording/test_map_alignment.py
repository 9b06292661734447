"""Where the poses of a recording lie in its map."""

import math

import numpy as np
import pytest

from app.messages import keys
from app.recording.map_alignment import MapAlignments, alignment_message
from app.recording.reading.recording import Recording
from app.recording.timeline import sampled_timeline, timeline_of
from ippon.geometry import base_pose, transform_points

FIRST = base_pose(10.0, -3.0, 0.0, math.pi / 2)
SECOND = base_pose(-5.0, 0.0, 0.0, 0.0)


@pytest.fixture
def recording(tmp_path, made_up):
    """A session whose navigator told its alignment late, and was started again in tick 20."""
    more = [
        made_up.alignment_at(3, (10.0, -3.0, 0.0), math.pi / 2),
        (made_up.START_NS + 5 * 10**9 // made_up.HZ, keys.MAP_ALIGNMENT, b"nonsense"),
        made_up.alignment_at(20, (-5.0, 0.0, 0.0)),
    ]
    recording = Recording(made_up.write_session(tmp_path, more=more).writer.folder)
    yield recording
    recording.close()


def test_the_first_alignment_applies_to_what_is_before_it(recording, made_up):
    alignments = MapAlignments(recording)
    np.testing.assert_allclose(alignments.at(recording.start_ns - 1), FIRST, atol=1e-12)
    np.testing.assert_allclose(alignments.at(recording.start_ns + 3 * 10**9), FIRST, atol=1e-12)
    np.testing.assert_allclose(alignments.at(recording.end_ns), SECOND, atol=1e-12)
    before = alignment_message(recording, recording.start_ns)
    assert before.time_ns == made_up.alignment_at(3, (0, 0, 0))[0]


def test_without_one_the_poses_are_those_in_the_map(session_folder):
    recording = Recording(session_folder)
    np.testing.assert_array_equal(MapAlignments(recording).at(0), np.eye(4))
    assert alignment_message(recording, recording.end_ns) is None
    recording.close()


def _driven(tick):
    """Return where the robot of the made-up session is in the map."""
    place = np.array([[0.02 * tick, 0.5, 0.0]])
    return transform_points(FIRST if tick <= 20 else SECOND, place)[0].tolist()


def test_the_trail_lies_in_the_map(recording, monkeypatch, made_up):
    stored = timeline_of(recording)
    monkeypatch.setattr(recording, "attachment", lambda _: None)
    for timeline in (stored, timeline_of(recording), sampled_timeline(recording)):
        for point in timeline.trail:
            tick = round((point.time_ns - made_up.START_NS) * made_up.HZ / 10**9)
            assert (point.x, point.y, point.z) == pytest.approx(_driven(tick), abs=1e-3)
    assert len(stored.trail) > 8
