"""What a navigator does when a goal starts, in which order, and what it says when goals end."""

from types import SimpleNamespace

from app.nodes.navigator.node import Navigator
from app.nodes.navigator.state.planned_search import PlannedSearch
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.goal import Goal
from ippon.mission.snapshot import MissionEvent
from ippon.vocabulary import MATTERPORT_40
from tests.app.nodes.navigator.conftest import finds


def test_what_an_earlier_run_has_judged_is_excluded_before_memory_is_asked():
    one, two = finds(2)
    resolved = resolve_object("mug", MATTERPORT_40)
    goal = Goal.of(resolved, 3)
    planned = PlannedSearch(
        goal=goal,
        resolved=resolved,
        guidance=EmbeddedPrior().levels(resolved, "", MATTERPORT_40),
        elapsed_ms=0.0,
        counted=(one,),
        rejected=(two,),
    )
    calls = []
    search = SimpleNamespace(goal=goal)
    goals = SimpleNamespace(
        set_goal=lambda *_: calls.append("set_goal"),
        count_again=lambda *known: calls.append(known),
    )
    navigator = SimpleNamespace(
        _goals=SimpleNamespace(next=lambda *_, **__: (planned,)),
        _services=SimpleNamespace(
            guidance=SimpleNamespace(fitted=lambda search: search),
            goals=SimpleNamespace(availability=SimpleNamespace(holds=False)),
        ),
        _mission=SimpleNamespace(goals=goals, search=search),
        _memory=SimpleNamespace(begin=calls.append),
        _report=SimpleNamespace(goal_set=lambda _: None),
    )
    Navigator._start_next_goal(navigator)
    assert calls == ["set_goal", (3, (one,), (two,)), search]


def test_each_goal_of_a_tour_that_ends_is_reported_by_its_own_number():
    said = []
    events = [
        MissionEvent(kind="exhausted", text="hat not found", goal_id=4),
        MissionEvent(kind="exhausted", text="mug not found", goal_id=5),
        MissionEvent(kind="contact", text="blocked"),
    ]
    navigator = SimpleNamespace(
        _goals=SimpleNamespace(
            statuses=lambda: (None, [], []), follow_tour=lambda *_: [4, 5], announced=lambda: None
        ),
        _events=SimpleNamespace(report=lambda *what: said.append(what)),
        _services=SimpleNamespace(
            goals=SimpleNamespace(availability=SimpleNamespace(hold=lambda _: None))
        ),
        config=SimpleNamespace(hold_find_s=0.0),
    )
    goal = Goal.of(resolve_object("hat", MATTERPORT_40), 4)
    snapshot = SimpleNamespace(outcome="exhausted", goal=goal, tour=("hat", "mug"), events=events)
    Navigator._conclude(navigator, snapshot)
    assert said == [
        ("exhausted", "hat not found", 4, None),
        ("exhausted", "mug not found", 5, None),
        ("contact", "blocked", None, None),
    ]
