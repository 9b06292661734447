import dataclasses

import pytest

from app.messages.status import CountedFind
from app.nodes.navigator.state.goal_queue import HISTORY, JOIN_S, GoalQueue
from app.nodes.navigator.state.planned_search import PlannedSearch
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.levels import Guidance
from ippon.mission.goal import Goal
from ippon.mission.snapshot import Find, GoalState
from ippon.mission.snapshot import GoalStatus as TourGoal
from tests.app.nodes.navigator.conftest import finds


def search(name="hat", provider="test"):
    guidance = Guidance(ooi=name, context="", provider=provider, rows=())
    return PlannedSearch(
        goal=Goal(goal_id=0, object=name, display=name),
        resolved=resolve_object(name, ()),
        guidance=guidance,
        elapsed_ms=0.0,
    )


def begun(*wanted):
    """Return a queue whose first goal is searched for."""
    book = GoalQueue(5)
    for name in wanted:
        book.add(search(name))
    book.next()
    return book


def names(book):
    active, queue, history = book.statuses()
    return (
        (active.object, active.outcome) if active else None,
        [goal.object for goal in queue],
        [(goal.object, goal.outcome) for goal in history],
    )


def test_numbers_count_from_one_and_places_from_zero():
    book = GoalQueue(5)
    assert book.add(search("hat"))[:2] == (1, 0)
    assert book.next()[0].goal.goal_id == 1
    assert book.add(search("mug"))[:2] == (2, 1)
    assert book.add(search("key"))[:2] == (3, 2)


def test_one_after_the_other():
    book = GoalQueue(5)
    for name in ("hat", "mug"):
        book.add(search(name))
    assert book.next()[0].goal.object == "hat"
    assert book.next() == ()
    assert names(book) == (("hat", "active"), ["mug"], [])
    book.conclude("found")
    assert names(book) == (("hat", "found"), ["mug"], [])
    assert book.next()[0].goal.object == "mug"
    assert names(book) == (("mug", "active"), [], [("hat", "found")])


def test_a_query_after_a_find_starts_at_once():
    book = begun("hat")
    book.conclude("found")
    assert book.add(search("mug"))[:2] == (2, 0)
    assert book.next()[0].goal.object == "mug"


def test_a_cancelled_goal_leaves_the_stage():
    book = begun("hat")
    book.conclude("cancelled")
    assert names(book) == (None, [], [("hat", "cancelled")])
    assert book.active() is None


def test_a_goal_that_is_over_keeps_its_outcome_when_it_is_cancelled():
    book = begun("hat")
    book.conclude("found")
    book.conclude("cancelled")
    assert names(book) == (None, [], [("hat", "found")])


def test_a_find_is_held_before_those_who_waited_but_not_before_a_new_query():
    book = begun("hat", "mug")
    book.conclude("found")
    assert book.next(hold=True) == ()
    assert book.next(hold=False)[0].goal.object == "mug"
    book.conclude("found")
    book.add(search("key"))
    assert book.next(hold=True)[0].goal.object == "key"


def test_only_a_find_is_held():
    book = begun("hat", "mug")
    book.conclude("exhausted")
    assert book.next(hold=True)[0].goal.object == "mug"


def test_a_rejected_find_goes_on():
    book = begun("hat", "mug")
    book.conclude("found")
    book.reopen()
    assert book.next() == ()
    assert names(book) == (("hat", "active"), ["mug"], [])


def test_finds_before_the_last_are_shown_with_their_goal():
    book = GoalQueue(5)
    several = search("chair")
    several = dataclasses.replace(several, goal=dataclasses.replace(several.goal, count=2))
    book.add(several)
    book.next()
    first, wrong, last = finds(3)
    book.note_finds(1, (first,), (wrong,))
    book.conclude("found", 1, last)
    active = book.statuses()[0]
    counted = CountedFind(number=1, position_world=first.position_world)
    assert (active.count, active.counted, active.rejected) == (2, [counted], 1)
    assert (active.position_world, active.find) == (last.position_world, last.number)
    assert [book.judged(None, number) for number in (1, 2, 3)] == [(1, False), None, (1, True)]
    assert book.judged(2, 1) is None


def test_a_goal_whose_find_is_rejected_after_all_is_not_confirmed():
    book = begun("hat")
    book.conclude("found", 1, finds(1)[0])
    book.confirm(1)
    assert book.statuses()[0].confirmed
    book.reopen(1)
    assert not book.statuses()[0].confirmed


def test_a_goal_is_amended_while_it_is_searched_for_or_waits():
    book = begun("hat", "mug", "key")
    for goal_id in (1, 3):
        amended = book.amend(goal_id, lambda s: dataclasses.replace(s, failed=s.goal.object))
        assert amended is book.find(goal_id)
    assert (book.find(1).failed, book.find(2).failed, book.find(3).failed) == ("hat", "", "key")
    assert book.active() is book.find(1)
    book.conclude("found")
    book.next()
    assert book.find(1) is None
    assert book.amend(1, lambda _: pytest.fail("a goal that is over was changed")) is None


def test_queue_and_history_are_bounded():
    book = GoalQueue(3)
    assert [book.add(search()) is not None for _ in range(5)] == [True, True, True, False, False]
    for _ in range(2 * HISTORY):
        book.next()
        book.conclude("exhausted")
        book.add(search())
    assert len(book.statuses()[2]) == HISTORY


