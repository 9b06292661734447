"""Data of a recording for exports."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from app.export.session_data import SessionData
from app.messages import keys
from app.recording.errors import RecordingError


@pytest.mark.parametrize(("found", "told"), [((keys.ODOM,), True), ((), False)])
def test_a_bag_without_tf_says_what_to_do_where_it_has_odometry(found, told):
    recording = SimpleNamespace(path=Path("a"), keys=found, all_messages=lambda _: ())
    session = SessionData(recording=recording, timeline=None, scene=None)
    with pytest.raises(RecordingError, match="no tf from map to base_link") as error:
        _ = session.trajectory
    assert ("ippon replay" in str(error.value)) is told
