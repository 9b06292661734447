"""A tour: several goals on one map, each found, rejected, cancelled or confirmed by itself."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from ippon.evaluation.episode import EpisodeLimits, run_episode
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.levels import Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.goal import Goal
from ippon.mission.snapshot import Find, GoalState, MissionState
from ippon.mission.tour import target_of
from ippon.vocabulary import MATTERPORT_40

PLACES = {
    "toilet": ((6.4, 0.4, 0.0), (7.0, 1.0, 0.8)),
    "bathtub": ((0.3, 3.2, 0.0), (1.9, 3.9, 0.6)),
    "plant": ((7.0, 3.2, 0.0), (7.5, 3.7, 0.9)),
}


def goals_of(*names):
    for n, name in enumerate(names):
        resolved = resolve_object(name, MATTERPORT_40)
        yield Goal.of(resolved, n + 1), EmbeddedPrior().levels(resolved, "", MATTERPORT_40)


def test_what_hangs_is_looked_for_above_the_things_that_it_is_one_of():
    heights = [
        target_of(goal).highest_m
        for goal, _ in goals_of("air conditioner", "microwave", "armchair", "gizmo")
    ]
    assert heights[0] == heights[3] == np.inf
    assert max(heights[1:3]) < 2.4


@pytest.fixture
def home(searcher, room):
    """A hall with three objects, and a robot in its middle that is asked for all of them."""

    def make(*names, boxes=PLACES):
        things = [(name, name, *at) for name, at in boxes.items()]
        robot = searcher([*room(8.0, 4.0), *things], 3.6, 2.0)
        robot.mission.goals.set_goals(list(goals_of(*names)))
        return robot

    return make


def states(robot):
    return {one.goal.object: one.state.value for one in robot.last.tour}


def found_at(position_world, size_m):
    return Find(
        position_world=position_world, size_m=size_m, probability=0.9, voxels=40, box_px=None
    )


def events(results, kind):
    return [e.text for r in results for e in r.snapshot.events if e.kind == kind]


def test_what_was_looked_at_is_forgotten_at_the_start_and_not_for_other_levels(home, monkeypatch):
    robot = home("toilet", "bathtub")
    mission, calls = robot.mission, []
    for name in ("set_goal", "set_levels"):
        monkeypatch.setattr(mission._planner, name, lambda name=name, **_: calls.append(name))
    mission.goals.set_goals(list(goals_of("toilet", "bathtub")))
    (_, _), (_, levels) = goals_of("toilet", "bathtub")
    mission.goals.set_guidance(levels, goal_id=2)
    mission.goals.cancel_goal(1)
    assert calls == ["set_goal", "set_levels", "set_levels"]
    ((goal, levels),) = goals_of("plant")
    mission.goals.set_goal(goal, levels)
    mission.goals.set_guidance(levels)
    assert calls[3:] == ["set_goal", "set_levels"]


@pytest.mark.slow
def test_all_of_three_are_found_and_announced_as_they_come(home):
    robot = home("toilet", "bathtub", "plant")
    results = robot.search(200.0)
    assert states(robot) == dict.fromkeys(("toilet", "bathtub", "plant"), "found")
    assert robot.last.state is MissionState.FOUND
    announced = events(results, "found")
    assert len(announced) == 3
    assert {text.split(":")[0] for text in announced} == {
        "found toilet", "found bathtub", "found plant",
    }  # fmt: skip
    for one in robot.last.tour:
        low, high = np.array(PLACES[one.goal.object])
        assert one.find is not None
        assert (np.array(one.find.position_world) > low - 0.2).all()
        assert (np.array(one.find.position_world) < high + 0.2).all()
    counts = [sum(o.state is GoalState.FOUND for o in r.snapshot.tour) for r in results]
    assert counts == sorted(counts)
    assert set(counts) == {0, 1, 2, 3}, "each is announced while the others are still missing"
    assert MissionState.STARTING not in [r.snapshot.state for r in results], "a tour goes on"
    assert "toilet and bathtub and plant in one tour" in events(results, "goal_set")[0]


@pytest.mark.slow
def test_a_rejected_find_is_searched_for_again_and_the_others_stay_found(home):
    robot = home("toilet", "plant", boxes={"toilet": PLACES["toilet"], "plant": PLACES["plant"]})
    robot.search(120.0)
    assert states(robot) == {"toilet": "found", "plant": "found"}
    assert robot.mission.goals.confirm_find(goal_id=2)
    assert not robot.mission.goals.reject_find(goal_id=2)
    assert robot.mission.goals.reject_find(), "the only find that was not judged"
    assert not robot.mission.goals.reject_find(goal_id=1), "it is no longer found"
    results = robot.search(150.0)
    assert events(results[:1], "rejected") == ["not the toilet: continuing the search"]
    assert states(robot) == {"toilet": "not_found", "plant": "confirmed"}
    assert robot.last.state is MissionState.EXHAUSTED
    assert robot.last.goal.object == "toilet"


def test_one_of_several_finds_of_a_tour_is_judged_with_its_goal(home):
    goals = home("toilet", "plant").mission.goals
    search = goals.tour.of(2)
    search.goal = dataclasses.replace(search.goal, count=3)
    finds = [found_at((x, 1.0, 0.4), (0.4, 0.4, 0.9)) for x in (2.0, 4.0, 6.0)]
    goals.count_again(2, finds[:2])
    assert not goals.reject_find(goal_id=1, number=1)
    assert goals.confirm_find(goal_id=2, number=1)
    assert goals.tour.statuses[1].state is GoalState.MISSING
    # All are found; the last one is confirmed, and the second one, which nobody judged, is wrong.
    search.announce(finds[2])
    search.state = MissionState.FOUND
    goals.tour.settle()
    assert goals.confirm_find(goal_id=2)
    assert goals.tour.statuses[1].state is GoalState.CONFIRMED
    assert not goals.confirm_find(goal_id=2), "once is enough"
    assert goals.reject_find(goal_id=2, number=2)
    status = goals.tour.statuses[1]
    assert status.state is GoalState.MISSING
    assert [(one.number, one.confirmed) for one in status.counted] == [(1, True), (3, True)]
    assert [one.number for one in status.rejected] == [2]
    assert search in goals.running


def test_the_goal_leads_whose_candidate_the_viewpoint_is_beside(home):
    """Of a large object the middle is farther away than that of a small one behind the robot."""
    tour = home("plant", "bathtub").mission.goals.tour
    plant, bathtub = tour.searches
    bathtub.candidates = (found_at((4.0, 1.3, 0.3), (1.0, 1.9, 0.6)),)
    plant.candidates = (found_at((4.0, -0.9, 0.5), (0.3, 0.3, 0.4)),)
    target = SimpleNamespace(position_world=(4.0, 0.0, 0.0))
    assert tour.focus(SimpleNamespace(target=target, ends_search=True)) is bathtub


@pytest.mark.slow
def test_a_cancelled_goal_leaves_and_a_confirmed_one_stays(home):
    robot = home("toilet", "bathtub", "plant")
    robot.search(150.0, lambda r: any(o.state is GoalState.FOUND for o in r.snapshot.tour))
    goals = robot.mission.goals
    found = next(one for one in robot.last.tour if one.state is GoalState.FOUND).goal
    assert goals.confirm_find(goal_id=found.goal_id)
    assert not goals.confirm_find(goal_id=found.goal_id), "once is enough"
    assert not goals.reject_find(goal_id=found.goal_id), "a confirmed find is settled"
    missing = next(one for one in robot.last.tour if one.state is GoalState.MISSING)
    goals.cancel_goal(missing.goal.goal_id)
    assert missing.goal.object not in goals.asked
    assert found.object not in goals.asked
    results = robot.search(150.0)
    end = states(robot)
    assert end.pop(found.object) == "confirmed"
    assert end.pop(missing.goal.object) == "cancelled"
    assert list(end.values()) == ["found"]
    assert events(results, "cancelled") == [f"the search for {missing.goal.display} was cancelled"]


def test_cancelling_the_last_goal_or_all_ends_the_tour(home):
    robot = home("toilet", "bathtub")
    goals = robot.mission.goals
    goals.cancel_goal(9)
    assert len(goals.running) == 2, "there is no such goal"
    goals.cancel_goal(1)
    assert goals.search is not None
    assert goals.search.goal.object == "bathtub"
    goals.cancel_goal(2)
    assert goals.search is goals.tour is None
    goals.set_goals(list(goals_of("toilet", "plant")))
    goals.cancel_goal()
    assert goals.search is None
    assert goals.asked == ()


def test_the_plan_is_for_the_highest_level_of_each_label(home):
    robot = home("toilet", "bathtub")
    tour = robot.mission.goals.tour
    each = [one.guidance.levels() for one in tour.searches]
    assert (tour.levels() == np.maximum(*each)).all()
    assert (each[0] != each[1]).any()
    row = tour.searches[0].guidance.rows[3]
    changed = dataclasses.replace(row, level=Level.CERTAIN)
    rows = [changed if r is row else r for r in tour.searches[0].guidance.rows]
    robot.mission.goals.set_guidance(
        dataclasses.replace(tour.searches[0].guidance, rows=tuple(rows)), goal_id=1
    )
    assert tour.levels()[3] == Level.CERTAIN
    with pytest.raises(ValueError, match="set a goal first"):
        robot.mission.goals.set_guidance(tour.searches[0].guidance, goal_id=7)


@pytest.mark.slow
def test_one_goal_after_a_tour_has_the_map_for_itself(home):
    robot = home("toilet", "bathtub")
    robot.search(2.0)
    assert len(robot.last.tour) == 2
    goal, guidance = next(goals_of("plant"))
    robot.mission.goals.set_goal(goal, guidance)
    robot.search(2.0)
    assert robot.last.tour == ()
    assert robot.mission.voxel_map.ooi == "plant"


@pytest.mark.parametrize(
    ("names", "problem"),
    [
        (("toilet",), "takes 2 to 8 goals"),
        (("toilet", "toilet"), "of different labels; got toilet, toilet"),
        (
            ("toilet", "bathtub", "plant", "sofa", "bed", "chair", "table", "sink", "tv"),
            "takes 1 to 8 objects of interest",
        ),
    ],
)
def test_what_is_no_tour_is_refused(searcher, room, names, problem):
    robot = searcher(room(4.0, 4.0), 2.0, 2.0)
    with pytest.raises(ValueError, match=problem):
        robot.mission.goals.set_goals(list(goals_of(*names)))
    assert robot.mission.search is None


@pytest.mark.slow
def test_two_runs_of_one_tour_are_the_same_run(home):
    runs = []
    for _ in range(2):
        robot = home("toilet", "plant")
        limits = EpisodeLimits(max_time_s=12.0)
        runs.append([r.command for r in run_episode(robot.world, robot.mission, limits)])
    assert runs[0] == runs[1]
