"""Goals of a session in which the navigator was started again."""

from types import SimpleNamespace
from typing import Any

import msgspec
import pytest

from app.messages import keys
from app.messages.control import encode
from app.messages.status import GoalStatus
from app.recording.session_goals import goals_of, runs_of, searches_of
from app.recording.timeline import SessionTimeline, pack_timeline, unpack_timeline
from app.recording.timeline import timeline_of as read_timeline

S = 1_000_000_000
HAT = GoalStatus(goal_id=1, object="hat", outcome="found", position_world=(1.0, 2.0, 0.4))


def goal(number, name, outcome="active", **more):
    return GoalStatus(goal_id=number, object=name, outcome=outcome, **more)


@pytest.fixture
def timeline_of(made_up):
    """Return what builds the timeline of statuses, (frames, present goal, history, queue)."""

    def build(*statuses):
        timeline = SessionTimeline()
        for n, (frames, present, history, queue) in enumerate(statuses):
            status = msgspec.structs.replace(
                made_up.status_of(1), frames=frames, goal=present, history=history, queue=queue
            )
            timeline.add(status, n * S)
        return timeline

    return build


def named(timeline):
    return [(one.goal_id, one.object, one.outcome) for one in goals_of(timeline)]


def test_what_was_found_before_a_restart_stays_found(timeline_of):
    timeline = timeline_of(
        (10, goal(1, "hat"), [], []),
        (20, HAT, [], []),
        (30, goal(2, "plant", "exhausted"), [HAT], []),
        (2, None, [], []),
        (5, goal(1, "mug"), [], []),
        (9, goal(1, "mug", "found"), [], []),
    )
    expected = [(1, "hat", "found"), (2, "plant", "exhausted"), (1, "mug", "found")]
    assert named(timeline) == expected
    stored = unpack_timeline(pack_timeline(timeline))
    assert named(stored) == expected
    assert [len(run.statuses) for run in runs_of(stored)] == [3, 3]
    assert [run.last.frames for run in runs_of(stored)] == [30, 9]


def test_a_search_that_is_resumed_is_one(timeline_of):
    timeline = timeline_of(
        (10, goal(1, "hat"), [], []),
        (20, HAT, [], []),
        (30, goal(2, "mug"), [HAT], [goal(3, "plant", "queued")]),
        (5, goal(1, "mug"), [], [goal(2, "plant", "queued")]),
        (9, goal(2, "plant"), [goal(1, "mug", "found")], []),
    )
    assert named(timeline) == [(1, "hat", "found"), (1, "mug", "found"), (2, "plant", "active")]
    parts = [one.parts for one in searches_of(timeline)]
    assert parts == [((0, 1),), ((0, 2), (1, 1)), ((1, 2),)]


def test_a_search_that_waits_during_a_whole_run_is_one(timeline_of):
    timeline = timeline_of(
        (10, goal(1, "mug"), [], []),
        (1, None, [], [goal(1, "mug", "queued")]),
        (0, None, [], [goal(1, "mug", "queued")]),
        (4, goal(1, "mug", "found"), [], []),
    )
    assert named(timeline) == [(1, "mug", "found")]
    assert searches_of(timeline)[0].parts == ((0, 1), (2, 1))


@pytest.mark.parametrize(
    "after",
    [goal(1, "mug", context="in the kitchen"), goal(2, "mug"), goal(1, "plant")],
    ids=["asked otherwise", "asked later", "another"],
)
def test_another_search_of_after_a_restart_is_another(timeline_of, after):
    timeline = timeline_of((10, goal(1, "mug"), [], []), (5, after, [], []))
    assert len(goals_of(timeline)) == 2


def test_what_was_found_is_searched_for_anew_if_it_is_asked_for_again(timeline_of):
    timeline = timeline_of((10, HAT, [], []), (5, goal(1, "hat"), [], []))
    assert named(timeline) == [(1, "hat", "found"), (1, "hat", "active")]


def test_the_timeline_of_an_older_file_is_built_anew_if_a_navigator_was_restarted(timeline_of):
    timeline = timeline_of((10, HAT, [], []), (5, goal(1, "mug"), [], []))
    assert not timeline.lacks_runs()
    timeline.ended.clear()
    assert timeline.lacks_runs()
    messages = [
        SimpleNamespace(key=keys.STATUS, payload=encode(status), time_ns=n * S)
        for n, status in enumerate(one.status for one in timeline.statuses)
    ]
    recording: Any = SimpleNamespace(
        attachment=lambda _: pack_timeline(timeline), all_messages=lambda _: messages
    )
    assert named(read_timeline(recording)) == [(1, "hat", "found"), (1, "mug", "active")]
