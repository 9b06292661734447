"""What each search of a session took."""

import msgspec
import pytest

from app.export.search_table import efforts_of, places_text, search_table, total_effort
from app.messages.status import CountedFind, GoalStatus, Status, Timings
from app.recording.session_goals import SessionSearch, runs_of, searches_of
from app.recording.timeline import SessionTimeline, TimedStatus
from app.view.words import ENGLISH, Words

GOALS = {n: GoalStatus(goal_id=n, object="keys") for n in range(5)}


def search_of(goal):
    """Return the search for a goal in a session of one run."""
    return SessionSearch(goal=goal, parts=((0, goal.goal_id),))


def status_of(elapsed_s, outcomes, lead, *, tour=True, frames=1):
    """Return a status of goals with these outcomes, of which one leads."""
    goals = {n: GoalStatus(goal_id=n, object="keys", outcome=of) for n, of in outcomes.items()}
    return Status(
        robot="r", version="0", stamp_ns=0, wall_ns=0, state="searching", why="",
        goal=goals[lead], queue=[], history=[], find=None, streams=[], timings=Timings(),
        frames=frames, elapsed_s=elapsed_s, path_length_m=elapsed_s / 4, best_ooi=0.0,
        explored_m2=0.0, surface_voxels=0, voxel_size_m=0.1, map_revision=1,
        tour=list(goals.values()) if tour else [],
    )  # fmt: skip


def timeline_of(*statuses):
    timed = [TimedStatus(n, status) for n, status in enumerate(statuses)]
    return SessionTimeline(statuses=timed, last=statuses[-1])


def taken(timeline, *goals):
    efforts = efforts_of(runs_of(timeline), [search_of(GOALS[n]) for n in goals])
    return [(one.seconds, one.path_length_m) for one in efforts], total_effort(efforts)


def test_a_tour_counts_once_and_a_goal_that_never_led_counts():
    timeline = timeline_of(
        status_of(10.0, {3: "active", 4: "active"}, 3),
        status_of(60.0, {3: "active", 4: "found"}, 3),
        status_of(100.0, {3: "found", 4: "found"}, 3),
    )
    assert taken(timeline, 3, 4) == ([(60.0, 15.0), (10.0, 2.5)], (60.0, 15.0))


def test_the_lead_passes_to_the_other_goal():
    timeline = timeline_of(
        status_of(60.0, {3: "active", 4: "active"}, 3),
        status_of(100.0, {3: "found", 4: "active"}, 4),
    )
    assert taken(timeline, 3, 4) == ([(60.0, 15.0), (100.0, 25.0)], (100.0, 25.0))


@pytest.mark.parametrize("waits", [40.0, 400.0])
def test_searches_one_after_another_add_up_and_a_find_that_waits_takes_no_time(waits):
    timeline = timeline_of(
        status_of(40.0, {1: "active"}, 1, tour=False),
        status_of(waits, {1: "found"}, 1, tour=False),
        status_of(20.0, {2: "active"}, 2, tour=False),
    )
    efforts, total = taken(timeline, 1, 2)
    assert [seconds for seconds, _ in efforts] == [40.0, 20.0]
    assert total[0] == 60.0


def test_the_table_says_where_each_was_found():
    goals = [
        GoalStatus(
            goal_id=1, object="hat", outcome="found", position_world=(0.67, 1.4, 0.49),
            room="living_room",
        ),
        GoalStatus(goal_id=2, object="keys", outcome="exhausted"),
    ]  # fmt: skip
    timeline = timeline_of(status_of(40.0, {1: "active"}, 1, tour=False))
    table = search_table(timeline, [search_of(goal) for goal in goals], ENGLISH)
    assert "<th>Outcome</th><th>Place</th>" in table
    assert "<td>living room, at (0.7, 1.4) m, z = 0.5 m</td>" in table
    assert places_text(goals[1], ENGLISH) == ""
    german = places_text(goals[0], Words("de"))
    assert german == "Wohnzimmer, bei (0,7; 1,4) m, z = 0,5 m"


def test_of_several_that_were_found_each_place_is_said():
    goal = GoalStatus(
        goal_id=1, object="chair", outcome="found", position_world=(3.0, 0.0, 0.4), count=2,
        counted=[CountedFind(number=1, position_world=(1.0, 2.0, 0.4), room="Anna's room")],
    )  # fmt: skip
    assert places_text(goal, ENGLISH) == (
        "Anna's room, at (1.0, 2.0) m, z = 0.4 m; at (3.0, 0.0) m, z = 0.4 m"
    )


def test_a_search_of_after_a_restart_has_the_time_of_its_own():
    timeline = SessionTimeline()
    for second, status in enumerate(
        [
            status_of(300.0, {1: "active"}, 1, tour=False, frames=900),
            status_of(20.0, {1: "active"}, 1, tour=False, frames=60),
        ]
    ):
        mug = msgspec.structs.replace(status.goal, object=("keys", "mug")[second], outcome="found")
        timeline.add(status, 2 * second * 10**9)
        timeline.add(msgspec.structs.replace(status, goal=mug), (2 * second + 1) * 10**9)
    searches = searches_of(timeline)
    assert [one.goal.object for one in searches] == ["keys", "mug"]
    efforts = efforts_of(runs_of(timeline), searches)
    assert [one.seconds for one in efforts] == [300.0, 20.0]
    assert total_effort(efforts) == (320.0, 80.0)
    table = search_table(timeline, searches, ENGLISH)
    assert "<td>300.0 s</td>" in table
    assert "<td>20.0 s</td>" in table


def test_a_search_that_is_resumed_after_a_restart_took_the_time_of_both_runs():
    timeline = SessionTimeline()
    timeline.add(status_of(300.0, {1: "active"}, 1, tour=False, frames=900), 0)
    timeline.add(status_of(20.0, {1: "active"}, 1, tour=False, frames=60), 10**9)
    (search,) = searches_of(timeline)
    assert total_effort(efforts_of(runs_of(timeline), [search])) == (320.0, 80.0)
