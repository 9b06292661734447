from msgspec.structs import replace

from app.messages.status import GoalStatus
from app.nodes.console.panels.last_questions import LastQuestions
from tests.app.nodes.console.drawn_home import status_of

HAT = ("hat", "", "a flat")


def _asked(goal_ids):
    last = LastQuestions()
    last.accepted(HAT, set(goal_ids), HAT[:2])
    return last


def test_a_question_whose_goals_go_on_is_told_once():
    last = _asked([1, 2])
    assert last.repeats(HAT), "before the navigator has told of the goals"
    assert not last.repeats(HAT), "pressed again: it is meant"
    last = _asked([1, 2])
    last.follow(status_of(queue=[GoalStatus(goal_id=2, object="mug")]))
    assert not last.repeats(("hat", "in the hall", "a flat"))
    assert last.repeats(HAT)


def test_a_question_that_is_over_may_be_asked_again():
    last = _asked([1, 2])
    over = [GoalStatus(goal_id=n, object="hat", outcome="exhausted") for n in (1, 2)]
    last.follow(status_of(goal=over[0], history=[over[1]]))
    assert not last.repeats(HAT)
    assert not LastQuestions().repeats(HAT)


def test_a_question_that_is_over_is_outdated_by_the_next_goal():
    last = _asked([1])
    found = GoalStatus(goal_id=1, object="hat", outcome="found")
    mug = GoalStatus(goal_id=2, object="mug", outcome="active")
    last.follow(status_of("found", goal=found))
    assert not last.take_outdated(), "it may be asked again"
    last.follow(status_of(goal=mug, queue=[GoalStatus(goal_id=1, object="hat")]))
    assert not last.take_outdated(), "it waits"
    last.follow(status_of(goal=mug, history=[found]))
    assert last.take_outdated() == [("hat", "")]
    assert not last.take_outdated(), "said once"


def test_words_that_are_searched_for_in_another_scenario_are_not_outdated():
    last = _asked([1])
    last.accepted(("hat", "", "an office"), {2}, HAT[:2])
    found = GoalStatus(goal_id=1, object="hat", outcome="found")
    second = GoalStatus(goal_id=2, object="hat", outcome="active")
    last.follow(status_of(goal=second, history=[found]))
    assert not last.take_outdated()
    mug = GoalStatus(goal_id=3, object="mug", outcome="active")
    last.follow(status_of(goal=mug, history=[found, replace(second, outcome="found")]))
    assert last.take_outdated() == [("hat", "")]


def test_another_question_in_between_changes_nothing():
    last = _asked([1])
    last.accepted(("mug", "", "a flat"), {2}, ("mug", ""))
    assert last.repeats(HAT)
