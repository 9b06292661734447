"""The planner as a whole, on maps whose every voxel is known."""

import math
import time
from itertools import pairwise

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.guidance.levels import Level, LevelProbabilities
from ippon.mapping.arrays import FREE, OCCUPIED
from ippon.planning.config import PlannerConfig
from ippon.planning.plan import NodeKind, Plan
from ippon.planning.planner import ViewpointPlanner
from ippon.planning.roadmap.sampling import SamplingConfig
from ippon.planning.selection import target_selector as target_selector_module
from ippon.planning.selection.target_hysteresis import retention_of
from ippon.planning.terrain.motion_check import move_between
from ippon.planning.visibility import viewpoint_store as viewpoint_store_module
from ippon.planning.visibility.evaluation_scheduler import ViewpointEvaluationConfig
from ippon.planning.visibility.region_weights import Stroke, WeightGrid
from ippon.robot import HABITAT, ZED
from tests.ippon.planning.test_deadline import Clock

PROBABILITIES = LevelProbabilities().as_array()
POSE = base_pose(2.0, 2.8, 0.0, 0.0)


def make(robot=ZED, seed=0, t_min=4.0, **config) -> ViewpointPlanner:
    planner = ViewpointPlanner(PlannerConfig(**config), robot, seed)
    planner.set_goal(probabilities=PROBABILITIES, termination_min=t_min)
    return planner


def make_hurried(clock, budget_s=1.0, **config) -> ViewpointPlanner:
    """A planner with a budget in seconds."""
    planner = ViewpointPlanner(PlannerConfig(step_budget_s=budget_s, **config), ZED, 0, clock)
    planner.set_goal(probabilities=PROBABILITIES, termination_min=4.0)
    return planner


def run(planner, volume, steps=12, pose=POSE, tilt=-0.2) -> Plan:
    for _ in range(steps):
        plan = planner.step(volume.arrays(), pose, tilt)
    return plan


def assert_consistent(plan: Plan, volume) -> None:
    tree = plan.tree
    n = len(tree.parents)
    assert tree.parents[0] == -1
    assert ((tree.parents[1:] >= 0) & (tree.parents[1:] < n)).all()
    for row in range(1, n):
        hops, at = 0, row
        while at != 0:
            at = int(tree.parents[at])
            hops += 1
            assert hops <= n, "a cycle"
        assert tree.path_costs_s[row] > 0.0
    for name in ("yaws_rad", "tilts_rad", "gains", "terminations", "levels", "kinds"):
        assert len(getattr(tree, name)) == n
    if plan.target is not None:
        np.testing.assert_allclose(plan.path_world[-1], plan.target.position_world, atol=1e-9)
        assert len(plan.path_world) >= 2


def test_a_closed_room_that_was_seen_is_exhausted(dense_map):
    volume = dense_map().room((0.8, 0.8), (4.8, 4.8))
    plan = run(make(), volume, 25)
    assert plan.exhausted
    assert plan.target is None
    assert len(plan.path_world) == 0
    assert len(plan.tree.parents) > 8, "low-gain nodes stay as a road map"
    assert (plan.tree.kinds[1:] == NodeKind.MINIMAL).all()
    assert_consistent(plan, volume)


def test_viewpoints_with_little_gain_face_the_direction_of_travel(dense_map):
    tree = run(make(), dense_map().room((0.8, 0.8), (4.8, 4.8)), 25).tree
    places, yaws = tree.positions_world[:, :2], tree.yaws_rad
    way = places[1:] - places[tree.parents[1:]]
    facing = np.column_stack([np.cos(yaws[1:]), np.sin(yaws[1:])])
    assert (tree.kinds[1:] == NodeKind.MINIMAL).all()
    ahead = (way * facing).sum(axis=1) / np.linalg.norm(way, axis=1)
    np.testing.assert_allclose(ahead, 1.0, atol=1e-6)


