import dataclasses
import math

import numpy as np
import pytest

from ippon.evaluation.episode_record import TimedPlanner
from ippon.evaluation.methods import baselines
from ippon.evaluation.methods.baselines import (
    Aim,
    BaselinePlanner,
    GreedyNextBestView,
    NearestFrontier,
    SemanticFrontier,
)
from ippon.evaluation.methods.frontiers import FloorRoutes
from ippon.geometry import base_pose
from ippon.planning.config import PlannerConfig
from ippon.planning.plan import NodeKind, Plan, TreeView
from ippon.planning.planner import ViewpointPlanner


def _plan(nodes=(), *, exhausted=False) -> Plan:
    """A tree of a root and nodes given as (x, gain, cost, kind)."""
    table = [(0.0, 0.0, 0.0, NodeKind.MINIMAL), *nodes]
    x, gain, cost, kind = zip(*table, strict=True)
    zero = np.zeros(len(table), np.float32)
    tree = TreeView(
        positions_world=np.stack([x, zero, zero], axis=1).astype(np.float32),
        parents=np.zeros(len(table), np.int32),
        yaws_rad=zero + 0.5,
        tilts_rad=zero - 0.1,
        gains=np.array(gain, np.float32),
        terminations=zero,
        path_costs_s=np.array(cost, np.float32),
        levels=zero.astype(np.uint8),
        kinds=np.array(kind, np.uint8),
    )
    return Plan(
        target=None, path_world=np.zeros((0, 3)), tree=tree, exhausted=exhausted, evaluated=0
    )


@pytest.fixture
def hall(floor_of):
    """A room whose floor ends unseen at both ends; the robot stands nearer to the low end."""
    rows = [" " * 12, *["#" + "." * 10 + "#"] * 30, " " * 12]
    return FloorRoutes(floor_of(rows), 1.0, 0.6)


def _all(_about) -> bool:
    return True


@pytest.mark.parametrize("odd", [{"stand": (math.nan, 0.0)}, {"yaw_rad": math.inf}])
def test_an_aim_that_is_no_number_is_refused(odd):
    aim = {"stand": (0.0, 0.0), "yaw_rad": 0.0, "tilt_rad": 0.0, "worth": 1.0, "about": (0.0, 0.0)}
    assert Aim(**aim).stand == (0.0, 0.0)
    with pytest.raises(ValueError, match="an aim has finite numbers"):
        Aim(**(aim | odd))


def test_the_reason_of_an_aim_is_short():
    aim = {"stand": (0.0, 0.0), "yaw_rad": 0.0, "tilt_rad": 0.0, "worth": 1.0, "about": (0.0, 0.0)}
    with pytest.raises(ValueError, match="at most 100 characters; got 101"):
        Aim(**aim, reason="x" * 101)


def test_the_nearest_frontier_is_the_nearest(hall):
    aim = NearestFrontier().choose(_plan(), hall, None, _all)
    assert aim is not None
    assert aim.stand[0] < 0.5
    assert abs(aim.yaw_rad) == pytest.approx(math.pi, abs=0.2)


def test_a_frontier_is_kept_until_it_is_gone(hall):
    rule = NearestFrontier()
    far = rule.choose(_plan(), hall, None, lambda about: about[0] > 1.0)
    assert far is not None
    assert far.stand[0] > 2.0
    assert rule.choose(_plan(), hall, far, _all) == far
    gone = dataclasses.replace(far, about=(9.0, 9.0))
    back = rule.choose(_plan(), hall, gone, _all)
    assert back is not None
    assert back.stand[0] < 0.5


def test_no_frontier_means_nothing_left(hall):
    assert NearestFrontier().choose(_plan(), hall, None, lambda _: False) is None
    assert SemanticFrontier({"wall": 0.1}).choose(_plan(), hall, None, lambda _: False) is None


def test_the_semantic_frontier_is_the_one_of_highest_value(hall, monkeypatch):
    rule = SemanticFrontier({"wall": 0.1, "sofa": 0.6})
    monkeypatch.setattr(rule._values, "value_near", lambda x, _y: 0.4 if x > 1.5 else 0.3)
    aim = rule.choose(_plan(), hall, None, _all)
    assert aim is not None
    assert aim.stand[0] > 2.0
    assert aim.worth == 0.4
    # Until values say otherwise, it goes on; then it turns.
    monkeypatch.setattr(rule._values, "value_near", lambda x, _y: 0.4 if x > 1.5 else 0.5)
    assert rule.choose(_plan(), hall, aim, _all).stand[0] > 2.0
    monkeypatch.setattr(rule._values, "value_near", lambda x, _y: 0.2 if x > 1.5 else 0.5)
    assert rule.choose(_plan(), hall, aim, _all).stand[0] < 0.5


