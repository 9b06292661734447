"""What each search of a session took."""

from types import SimpleNamespace

import pytest

from app.export.search_table import effort_of, total_effort
from app.messages.status import GoalStatus, Status, Timings
from app.recording.timeline import SessionTimeline, TimedStatus


def status_of(elapsed_s, outcomes, lead, *, tour=True):
    """Return a status of goals with these outcomes, of which one leads."""
    goals = {n: GoalStatus(goal_id=n, object="keys", outcome=of) for n, of in outcomes.items()}
    return Status(
        robot="r", version="0", stamp_ns=0, wall_ns=0, state="searching", why="",
        goal=goals[lead], queue=[], history=[], find=None, streams=[], timings=Timings(),
        frames=1, elapsed_s=elapsed_s, path_length_m=elapsed_s / 4, best_ooi=0.0, explored_m2=0.0,
        surface_voxels=0, voxel_size_m=0.1, map_revision=1,
        tour=list(goals.values()) if tour else [],
    )  # fmt: skip


def session_of(*statuses):
    timed = [TimedStatus(n, status) for n, status in enumerate(statuses)]
    return SimpleNamespace(timeline=SessionTimeline(statuses=timed))


def efforts_of(session, *goals):
    efforts = [effort_of(session, goal) for goal in goals]
    return [(one.seconds, one.path_length_m) for one in efforts], total_effort(efforts)


def test_a_tour_counts_once_and_a_goal_that_never_led_counts():
    session = session_of(
        status_of(10.0, {3: "active", 4: "active"}, 3),
        status_of(60.0, {3: "active", 4: "found"}, 3),
        status_of(100.0, {3: "found", 4: "found"}, 3),
    )
    assert efforts_of(session, 3, 4) == ([(60.0, 15.0), (10.0, 2.5)], (60.0, 15.0))


def test_the_lead_passes_to_the_other_goal():
    session = session_of(
        status_of(60.0, {3: "active", 4: "active"}, 3),
        status_of(100.0, {3: "found", 4: "active"}, 4),
    )
    assert efforts_of(session, 3, 4) == ([(60.0, 15.0), (100.0, 25.0)], (100.0, 25.0))


@pytest.mark.parametrize("waits", [40.0, 400.0])
def test_searches_one_after_another_add_up_and_a_find_that_waits_takes_no_time(waits):
    session = session_of(
        status_of(40.0, {1: "active"}, 1, tour=False),
        status_of(waits, {1: "found"}, 1, tour=False),
        status_of(20.0, {2: "active"}, 2, tour=False),
    )
    efforts, total = efforts_of(session, 1, 2)
    assert [seconds for seconds, _ in efforts] == [40.0, 20.0]
    assert total[0] == 60.0