def reveal(volume, low_m, high_m):
    """Show a part along x of a corridor 2 m wide and 16 m long."""
    for low, high, state in (
        ((low_m, 0.7, -0.1), (high_m, 2.9, 2.0), OCCUPIED),
        ((max(0.9, low_m), 0.8, 0.0), (high_m, 2.8, 2.0), FREE),
    ):
        volume.fill(low, high, state, ooi=0.0, level=1)
    return volume


@pytest.mark.slow
def test_a_full_roadmap_makes_room_for_what_lies_farther_away(dense_map):
    """It fills up along the way, and what lies beyond is explored all the same."""
    planner = make(max_nodes=70, sampling=SamplingConfig(local_spacing_m=0.3))
    volume, x = reveal(dense_map((19.2, 4.0, 2.4)), 0.8, 3.6), 1.6
    for _ in range(110):
        plan = planner.step(volume.arrays(), base_pose(x, 1.8, 0.0, 0.0), -0.2)
        assert not plan.exhausted
        if x < 12.8:
            reveal(volume, x + 2.0, x + 2.2)
            x += 0.15
    assert plan.target is not None
    assert plan.target.position_world[0] > 13.0
    assert len(plan.tree.parents) <= 71
    assert_consistent(plan, volume)


@pytest.mark.slow
def test_a_roadmap_that_is_full_for_good_says_so(dense_map):
    volume = reveal(dense_map((19.2, 4.0, 2.4)), 0.8, 14.0)
    planner = make(max_nodes=10)
    plan = run(planner, volume, 40, base_pose(1.6, 1.8, 0.0, 0.0))
    assert plan.full
    assert plan.exhausted
    assert not run(make(), volume, 40, base_pose(1.6, 1.8, 0.0, 0.0)).full


def test_what_if_is_answered_after_a_viewpoint_was_added_late(dense_map):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (4.8, 4.8))
    volume.fill((4.8, 2.3, 0.0), (4.9, 3.3, 2.0), FREE)
    planner = make()
    plan = run(planner, volume, 12)
    planner._builder._sampler.add_at(np.array([2.35, 1.65]))
    preview = planner.preview(volume.arrays(), cues=True)
    assert preview is not None
    assert preview.position_world == plan.target.position_world


def test_a_door_to_the_unknown_attracts(dense_map):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (4.8, 4.8))
    volume.fill((4.8, 2.3, 0.0), (4.9, 3.3, 2.0), FREE)
    plan = run(make(), volume, 12)
    assert not plan.exhausted
    assert plan.target is not None
    assert plan.target.kind is NodeKind.EXPLORING
    x, y, _ = plan.target.position_world
    assert math.hypot(4.9 - x, 2.8 - y) < math.hypot(4.9 - 2.0, 0.0) + 0.5
    facing = np.array([math.cos(plan.target.yaw_rad), math.sin(plan.target.yaw_rad)])
    to_door = np.array([5.4 - x, 2.8 - y])
    assert facing @ to_door / np.linalg.norm(to_door) > 0.6
    assert_consistent(plan, volume)


@pytest.mark.slow
def test_unknown_space_that_stays_unknown_loses_its_gain(dense_map):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (4.8, 4.8))
    # A window: free to look through, impossible to settle.
    volume.fill((4.8, 2.3, 0.9), (4.9, 3.3, 1.6), FREE)
    planner = make()
    plan = run(planner, volume, 8)
    assert plan.target is not None
    for _ in range(60):
        pose = POSE
        if plan.target is not None:
            x, y, _ = plan.target.position_world
            pose = base_pose(x, y, 0.0, plan.target.yaw_rad)
        plan = planner.step(volume.arrays(), pose, plan.target.tilt_rad if plan.target else 0.0)
        if plan.exhausted:
            break
    assert plan.exhausted


