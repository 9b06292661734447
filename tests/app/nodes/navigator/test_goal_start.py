"""What a navigator does when a goal starts, in which order."""

from types import SimpleNamespace

from app.nodes.navigator.node import Navigator
from app.nodes.navigator.state.planned_search import PlannedSearch
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.goal import Goal
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