def test_frontiers_of_equal_value_are_visited_nearest_first(hall):
    aim = SemanticFrontier({"wall": 0.1}).choose(_plan(), hall, None, _all)
    assert aim is not None
    assert aim.stand[0] < 0.5


def test_the_next_best_view_discounts_by_its_own_path(hall):
    exploring = NodeKind.EXPLORING
    plan = _plan([(1.0, 10.0, 5.0, exploring), (2.0, 11.0, 10.0, exploring)])
    aim = GreedyNextBestView().choose(plan, hall, None, _all)
    assert aim is not None
    assert aim.stand == (1.0, 0.0)
    assert aim.worth == pytest.approx(10.0 * math.exp(-0.5))
    assert (aim.yaw_rad, aim.tilt_rad) == (pytest.approx(0.5), pytest.approx(-0.1))
    far = _plan([(1.0, 10.0, 5.0, exploring), (2.0, 20.0, 10.0, exploring)])
    assert GreedyNextBestView().choose(far, hall, None, _all).stand == (2.0, 0.0)
    # A view that is hardly better is no reason to turn round.
    assert GreedyNextBestView().choose(far, hall, aim, _all).stand == (1.0, 0.0)


def test_views_that_show_nothing_new_are_never_chosen(hall):
    rule = GreedyNextBestView()
    plan = _plan([(1.0, 50.0, 1.0, NodeKind.MINIMAL), (2.0, 1.0, 9.0, NodeKind.EXPLORING)])
    assert rule.choose(plan, hall, None, _all).stand == (2.0, 0.0)
    assert rule.choose(_plan(exhausted=True), hall, None, _all) is None


def test_the_next_best_view_ignores_levels():
    flat = GreedyNextBestView().probabilities(np.array([0.02, 0.1, 0.25, 0.6], np.float32))
    assert flat.tolist() == pytest.approx([0.1] * 4)


class _Fixed:
    """Always wants the same."""

    def __init__(self, aim: Aim | None) -> None:
        self.aim = aim

    def observe(self, frame) -> None:
        pass

    def probabilities(self, probabilities):
        return probabilities

    def choose(self, plan, routes, last, untried):
        return self.aim if self.aim is not None and untried(self.aim.about) else None


