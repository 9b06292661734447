import dataclasses

import pytest

from app.nodes.navigator.state.goal_queue import HISTORY, GoalQueue, PlannedSearch
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.levels import Guidance
from ippon.mission.goal import Goal


def search(name="hat", provider="test"):
    guidance = Guidance(ooi=name, context="", provider=provider, rows=())
    return PlannedSearch(
        goal=Goal(goal_id=0, object=name, display=name),
        resolved=resolve_object(name, ()),
        guidance=guidance,
        elapsed_ms=0.0,
    )


def names(book):
    active, queue, history = book.statuses()
    return (
        (active.object, active.outcome) if active else None,
        [goal.object for goal in queue],
        [(goal.object, goal.outcome) for goal in history],
    )


def test_numbers_count_from_one_and_places_from_zero():
    book = GoalQueue(5)
    assert book.add(search("hat")) == (1, 0)
    assert book.next().goal.goal_id == 1
    assert book.add(search("mug")) == (2, 1)
    assert book.add(search("key")) == (3, 2)


def test_one_after_the_other():
    book = GoalQueue(5)
    for name in ("hat", "mug"):
        book.add(search(name))
    assert book.next().goal.object == "hat"
    assert book.next() is None
    assert names(book) == (("hat", "active"), ["mug"], [])
    book.conclude("found")
    assert names(book) == (("hat", "found"), ["mug"], [])
    assert book.next().goal.object == "mug"
    assert names(book) == (("mug", "active"), [], [("hat", "found")])


def test_a_query_after_a_find_starts_at_once():
    book = GoalQueue(5)
    book.add(search("hat"))
    book.next()
    book.conclude("found")
    assert book.add(search("mug")) == (2, 0)
    assert book.next().goal.object == "mug"


def test_a_cancelled_goal_leaves_the_stage():
    book = GoalQueue(5)
    book.add(search("hat"))
    book.next()
    book.conclude("cancelled")
    assert names(book) == (None, [], [("hat", "cancelled")])
    assert book.active() is None


def test_a_goal_that_is_over_keeps_its_outcome_when_it_is_cancelled():
    book = GoalQueue(5)
    book.add(search("hat"))
    book.next()
    book.conclude("found")
    book.conclude("cancelled")
    assert names(book) == (None, [], [("hat", "found")])


def test_a_find_is_held_before_those_who_waited_but_not_before_a_new_query():
    book = GoalQueue(5)
    book.add(search("hat"))
    book.add(search("mug"))
    book.next()
    book.conclude("found")
    assert book.next(hold=True) is None
    assert book.next(hold=False).goal.object == "mug"
    book.conclude("found")
    book.add(search("key"))
    assert book.next(hold=True).goal.object == "key"


def test_only_a_find_is_held():
    book = GoalQueue(5)
    book.add(search("hat"))
    book.add(search("mug"))
    book.next()
    book.conclude("exhausted")
    assert book.next(hold=True).goal.object == "mug"


def test_a_rejected_find_goes_on():
    book = GoalQueue(5)
    book.add(search("hat"))
    book.add(search("mug"))
    book.next()
    book.conclude("found")
    book.reopen()
    assert book.next() is None
    assert names(book) == (("hat", "active"), ["mug"], [])


def test_a_goal_is_amended_while_it_is_searched_for_or_waits():
    book = GoalQueue(5)
    for name in ("hat", "mug", "key"):
        book.add(search(name))
    book.next()
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
