"""Which goal an event is of."""

from types import SimpleNamespace

from app.nodes.navigator.node import Navigator
from ippon.guidance.language.naming import resolve_object
from ippon.mission.goal import Goal
from ippon.mission.snapshot import MissionEvent
from ippon.vocabulary import MATTERPORT_40


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