def tour_of(*wanted, size=20):
    """Return a queue in which goals wait as one tour."""
    book = GoalQueue(size)
    for n, name in enumerate(wanted):
        book.add(search(name), joins=1 if n else None)
    return book


def objects(started):
    return [one.goal.object for one in started]


def reported(book, **states):
    """Return the goals of a tour as the mission reports them."""
    find = Find(
        position_world=(1.0, 2.0, 0.5), size_m=(0.1, 0.1, 0.1), probability=0.9, voxels=3,
        box_px=None,
    )  # fmt: skip
    known = {one.goal.object: one.goal for one in book.unfinished()}
    return [
        TourGoal(
            goal=known.get(name) or Goal(goal_id=n, object=name, display=name),
            state=state,
            find=find if state is GoalState.FOUND else None,
        )
        for n, (name, state) in enumerate(states.items(), 1)
    ]


def test_goals_that_belong_together_start_together_before_those_who_waited():
    book = GoalQueue(5)
    book.add(search("hat"))
    book.add(search("mug"))
    assert book.add(search("key"), joins=1)[:4] == (3, 0, 1, "")
    assert book.add(search("bag"), joins=2)[:4] == (4, 2, 2, "")
    assert objects(book.next()) == ["hat", "key"]
    assert book.in_tour()
    assert [goal.object for goal in book.tour()] == ["hat", "key"]
    assert book.next() == ()
    for goal_id in (1, 3):
        book.conclude("exhausted", goal_id)
    assert objects(book.next()) == ["mug", "bag"]
    assert [goal.object for goal in book.statuses()[2]] == ["hat", "key"]


def test_a_goal_joins_a_search_that_has_just_begun_and_waits_for_one_that_goes_on():
    book = GoalQueue(5)
    book.add(search("hat"))
    book.add(search("cap"))
    assert objects(book.next(now=100.0)) == ["hat"]
    early = dataclasses.replace(search("key"), asked_at=100.0 + JOIN_S)
    assert book.add(early, joins=1)[:4] == (3, 0, 1, "")
    assert objects(book.next(now=100.1)) == ["hat", "key"]
    late = dataclasses.replace(search("mug"), asked_at=100.1 + JOIN_S)
    place = book.add(late, joins=1)
    assert place[:3] == (4, 2, None)
    assert place.note == "the search for goal 1 has begun: this is a search of its own"
    assert book.next() == ()
    # Those who join while they can, and are too late when the search is looked at, come next.
    book.add(dataclasses.replace(search("bag"), asked_at=100.2), joins=1)
    book.conclude("found", 1)
    assert book.next() == ()
    book.conclude("found", 3)
    assert objects(book.next()) == ["bag"]


def test_what_does_not_fit_into_a_tour_is_a_search_of_its_own():
    book = tour_of("a", "b", "c", "d", "e", "f", "g", "h")
    place = book.add(search("i"), joins=1)
    assert place[:3] == (9, 8, None)
    assert "at most 8 objects" in place.note
    assert book.add(search("j"), joins=9)[:3] == (10, 8, 9)
    assert objects(book.next()) == list("abcdefgh")
    assert objects(GoalQueue.next(tour_of("hat", "hat"))) == ["hat"]
    assert "hat is in the tour of goal 1 already" in tour_of("hat").add(search(), joins=1).note
    assert "goal 7 is neither" in tour_of("hat").add(search("mug"), joins=7).note


def test_the_goals_of_a_tour_end_one_by_one():
    book = tour_of("hat", "mug", "key")
    book.next()
    missing, found, gone = GoalState.MISSING, GoalState.FOUND, GoalState.NOT_FOUND
    assert book.follow_tour(1, reported(book, hat=missing, mug=missing, key=missing)) == []
    assert book.follow_tour(3, reported(book, hat=missing, mug=found, key=missing)) == [2]
    assert names(book) == (("key", "active"), [], [])
    assert [goal.outcome for goal in book.tour()] == ["active", "found", "active"]
    assert book.tour()[1].position_world == (1.0, 2.0, 0.5)
    assert book.follow_tour(3, reported(book, hat=missing, mug=found, key=found)) == [3]
    assert (book.announced(), book.announced(2), book.announced(1)) == (3, 2, None)
    book.confirm(3)
    assert book.announced() == 2
    book.reopen(2)
    assert book.announced() is None
    assert objects(book.unfinished()) == ["hat", "mug"]
    book.conclude("cancelled", 2)
    assert [goal.object for goal in book.tour()] == ["hat", "key"]
    assert book.follow_tour(1, reported(book, hat=gone, key=found)) == [1]
    assert [goal.outcome for goal in book.tour()] == ["exhausted", "found"]
    # The rejection of a find returns goals that were not found to the plan.
    book.follow_tour(1, reported(book, hat=missing, key=found))
    assert objects(book.unfinished()) == ["hat"]
    book.conclude("cancelled")
    assert names(book)[0] is None
    assert names(book)[2] == [("mug", "cancelled"), ("hat", "cancelled"), ("key", "found")]


def test_a_tour_moves_to_the_front_as_one():
    book = GoalQueue(5)
    for name in ("cap", "hat"):
        book.add(search(name))
    book.add(search("mug"), joins=2)
    assert book.move_first(3)
    assert [goal.object for goal in book.statuses()[1]] == ["hat", "mug", "cap"]
    assert book.remove(2)
    assert objects(book.next()) == ["mug"]
