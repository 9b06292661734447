import msgspec

from app.messages.status import GoalStatus
from app.view.model.candidates import Candidate
from app.view.model.unfound_goals import UnfoundGoals
from tests.app.nodes.console.drawn_home import status_of

PLACES = (Candidate(point_world=(1.0, 2.0, 0.5), probability=0.4, label=0, picture=None),)
HAT = GoalStatus(goal_id=1, object="hat", outcome="active")
GONE = GoalStatus(goal_id=1, object="hat", display="red hat", outcome="exhausted")
MUG = GoalStatus(goal_id=2, object="mug", outcome="active")


def _followed(*statuses):
    unfound = UnfoundGoals()
    for status in statuses:
        unfound.follow(status, lambda: PLACES)
    return unfound.latest


def test_what_was_not_found_is_kept_with_its_places_while_the_next_goal_runs():
    over = status_of("exhausted", goal=GONE)
    latest = _followed(status_of(goal=HAT), over, status_of(goal=MUG, history=[GONE]))
    assert (latest.goal, latest.places) == (GONE, PLACES)
    again = GoalStatus(goal_id=3, object="hat", outcome="active")
    assert _followed(status_of(goal=HAT), over, status_of(goal=again, history=[GONE])) is None


def test_what_was_not_found_is_past_once_it_is_dismissed_or_a_later_find_is_confirmed():
    over = status_of("exhausted", goal=GONE)
    found = GoalStatus(goal_id=2, object="mug", outcome="found")
    confirmed = GoalStatus(goal_id=2, object="mug", outcome="found", confirmed=True)
    assert _followed(status_of(goal=HAT), over, status_of("found", goal=found, history=[GONE]))
    last = status_of("found", goal=confirmed, history=[GONE])
    assert _followed(status_of(goal=HAT), over, last) is None
    unfound = UnfoundGoals()
    unfound.follow(status_of(goal=HAT), lambda: PLACES)
    unfound.follow(over, lambda: PLACES)
    other = status_of("exhausted", goal=msgspec.structs.replace(GONE, took_s=31.4))
    unfound.dismiss(_followed(status_of(goal=HAT), other))
    assert unfound.latest is not None, "that is the goal of another run"
    unfound.dismiss(_followed(status_of(goal=HAT), over))
    unfound.follow(over, lambda: PLACES)
    assert unfound.latest is None


def test_an_end_that_was_missed_is_told_without_places_of_the_next_goal():
    latest = _followed(status_of(goal=HAT), status_of(goal=MUG, history=[GONE]))
    assert (latest.goal, latest.places) == (GONE, None)


def test_what_ended_before_the_first_status_is_no_news():
    assert _followed(status_of(goal=MUG, history=[GONE])) is None
    assert _followed(status_of("exhausted", goal=GONE)).goal == GONE


def test_of_a_tour_the_goals_without_a_find_are_told():
    found = GoalStatus(goal_id=2, object="mug", outcome="found", tour=1)
    tour = status_of(goal=found, tour=[GONE, found])
    assert _followed(status_of(goal=HAT), tour).goal == GONE


def test_goals_of_a_tour_that_end_together_are_told_together_with_the_places_of_the_one_shown():
    laptop, mug = (
        GoalStatus(goal_id=n, object=name, outcome="exhausted", tour=2)
        for n, name in ((2, "laptop"), (3, "mug"))
    )
    going = [GoalStatus(goal_id=one.goal_id, object=one.object, tour=2) for one in (laptop, mug)]
    before = status_of(goal=going[0], tour=going)
    latest = _followed(before, status_of("exhausted", goal=laptop, tour=[laptop, mug]))
    assert (latest.goals, latest.places) == ((laptop, mug), PLACES)
    latest = _followed(before, status_of("exhausted", goal=HAT, tour=[laptop, mug]))
    assert (latest.goals, latest.places) == ((mug, laptop), None), "the map is that of another one"


def test_a_goal_that_goes_on_is_not_shown_as_not_found():
    going = status_of(goal=HAT)
    assert _followed(going, status_of("exhausted", goal=GONE), going) is None
    assert (
        _followed(going, status_of("exhausted", goal=GONE), going, status_of(goal=GONE)).goal
        == GONE
    )