def test_an_object_is_approached_and_framed(dense_map):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (6.4, 4.8))
    volume.fill((5.6, 2.4, 0.0), (6.2, 3.2, 0.6), OCCUPIED, ooi=0.97, level=Level.NEAR)
    plan = run(make(), volume, 10)
    assert plan.target is not None
    assert plan.target.kind is NodeKind.TERMINATING
    assert plan.target.termination > 4.0
    x, y, _ = plan.target.position_world
    nearest = np.array([min(max(x, 5.6), 6.2) - x, min(max(y, 2.4), 3.2) - y])
    assert np.linalg.norm(nearest) <= 0.9
    to_object = math.atan2(2.8 - y, 5.9 - x)
    assert abs(math.remainder(plan.target.yaw_rad - to_object, 2 * math.pi)) < 0.7
    assert plan.target.tilt_rad < 0.0, "it stands on the floor"
    assert_consistent(plan, volume)


def test_of_many_objects_those_at_the_robot_count(dense_map):
    """A hall full of chairs: there are more voxels than are considered at once."""
    volume = dense_map((11.2, 6.4, 2.4)).room((0.8, 0.8), (10.4, 4.8))
    volume.fill((0.8, 0.8, 0.0), (1.6, 4.8, 0.5), OCCUPIED, ooi=0.95, level=1)
    volume.fill((9.2, 2.4, 0.0), (9.6, 2.8, 0.5), OCCUPIED, ooi=0.95, level=1)
    here = base_pose(7.0, 2.8, 0.0, 0.0)
    plan = run(make(max_object_voxels=200), volume, 6, pose=here)
    assert plan.target is not None
    assert plan.target.kind is NodeKind.TERMINATING
    assert plan.target.position_world[0] > 7.0
    xy = plan.tree.positions_world[1:, :2]
    away = np.hypot(xy[:, 0] - 9.4, xy[:, 1] - 2.6)
    close = np.hypot(*(xy[:, None] - xy[None]).transpose(2, 0, 1)) + 9.0 * np.eye(len(xy))
    assert close[away < 1.0].min() < SamplingConfig().local_spacing_m


def test_an_object_behind_glass_does_not_terminate_from_afar(dense_map):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (4.0, 4.8))
    volume.fill((4.0, 0.8, 0.5), (4.1, 4.8, 1.5), FREE)
    volume.fill((5.6, 2.4, 0.5), (5.8, 3.2, 1.2), OCCUPIED, ooi=0.97)
    plan = run(make(), volume, 10)
    assert (plan.tree.terminations == 0.0).all()


def test_a_goal_begins_with_the_full_margin_whatever_the_one_before_had_opened(dense_map):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (4.8, 4.8))
    planner = make(second_chances=0)
    run(planner, volume, 6)
    planner._floor.relax()
    run(planner, volume, 6)
    planner.set_goal(probabilities=PROBABILITIES, termination_min=4.0)
    run(planner, volume, 2)
    floor = planner._floor
    assert floor.margin_m == floor.config.margin_m
    places = planner._roadmap.xy[planner._roadmap.alive]
    assert len(places) > 3
    clearances = [floor.clearance(*place) for place in places[1:]]
    assert min(clearances) >= floor.limits.radius + floor.margin_m - 1e-6


def test_other_levels_change_the_gain_without_a_ray(dense_map, monkeypatch):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (4.8, 4.8))
    volume.fill((4.8, 2.3, 0.0), (4.9, 3.3, 2.0), FREE)
    planner = make()
    # Long enough that nothing is left to evaluate.
    before = run(planner, volume, 40)
    volume.level[volume.state == OCCUPIED] = Level.FAR
    arrays = volume.arrays()
    rays = []
    cast_panorama = viewpoint_store_module.cast_panorama
    monkeypatch.setattr(
        viewpoint_store_module, "cast_panorama", lambda *a: rays.append(1) or cast_panorama(*a)
    )
    planner.set_goal(probabilities=PROBABILITIES, termination_min=4.0)
    after = planner.step(arrays, POSE, -0.2)
    assert len(rays) == 0
    assert (after.tree.levels[1:] == Level.FAR).sum() >= 3, "wherever walls are near in view"
    assert after.tree.gains.sum() < before.tree.gains.sum()
    assert len(after.tree.parents) >= len(before.tree.parents), "the tree is kept"


