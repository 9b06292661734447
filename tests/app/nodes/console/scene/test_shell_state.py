"""What the bar of the page shows of a status."""

from types import SimpleNamespace

import pytest

from app.messages.lease import LeaseStatus
from app.messages.status import FindReport, GoalStatus, Timings
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


@pytest.mark.parametrize(("count", "name"), [(1, "red chairs"), (2, "chair 2")])
def test_a_find_of_several_has_its_number(count, name):
    find = FindReport(
        goal_id=4, object="chair", position_world=(1.0, 2.0, 0.4), size_m=(0.5, 0.5, 0.9),
        probability=1.0, voxels=90, number=2,
    )  # fmt: skip
    goal = GoalStatus(goal_id=4, object="chair", display="red chairs", count=count)
    shown = shell_state(
        status_of(goal=goal, find=find),
        LINK, None, instance="a", has_map=False, explanation=None, goals=0, calls=0,
    )  # fmt: skip
    assert shown.find is not None
    assert shown.find.name == name
