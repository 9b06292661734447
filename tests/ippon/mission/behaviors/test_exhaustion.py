"""Steps that promise nothing are counted."""

import dataclasses
from types import SimpleNamespace

import pytest

from ippon.mission.behaviors.config import ExhaustionConfig
from ippon.mission.behaviors.exhaustion import Exhaustion
from ippon.mission.config import MissionConfig
from ippon.mission.journal import Journal
from ippon.mission.snapshot import MissionState


@pytest.fixture
def last_plan(searcher, room):
    """The plan of a robot that found a bed."""
    bed = ("bed", "bed", (4.0, 1.2, 0.0), (5.9, 3.0, 0.55))
    robot = searcher([*room(6.0, 4.5), bed], 1.0, 2.0)
    robot.ask("bed")
    robot.search(60.0)
    assert robot.last.state is MissionState.FOUND
    return robot.last.plan


@pytest.mark.slow
def test_steps_without_time_neither_end_a_search_nor_count_for_its_going_on(last_plan):
    exhaustion = Exhaustion(MissionConfig(), None, None, Journal())
    idle_gain = MissionConfig().exhaustion.idle_gain
    nothing = dataclasses.replace(
        last_plan, target=None, exhausted=True, max_gain_per_s=0.5 * idle_gain
    )
    open_yet = dataclasses.replace(nothing, exhausted=False, cut_short=True)
    search = SimpleNamespace(empty_steps=0, idle_steps=0)

    def counted(*plans):
        for plan in plans:
            exhaustion.count(search, plan)
        return search.empty_steps, search.idle_steps

    assert counted(nothing, nothing) == (2, 2)
    assert counted(open_yet, open_yet) == (2, 2)
    assert counted(nothing) == (3, 3)
    assert counted(dataclasses.replace(nothing, exhausted=False)) == (0, 4)
    promising = dataclasses.replace(open_yet, max_gain_per_s=2.0 * idle_gain)
    assert counted(nothing, promising) == (1, 0)
    target = last_plan.target
    assert counted(dataclasses.replace(promising, target=target)) == (0, 0)


@pytest.mark.parametrize("wrong", [{"idle_gain": -0.1}, {"idle_steps": 0}])
def test_an_end_of_exploring_without_meaning_is_refused(wrong):
    with pytest.raises(ValueError, match="idle_gain must not be negative"):
        ExhaustionConfig(**wrong)