def test_other_levels_count_at_once_for_an_object_of_another_size(dense_map):
    """Its ranges are others: no viewpoint's evaluation holds, and few are evaluated in a step."""
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (4.8, 4.8))
    volume.fill((4.8, 2.3, 0.0), (4.9, 3.3, 2.0), FREE)
    planner = make(evaluation=ViewpointEvaluationConfig(per_step=2))
    before = run(planner, volume, 60)
    volume.level[volume.state == OCCUPIED] = Level.FAR
    ranges = planner._viewpoints.geometry.ranges
    planner.set_goal(probabilities=PROBABILITIES, termination_min=40.0)
    after = planner.step(volume.arrays(), POSE, -0.2)
    assert planner._viewpoints.geometry.ranges != ranges
    assert after.evaluated < 5 < (after.tree.levels[1:] == Level.FAR).sum()
    assert after.tree.gains.sum() < before.tree.gains.sum()


@pytest.mark.parametrize("same", [False, True])
def test_another_goal_does_not_end_where_the_object_of_the_last_one_stands(dense_map, same):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (6.8, 4.8))
    volume.fill((6.8, 2.3, 0.0), (6.9, 3.3, 2.0), FREE)
    volume.fill((3.0, 2.2, 0.0), (4.6, 3.4, 0.5), OCCUPIED, ooi=0.95, level=1)
    planner = make()
    assert run(planner, volume, 40).ends_search
    if not same:
        volume.ooi[volume.state == OCCUPIED] = 0
    planner.set_far_evidence(None)
    planner.set_goal(probabilities=PROBABILITIES, termination_min=4.0)
    ends = [planner.step(volume.arrays(), POSE, -0.2).ends_search for _ in range(5)]
    assert ends[-1] if same else not any(ends)


def test_rooms_that_are_inferred_again_leave_the_target_and_what_is_painted_does_not(two_rooms):
    volume = two_rooms(1.0)
    volume.fill((6.9, 2.0, 0.0), (7.0, 3.0, 1.8), FREE)

    def rooms(cells):
        weights = np.ones((cells, 20))
        weights[:10] = 0.25
        return WeightGrid(cell_m=0.4, origin=np.zeros(2, np.int64), weights=weights)

    planner = make()
    selector = planner._selector
    run(planner, volume, 6)
    planner.set_regions((), rooms(18))
    assert selector.node is None, "rooms were recognised: another viewpoint may be better by far"
    run(planner, volume, 6)
    target, path = selector.node, selector.path
    planner.set_regions((), rooms(20))
    assert (selector.node, selector.path) == (target, path)
    assert target is not None
    stroke = Stroke(kind="not_here", points=((2.0, 2.0),), radius_m=0.5)
    planner.set_regions((stroke,), rooms(20))
    assert selector.node is None
    run(planner, volume, 1)
    planner.set_regions((stroke,), None)
    assert selector.node is None


def test_a_target_is_kept_by_the_gain_that_is_left_on_the_path(dense_map, monkeypatch):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (4.8, 4.8))
    volume.fill((4.8, 2.3, 0.0), (4.9, 3.3, 2.0), FREE)
    shares = []

    def noted(*args, remaining, **named):
        shares.append(remaining)
        return retention_of(*args, remaining=remaining, **named)

    monkeypatch.setattr(target_selector_module, "retention_of", noted)
    planner = make()
    before = run(planner, volume, 12)
    # Other levels are no broken promise, though all there is to see is worth a tenth of it.
    weights = LevelProbabilities().as_array()
    planner.set_goal(probabilities=0.1 * weights, termination_min=4.0)
    shares.clear()
    after = run(planner, volume, 2)
    assert after.target.position_world == before.target.position_world
    assert after.target.gain < 0.5 * before.target.gain
    assert shares == pytest.approx([1.0] * len(shares))
    # What lies behind the door is seen from where the robot stands.
    volume.fill((4.9, 0.1, 0.0), (7.9, 5.5, 2.0), FREE)
    shares.clear()
    run(planner, volume, 1)
    assert min(shares) < 0.5


