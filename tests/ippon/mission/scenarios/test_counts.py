"""Several of one kind: a search goes on behind each find; "the other one" is another one."""

import dataclasses

import pytest

from ippon.guidance.language.naming import resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.goal import Goal
from ippon.mission.snapshot import Find, MissionState
from ippon.vocabulary import MATTERPORT_40

PLANTS = (
    ("plant", "plant", (7.2, 0.4, 0.0), (7.6, 0.8, 0.9)),
    ("plant", "plant", (0.4, 3.2, 0.0), (0.8, 3.6, 0.9)),
)


@pytest.fixture
def make_find():
    """Return a find at a place."""

    def make(position_world):
        return Find(
            position_world=position_world, size_m=(0.4, 0.4, 0.9), probability=0.9, voxels=40,
            box_px=None,
        )  # fmt: skip

    return make


@pytest.fixture
def hall(searcher, room):
    """A hall with two plants, and a robot in its middle that is asked for some of them."""

    def make(count):
        robot = searcher([*room(8.0, 4.0), *PLANTS], 4.0, 2.0)
        resolved = resolve_object("plant", MATTERPORT_40)
        goal = Goal(goal_id=1, object="plant", display="plants", category=resolved.category)
        levels = EmbeddedPrior().levels(resolved, "", MATTERPORT_40)
        robot.mission.goals.set_goal(dataclasses.replace(goal, count=count), levels)
        return robot

    return make


def events(results, kind):
    return [e.text for r in results for e in r.snapshot.events if e.kind == kind]


def places(finds):
    """Return which of the two plants each find is."""
    return [0 if find.position_world[0] > 4.0 else 1 for find in finds]


@pytest.mark.slow
def test_fewer_than_wanted_end_exhausted_and_say_how_many(hall):
    robot = hall(3)
    results = robot.search(300.0)
    last = results[-1].snapshot
    assert (last.state, last.outcome, last.find) == (MissionState.EXHAUSTED, "exhausted", None)
    assert sorted(places(last.counted)) == [0, 1]
    assert last.why == "plants: 2 of 3 found: everything reachable was seen"


@pytest.mark.slow
def test_what_an_earlier_run_has_found_counts_and_is_not_found_again(hall, make_find):
    robot = hall(2)
    known = make_find((7.4, 0.6, 0.45))
    robot.mission.goals.count_again(1, [known])
    last = robot.search(200.0)[-1].snapshot
    assert last.state is MissionState.FOUND
    assert last.counted == (dataclasses.replace(known, number=1),)
    assert places([last.find]) == [1]


@pytest.mark.slow
def test_two_are_found_and_a_rejected_one_does_not_count_and_is_not_found_again(hall):
    robot = hall(2)
    results = robot.search(200.0)
    both = results[-1].snapshot
    assert both.state is MissionState.FOUND
    assert sorted(places([*both.counted, both.find])) == [0, 1]
    assert events(results, "counted") == ["plants: 1 of 2 found: continuing the search"]
    assert len(events(results, "found")) == 2
    (wrong,), right = both.counted, both.find
    assert (wrong.number, right.number) == (1, 2)
    goals = robot.mission.goals
    assert goals.confirm_find(number=2)
    assert goals.reject_find(number=1)
    assert not goals.reject_find(number=1), "it is rejected already"
    results = robot.search(200.0)
    last = results[-1].snapshot
    assert (last.state, last.why) == (
        MissionState.EXHAUSTED, "plants: 1 of 2 found: everything reachable was seen",
    )  # fmt: skip
    assert last.counted == (dataclasses.replace(right, confirmed=True),)
    assert last.rejected == (wrong,)
    assert events(results, "rejected") == ["not the plant 1: continuing the search"]
    assert events(results, "confirmed") == ["plant 2: confirmed by the operator"]
    assert not events(results, "found")


def test_what_was_counted_is_judged_one_by_one_while_the_search_goes_on(hall, make_find):
    robot = hall(4)
    goals, search = robot.mission.goals, robot.mission.search
    goals.count_again(1, [make_find((x, 0.6, 0.45)) for x in (2.0, 5.0, 8.0)])
    first, second, third = search.counted
    assert goals.confirm_find(number=1)
    assert goals.reject_find(number=2)
    assert not goals.confirm_find(number=7)
    assert not goals.confirm_find(), "none has ended the search"
    assert search.counted == [dataclasses.replace(first, confirmed=True), third]
    assert (search.refused, search.state) == ([second], MissionState.STARTING)
    assert search.is_rejected(second)
    search.announce(make_find((7.4, 0.6, 0.45)))
    assert search.find.number == 4, "a number names one find for good"


def test_finds_of_a_goal_that_nobody_has_set_are_refused(hall, make_find):
    with pytest.raises(ValueError, match="set a goal first"):
        hall(2).mission.goals.count_again(7, [make_find((7.4, 0.6, 0.45))])


@pytest.mark.slow
def test_the_other_one_is_not_the_one_that_was_found_before(hall):
    robot = hall(1)
    first = robot.search(200.0)[-1].snapshot
    search = robot.mission.search
    robot.mission.goals.set_goal(
        dataclasses.replace(search.goal, goal_id=2, other=True), search.guidance
    )
    second = robot.search(200.0)[-1].snapshot
    assert (first.state, second.state) == (MissionState.FOUND, MissionState.FOUND)
    assert sorted(places([first.find, second.find])) == [0, 1]


def test_the_other_one_is_none_that_was_rejected_either(hall, make_find):
    robot = hall(4)
    goals, search = robot.mission.goals, robot.mission.search
    goals.count_again(1, [make_find((x, 0.6, 0.45)) for x in (2.0, 5.0)])
    seen = search.finds
    assert goals.reject_find(number=2)
    goals.set_goal(dataclasses.replace(search.goal, goal_id=2, other=True), search.guidance)
    assert [robot.mission.search.is_rejected(find) for find in seen] == [True, True]
    goals.set_goal(dataclasses.replace(search.goal, goal_id=3), search.guidance)
    assert not any(robot.mission.search.is_rejected(find) for find in seen)


def test_all_are_found_once_nothing_is_left_to_explore(hall, make_find):
    search = hall("all").mission.search
    search.counted += [make_find((7.4, 0.6, 0.4)), make_find((0.6, 3.4, 0.4))]
    assert search.wants_more
    search.end()
    assert (search.state, places([*search.counted, search.find])) == (MissionState.FOUND, [0, 1])
    assert search.ended_text() == "plants: 2 found: everything reachable was seen"


def test_a_search_for_all_without_any_ends_exhausted(hall):
    search = hall("all").mission.search
    search.end()
    assert (search.state, search.find) == (MissionState.EXHAUSTED, None)
    assert search.ended_text() == "plants not found: everything reachable was seen"


def test_a_search_for_two_wants_one_more(hall, make_find):
    search = hall(2).mission.search
    assert search.wants_more
    search.counted.append(make_find((7.4, 0.6, 0.4)))
    assert not search.wants_more