@pytest.fixture
def map_arrays(make_scene, flat_boxes, robot):
    """What the robot sees of the room by turning round, level and looking down."""
    from ippon.camera import PinholeCamera
    from ippon.mapping.voxel_map import MapConfig, VoxelMap
    from ippon.simulation.world import SimulatedWorld, WorldConfig

    scene = make_scene(flat_boxes, start=(2.0, 2.0))
    camera = PinholeCamera.from_horizontal_fov(120, 90, 1.3)
    world = SimulatedWorld(scene, robot, camera, scene.start_poses[0], config=WorldConfig.perfect())
    world.set_labels(("floor", "wall", "chair"), "hat")
    voxel_map = VoxelMap(MapConfig(), ("floor", "wall", "chair"))
    voxel_map.set_ooi("hat")
    for k in range(16):
        world.base.yaw_rad, world.base.tilt_rad = k * math.pi / 4.0, -0.4 - 0.6 * (k // 8)
        world.step(None, 0.02)
        voxel_map.integrate(world.observe())
    return voxel_map.arrays()


def _planner(robot, aim):
    planner = BaselinePlanner(PlannerConfig(), robot, 0, _Fixed(aim))
    planner.set_goal(probabilities=np.array([0.02, 0.1, 0.25, 0.6], np.float32), termination_min=2)
    return planner


def test_the_plan_leads_to_the_aim(map_arrays, robot):
    view = {"yaw_rad": 1.0, "tilt_rad": -0.3, "about": (2.0, 4.0)}
    aim = Aim(stand=(2.0, 3.5), worth=0.7, reason="a wall is there", **view)
    plan = _planner(robot, aim).step(map_arrays, base_pose(2.0, 2.0, 0.0, 0.0), 0.0)
    assert plan.target is not None
    assert plan.target.position_world[:2] == pytest.approx((2.0, 3.5), abs=0.1)
    assert (plan.target.yaw_rad, plan.target.tilt_rad, plan.target.gain) == (1.0, -0.3, 0.7)
    assert plan.target.kind is NodeKind.EXPLORING
    assert (plan.by_rule, plan.rule_reason) == (True, "a wall is there")
    assert plan.path_world[0].tolist() == [2.0, 2.0, 0.0]
    assert not plan.exhausted


@pytest.mark.slow
def test_an_aim_that_stays_although_the_robot_is_there_is_given_up(map_arrays, robot):
    aim = Aim(stand=(2.0, 2.0), yaw_rad=0.0, tilt_rad=0.0, worth=1.0, about=(2.4, 2.0))
    planner = _planner(robot, aim)
    here = base_pose(2.0, 2.0, 0.0, 0.0)
    aims = [planner.step(map_arrays, here, 0.0) and planner._aim for _ in range(12)]
    assert aims[0] == aim
    assert aims[-1] is None
    # Another goal may find it worth a look again.
    planner.set_goal(probabilities=np.array([0.02, 0.1, 0.25, 0.6], np.float32), termination_min=2)
    planner.step(map_arrays, here, 0.0)
    assert planner._aim == aim


def test_an_aim_is_given_up_where_the_robot_comes_no_nearer_however_far_it_is(
    map_arrays, robot, monkeypatch
):
    monkeypatch.setattr(baselines, "_PATIENCE_STEPS", 4)
    aim = Aim(stand=(2.0, 3.5), yaw_rad=1.0, tilt_rad=-0.3, worth=0.7, about=(2.0, 4.0))
    planner = _planner(robot, aim)
    for step in range(10):
        planner.step(map_arrays, base_pose(2.0, 2.0 + 0.1 * step, 0.0, 0.0), 0.0)
        assert planner._aim == aim
    held = [
        planner.step(map_arrays, base_pose(2.0, 2.9, 0.0, 0.0), 0.0) and planner._aim
        for _ in range(6)
    ]
    assert held[0] == aim
    assert held[-1] is None


def test_an_aim_out_of_reach_is_left_to_the_paper_s_planner(map_arrays, robot):
    aim = Aim(stand=(90.0, 3.5), yaw_rad=1.0, tilt_rad=-0.3, worth=0.7, about=(90.0, 4.0))
    timed = TimedPlanner(_planner(robot, aim), lambda: 0.0)
    timed.step(map_arrays, base_pose(2.0, 2.0, 0.0, 0.0), 0.0)
    assert timed.by_rule == [False]


@pytest.mark.slow
def test_with_nothing_left_the_paper_s_planner_decides_how_to_end(map_arrays, robot):
    planner, here = _planner(robot, None), base_pose(2.0, 2.0, 0.0, 0.0)
    paper = ViewpointPlanner(PlannerConfig(), robot, 0)
    paper.set_goal(probabilities=np.array([0.02, 0.1, 0.25, 0.6], np.float32), termination_min=2)
    for _ in range(5):
        plan, expected = (p.step(map_arrays, here, 0.0) for p in (planner, paper))
        assert (plan.by_rule, expected.by_rule) == (False, None)
        assert plan.target == expected.target
        assert plan.exhausted == expected.exhausted


def test_possible_objects_are_approached_first(map_arrays, robot, monkeypatch):
    aim = Aim(stand=(2.0, 3.5), yaw_rad=1.0, tilt_rad=-0.3, worth=0.7, about=(2.0, 4.0))
    planner = _planner(robot, aim)
    step = ViewpointPlanner.step
    looks = iter((False, True))

    def looking(*args):
        return dataclasses.replace(step(*args), closer_look=next(looks))

    monkeypatch.setattr(ViewpointPlanner, "step", looking)
    here = base_pose(2.0, 2.0, 0.0, 0.0)
    assert planner.step(map_arrays, here, 0.0).target is not None
    assert planner._aim == aim
    assert planner.step(map_arrays, here, 0.0).by_rule is None
    assert planner._aim is None, "the paper's planner leads to it"