def test_a_narrow_corner_is_passed_only_with_the_local_planner(l_shape):
    pose = base_pose(1.3, 1.3, 0.0, 0.0)
    plan = run(make(), l_shape, 15, pose)
    assert (plan.tree.positions_world[:, 1] > 3.5).any()
    assert_consistent(plan, l_shape)


@pytest.mark.slow
def test_paths_keep_the_body_off_walls(two_rooms):
    volume = two_rooms(0.9)
    planner = make()
    plan = run(planner, volume, 20)
    assert (plan.tree.positions_world[:, 0] > 4.2).sum() >= 3, "the second room is reached"
    grid, limits = planner._floor.grid, planner._floor.limits
    tree = plan.tree
    straight = 0
    for row in range(1, len(tree.parents)):
        a = tree.positions_world[tree.parents[row], :2].astype(float)
        b = tree.positions_world[row, :2].astype(float)
        straight += move_between(grid, limits, a, b, 0.0)[0]
    # What is not straight came from the local planner.
    assert straight + len(planner._roadmap._curves) >= len(tree.parents) - 1


@pytest.mark.slow
def test_a_closed_door_cuts_the_tree_and_an_opened_one_joins_it(two_rooms):
    volume = two_rooms(0.9)
    planner = make()
    run(planner, volume, 20)
    volume.fill((3.8, 2.2, 0.0), (3.9, 3.4, 2.0), OCCUPIED, ooi=0.0, level=1)
    plan = run(planner, volume, 1)
    assert (plan.tree.positions_world[:, 0] < 3.9).all()
    volume.fill((3.8, 2.3, 0.0), (3.9, 3.3, 2.0), FREE)
    plan = run(planner, volume, 15)
    assert (plan.tree.positions_world[:, 0] > 4.2).sum() >= 3


@pytest.mark.slow
def test_the_tree_survives_a_move_of_the_robot(two_rooms):
    volume = two_rooms(0.9)
    planner = make()
    before = run(planner, volume, 20)
    after = planner.step(volume.arrays(), base_pose(5.4, 2.8, 0.0, 1.0), 0.0)
    assert len(after.tree.parents) >= len(before.tree.parents)
    np.testing.assert_allclose(after.tree.positions_world[0, :2], [5.4, 2.8], atol=1e-6)
    assert after.evaluated <= 7
    assert_consistent(after, volume)


def test_contacts_close_the_way_ahead_and_a_second_chance_opens_it(dense_map):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 2.3), (6.4, 3.3))
    volume.fill((6.4, 2.3, 0.0), (6.5, 3.3, 2.0), FREE)
    planner = make()
    pose = base_pose(2.0, 2.8, 0.0, 0.0)
    plan = run(planner, volume, 10, pose)
    assert plan.target is not None
    for y in (2.55, 2.8, 3.05):
        planner.mark_contact(base_pose(2.0, y, 0.0, 0.0))
    plan = planner.step(volume.arrays(), pose, -0.2)
    assert plan.target is None or plan.target.position_world[0] < 2.4
    plan = run(planner, volume, 40, pose)
    assert plan.target is not None
    assert plan.target.position_world[0] > 2.4


