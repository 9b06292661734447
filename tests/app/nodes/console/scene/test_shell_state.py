"""What the bar of the page shows of a status."""

from types import SimpleNamespace

import pytest

from app.messages.status import LeaseStatus, Timings
from app.nodes.console.scene.shell_state import shell_state
from app.view.words import ENGLISH
from tests.app.nodes.console.drawn_home import status_of

LINK = SimpleNamespace(silence_s=lambda: 0.0, say=ENGLISH, lease_in=lambda _: LeaseStatus())


@pytest.mark.parametrize(("frames", "age_ms"), [(0, None), (7, 42)])
def test_without_a_frame_there_is_no_age_of_one(frames, age_ms):
    status = status_of(frames=frames, timings=Timings(frame_age_ms=42.0 if frames else 0.0))
    shown = shell_state(
        status, LINK, None, instance="a", has_map=False, explanation=None, goals=0, calls=0
    )
    assert shown.frame_age_ms == age_ms
