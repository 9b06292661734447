"""Steps that promise nothing are counted."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from ippon.command import Command
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.config import ExhaustionConfig
from ippon.mission.behaviors.exhaustion import Exhaustion
from ippon.mission.config import MissionConfig
from ippon.mission.finds.rejection import set_aside
from ippon.mission.goal import Goal
from ippon.mission.journal import Journal
from ippon.mission.search import Search
from ippon.mission.snapshot import Find, MissionState
from ippon.vocabulary import MATTERPORT_40


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
    exhaustion.count(search, nothing, counts=False)
    assert counted(nothing) == (3, 3)
    assert counted(dataclasses.replace(nothing, exhausted=False)) == (0, 4)
    promising = dataclasses.replace(open_yet, max_gain_per_s=2.0 * idle_gain)
    assert counted(nothing, promising) == (1, 0)
    target = last_plan.target
    assert counted(dataclasses.replace(promising, target=target)) == (0, 0)


@pytest.fixture
def tour():
    """Two searches of a tour that have seen everything, on an empty map, and their journal."""
    config = MissionConfig()
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), MATTERPORT_40)
    searches = []
    for goal_id, name in ((4, "hat"), (5, "mug")):
        resolved = resolve_object(name, MATTERPORT_40)
        guidance = EmbeddedPrior().levels(resolved, "", MATTERPORT_40)
        searches.append(Search(Goal.of(resolved, goal_id), guidance, config))
    plan = SimpleNamespace(
        exhausted=True, target=None, cut_short=False, ends_search=False, closer_look=False,
        max_gain_per_s=0.0, full=False,
    )  # fmt: skip
    frame = SimpleNamespace(T_world_base=np.eye(4))
    step = SimpleNamespace(
        search=searches[0], searches=searches, plan=plan, hold=Command(), frame=frame, counts=True
    )
    journal = Journal()
    exhaustion = Exhaustion(config, voxel_map, None, journal)
    most = max(config.exhaustion.empty_steps, config.exhaustion.idle_steps)

    def act(steps=most):
        """Return the kinds and goals of the events of some steps."""
        for _ in range(steps):
            exhaustion.act(step)
        return [(event.kind, event.goal_id) for event in journal.take()]

    return SimpleNamespace(searches=searches, act=act, config=config, voxel_map=voxel_map)


def test_each_goal_of_a_tour_ends_with_an_event_of_its_own_number(tour):
    assert tour.act(tour.config.exhaustion.empty_steps) == [("exhausted", 4), ("exhausted", 5)]


def test_a_tour_goes_on_to_what_is_reconsidered_for_one_goal_before_any_of_them_ends(tour):
    doubted = Find(
        position_world=(3.0, 0.0, 0.5), size_m=(0.1, 0.1, 0.1), probability=1.0, voxels=3,
        box_px=None,
    )  # fmt: skip
    set_aside(tour.searches[1], tour.voxel_map, doubted)
    empty_steps = tour.config.exhaustion.empty_steps
    assert tour.act(empty_steps) == [("reconsidered", None)]
    assert tour.act(empty_steps - 1) == [], "as many steps as before"
    assert tour.act(1) == [("exhausted", 4), ("exhausted", 5)]


@pytest.mark.parametrize("wrong", [{"idle_gain": -0.1}, {"idle_steps": 0}])
def test_an_end_of_exploring_without_meaning_is_refused(wrong):
    with pytest.raises(ValueError, match="idle_gain must not be negative"):
        ExhaustionConfig(**wrong)