@pytest.mark.slow
@pytest.mark.parametrize("robot", [ZED, HABITAT])
def test_one_seed_gives_one_plan(two_rooms, robot):
    def story(seed):
        volume = two_rooms(1.0)
        volume.fill((6.9, 2.0, 0.0), (7.0, 3.0, 1.8), FREE)
        planner = make(robot, seed)
        return [planner.step(volume.arrays(), POSE, -0.2) for _ in range(8)]

    first, again, other = story(3), story(3), story(4)
    for a, b in zip(first, again, strict=True):
        assert a.target == b.target
        np.testing.assert_array_equal(a.path_world, b.path_world)
        for name in ("positions_world", "parents", "gains", "path_costs_s"):
            np.testing.assert_array_equal(getattr(a.tree, name), getattr(b.tree, name))
    assert not np.array_equal(first[-1].tree.positions_world, other[-1].tree.positions_world)


def test_work_per_step_is_bounded(dense_map):
    volume = dense_map((9.6, 9.6, 2.4)).room((0.8, 0.8), (8.8, 8.8), ooi=None)
    planner = make(samples_per_step=7, evaluation=ViewpointEvaluationConfig(per_step=3))
    sizes = [1]
    for _ in range(10):
        plan = planner.step(volume.arrays(), base_pose(4.0, 4.0, 0.0, 0.0), -0.2)
        assert plan.evaluated <= 4
        assert len(planner._roadmap.nodes) - sizes[-1] <= 7
        sizes.append(len(planner._roadmap.nodes))


def assert_driveable(planner, plan) -> None:
    grid, limits = planner._floor.grid, planner._floor.limits
    leave = planner._floor.clearance(*plan.path_world[0, :2])
    for a, b in pairwise(plan.path_world[:, :2]):
        assert move_between(grid, limits, a, b, planner._floor.margin_m, leave)[0]
        leave = math.inf


@pytest.mark.slow
def test_a_step_that_ran_out_of_time_returns_the_best_plan_so_far(dense_map):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (4.8, 4.8))
    volume.fill((4.8, 2.3, 0.0), (4.9, 3.3, 2.0), FREE)
    calm, hurried = make(), make_hurried(Clock(jump_s=10.0))
    expected = run(calm, volume, 40)
    sizes, cut_short = [0], []
    for _ in range(200):
        plan = hurried.step(volume.arrays(), POSE, -0.2)
        cut_short.append(plan.cut_short)
        assert not plan.exhausted
        assert plan.evaluated <= 1
        assert_consistent(plan, volume)
        if plan.target is not None:
            assert_driveable(hurried, plan)
        sizes.append(len(hurried._roadmap.nodes))
    assert cut_short[0]
    assert not cut_short[-1], "nothing is left to do"
    assert max(np.diff(sizes)) == 1
    # It takes longer, and comes to the same.
    nodes = hurried._roadmap.nodes
    assert (hurried._viewpoints.evaluated[nodes] >= 0).all()
    np.testing.assert_array_equal(hurried._roadmap.xy[nodes], calm._roadmap.xy[calm._roadmap.nodes])
    assert plan.target.position_world == expected.target.position_world


def test_a_room_is_exhausted_only_after_all_of_it_was_evaluated(dense_map):
    volume = dense_map().room((0.8, 0.8), (4.8, 4.8))
    calm, hurried = make(), make_hurried(Clock(jump_s=10.0))
    run(calm, volume, 25)
    for _ in range(400):
        plan = hurried.step(volume.arrays(), POSE, -0.2)
        if plan.exhausted:
            break
    assert plan.exhausted
    nodes = hurried._roadmap.nodes
    assert len(nodes) == len(calm._roadmap.nodes)
    assert not hurried._gain_is_left(volume.arrays(), hurried._tree)
    assert hurried._viewpoints.potential[nodes].max() < hurried.config.selection.min_gain


def test_a_step_without_time_to_join_all_has_not_shown_that_nothing_is_left(dense_map, monkeypatch):
    volume = dense_map().room((0.8, 0.8), (4.8, 4.8))
    planner = make_hurried(Clock())
    assert run(planner, volume, 40).exhausted
    clock = planner._clock

    def bridge(*_, deadline):
        clock.now_s += 0.7
        return not deadline.passed()

    monkeypatch.setattr(planner._builder._connector, "bridge", bridge)
    plan = run(planner, volume, 1)
    assert (plan.target, plan.cut_short, plan.exhausted) == (None, True, False)
    monkeypatch.undo()
    assert run(planner, volume, 1).exhausted


