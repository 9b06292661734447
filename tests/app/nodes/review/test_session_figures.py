"""Where a review opens."""

from types import SimpleNamespace

import msgspec
import pytest

from app.messages.status import GoalStatus, Status, Timings
from app.nodes.review.session_figures import ReviewSession, TimelineMark, figures_of, opening_s
from app.recording.timeline import SessionTimeline, TimedStatus, TrailPoint


def session(*marks, duration_s=60.0):
    return ReviewSession(
        sessions=[], duration_s=duration_s, notes=[], problems=[],
        marks=[TimelineMark(at_s=at_s, kind=kind, text="") for at_s, kind in marks],
    )  # fmt: skip


def test_a_review_opens_at_the_last_find_when_its_effect_is_visible():
    assert opening_s(session((5.0, "query"), (20.0, "found"), (31.0, "found"))) == (
        pytest.approx(31.3)
    )


def test_a_find_at_the_very_end_opens_at_the_end():
    assert opening_s(session((59.9, "found"))) == 60.0


def test_without_a_find_a_review_opens_at_the_end():
    assert opening_s(session((5.0, "query"))) == 60.0
    assert opening_s(session(duration_s=0.0)) == 0.0


def test_the_figures_of_several_searches_are_those_of_all_and_of_none_before():
    last = Status(
        robot="scout", version="0.1.0", stamp_ns=0, wall_ns=0, state="searching", why="",
        goal=GoalStatus(goal_id=2, object="cup", outcome="active"), queue=[],
        history=[
            GoalStatus(goal_id=7, object="tv", outcome="found"),
            GoalStatus(goal_id=1, object="hat", outcome="found"),
        ],
        find=None, streams=[],
        timings=Timings(), frames=1, elapsed_s=1.0, path_length_m=0.5, best_ooi=0.02,
        explored_m2=3.0, surface_voxels=1, voxel_size_m=0.1, map_revision=1,
    )  # fmt: skip
    hat = GoalStatus(goal_id=1, object="hat", outcome="active")
    seen = [
        TimedStatus(0, msgspec.structs.replace(last, goal=hat, history=[])),
        TimedStatus(1, msgspec.structs.replace(last, history=[])),
    ]
    trail = [TrailPoint(0, 0.0, 0.0, 0.0), TrailPoint(1, 3.0, 4.0, 0.0)]
    recording = SimpleNamespace(duration_s=9.0)
    figures = figures_of("s", recording, SessionTimeline(trail=trail, statuses=seen, last=last))
    assert [(goal.object, goal.outcome) for goal in figures.goals] == [
        ("hat", "found"), ("cup", "unfinished"),
    ]  # fmt: skip
    assert (figures.path_length_m, figures.best_ooi) == (5.0, None)