@pytest.mark.slow
def test_the_oldest_evaluation_is_repeated_even_after_the_deadline(dense_map, monkeypatch):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (4.8, 4.8))
    volume.fill((4.8, 2.3, 0.0), (4.9, 3.3, 2.0), FREE)
    planner = make_hurried(Clock(jump_s=10.0))
    # As if the map changed everywhere all the time: the target alone could take every turn.
    monkeypatch.setattr(
        planner._viewpoints, "stale", lambda nodes, *_: np.ones(len(nodes), np.bool_)
    )
    run(planner, volume, 120)
    nodes = planner._roadmap.nodes
    assert len(nodes) > 10
    assert (planner._viewpoints.evaluated[nodes] >= 0).all()


def test_a_narrow_corner_is_passed_by_a_local_way_found_in_pieces(l_shape):
    pose = base_pose(1.3, 1.3, 0.0, 0.0)
    planner = make_hurried(Clock(jump_s=10.0))
    for _ in range(200):
        plan = planner.step(l_shape.arrays(), pose, -0.2)
        assert not plan.exhausted or not planner._builder._connector._local_planner.unfinished
        if (plan.tree.positions_world[:, 1] > 3.5).any():
            break
    assert (plan.tree.positions_world[:, 1] > 3.5).any()
    assert_consistent(plan, l_shape)


def test_an_object_is_approached_by_steps_without_time(dense_map):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (6.4, 4.8))
    volume.fill((5.6, 2.4, 0.0), (6.2, 3.2, 0.6), OCCUPIED, ooi=0.97, level=Level.NEAR)
    plan = run(make_hurried(Clock(jump_s=10.0)), volume, 60)
    assert plan.target is not None
    assert plan.target.kind is NodeKind.TERMINATING


@pytest.mark.slow
def test_changes_of_the_map_are_followed_however_late_it_is(two_rooms):
    volume = two_rooms(0.9)
    planner = make_hurried(Clock(jump_s=10.0))
    plan = run(planner, volume, 150)
    assert (plan.tree.positions_world[:, 0] > 4.2).sum() >= 3
    volume.fill((3.8, 2.2, 0.0), (3.9, 3.4, 2.0), OCCUPIED, ooi=0.0, level=1)
    plan = run(planner, volume, 1)
    assert (plan.tree.positions_world[:, 0] < 3.9).all()


@pytest.mark.slow
def test_a_budget_that_is_not_used_up_changes_nothing(two_rooms):
    volume = two_rooms(1.0)
    volume.fill((6.9, 2.0, 0.0), (7.0, 3.0, 1.8), FREE)
    counted, timed = make(), make_hurried(Clock())
    for _ in range(15):
        a, b = (planner.step(volume.arrays(), POSE, -0.2) for planner in (counted, timed))
        assert not b.cut_short
        assert a.target == b.target
        assert (a.evaluated, a.exhausted, a.floor_gap) == (b.evaluated, b.exhausted, b.floor_gap)
        np.testing.assert_array_equal(a.path_world, b.path_world)
        for name in ("positions_world", "parents", "gains", "path_costs_s"):
            np.testing.assert_array_equal(getattr(a.tree, name), getattr(b.tree, name))


def test_a_real_clock_ends_a_step_early(dense_map):
    volume = dense_map((9.6, 9.6, 2.4)).room((0.8, 0.8), (8.8, 8.8), ooi=None)
    calm, hurried = make(), make_hurried(time.perf_counter, budget_s=1e-6)
    pose = base_pose(4.0, 4.0, 0.0, 0.0)
    full, early = (planner.step(volume.arrays(), pose, -0.2) for planner in (calm, hurried))
    assert early.cut_short
    assert not full.cut_short
    assert early.evaluated == 1 < full.evaluated
    assert len(hurried._roadmap.nodes) == 1 < len(calm._roadmap.nodes)


def test_a_robot_inside_an_obstacles_margin_finds_its_way_out(dense_map):
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (4.8, 4.8))
    volume.fill((4.8, 2.3, 0.0), (4.9, 3.3, 2.0), FREE)
    plan = run(make(), volume, 12, base_pose(0.95, 2.8, 0.0, math.pi))
    assert plan.target is not None
    assert_consistent(plan, volume)


@pytest.mark.parametrize("clock", [None, Clock(jump_s=10.0)])
def test_a_path_to_a_point_on_seen_floor_is_found_before_any_search(dense_map, clock):
    """As after driving by hand, or on a map that was read: the roadmap has hardly begun."""
    volume = dense_map((14.4, 5.6, 2.4))
    for x in (0.8, 3.9, 7.0, 10.1):
        volume.room((x, 0.8), (x + 3.0, 4.8))
    for x, door_y in ((3.8, 4.2), (6.9, 1.4), (10.0, 4.2)):
        volume.fill((x, door_y - 0.4, 0.0), (x + 0.1, door_y + 0.4, 2.0), FREE)
    planner = make() if clock is None else make_hurried(clock)
    pose = base_pose(1.6, 1.4, 0.0, 0.0)
    run(planner, volume, 1, pose)
    path = planner.path_to_point(pose, np.array([12.4, 1.4]))
    assert path is not None
    np.testing.assert_allclose(path[0], [1.6, 1.4])
    np.testing.assert_allclose(path[-1], [12.4, 1.4], atol=0.06)
    assert planner.path_to_point(pose, np.array([3.85, 1.4])) is not None, "beside a wall"
    assert planner.path_to_point(pose, np.array([1.6, -3.0])) is None


def test_without_a_search_a_narrow_gap_is_passed_only_where_no_other_path_leads(two_rooms):
    volume = two_rooms(0.4)
    planner = make()
    floor = planner._floor
    full_m = floor.config.margin_m
    for _ in range(60):
        if planner.step(volume.arrays(), POSE, -0.2).exhausted:
            break
    assert floor.margin_m < full_m, "the search tried everything"
    planner.set_searching(False)
    run(planner, volume, 12)
    assert floor.margin_m == full_m, "nothing is about to be given up"
    here, there = np.array([2.5, 1.5]), np.array([5.0, 2.8])
    for point, margin_m in ((here, full_m), (there, floor.config.squeeze_margin_m), (here, full_m)):
        path = planner.path_to_point(POSE, point)
        assert path is not None
        assert np.hypot(*(path[-1] - point)) < 0.1
        assert floor.margin_m == margin_m


def test_an_empty_map_gives_an_empty_plan(dense_map):
    volume = dense_map()
    plan = make().step(volume.arrays(), base_pose(3.2, 3.2, 0.0, 0.0), 0.0)
    assert not plan.exhausted or plan.target is None
    assert plan.tree.parents[0] == -1


def test_budgets_that_get_nowhere_are_refused():
    with pytest.raises(ValueError, match="max_object_voxels must be at least 1, max_nodes"):
        PlannerConfig(samples_per_step=0)
    with pytest.raises(ValueError, match="growth_share must lie in"):
        PlannerConfig(growth_share=0.0)
    with pytest.raises(ValueError, match="ooi_threshold"):
        PlannerConfig(ooi_threshold=1.0)
    for seconds in (0.0, -1.0, math.inf, math.nan):
        with pytest.raises(ValueError, match="step_budget_s must be finite and above 0, or None"):
            PlannerConfig(step_budget_s=seconds)
    with pytest.raises(ValueError, match="needs a clock"):
        make(step_budget_s=0.04)
