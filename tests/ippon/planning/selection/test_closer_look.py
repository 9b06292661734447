"""What may be the object is looked at from closer by, before exploring goes on."""

import math

import pytest

from ippon.geometry import base_pose
from ippon.guidance.levels import LevelProbabilities
from ippon.mapping.arrays import FREE, OCCUPIED, UNKNOWN
from ippon.planning.config import PlannerConfig
from ippon.planning.plan import NodeKind
from ippon.planning.planner import ViewpointPlanner
from ippon.planning.selection.closer_look import CloserLookConfig
from ippon.robot import ZED

POSE = base_pose(1.4, 2.8, 0.0, 0.0)


def seen_from_afar(dense_map, voxels=0.2):
    """A long room; the floor beyond x = 4 is unseen, and a thing stands behind it, in sight."""
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (6.9, 4.8))
    volume.fill((4.0, 0.8, 0.0), (6.9, 4.8, 0.6), UNKNOWN)
    volume.fill((4.0, 0.8, -0.1), (6.9, 4.8, 0.0), UNKNOWN)
    # A door at the robot's back promises a lot.
    volume.fill((0.7, 2.0, 0.0), (0.8, 3.4, 2.0), FREE)
    return volume.fill((4.8, 2.7, 0.7), (5.0, 2.7 + voxels, 0.9), OCCUPIED, ooi=0.95)


def make(t_min=9.0, **config) -> ViewpointPlanner:
    planner = ViewpointPlanner(PlannerConfig(**config), ZED, 0)
    planner.set_goal(probabilities=LevelProbabilities().as_array(), termination_min=t_min)
    return planner


def run(planner, volume, steps, pose=POSE):
    for _ in range(steps):
        plan = planner.step(volume.arrays(), pose, -0.2)
    return plan


def test_a_closer_look_comes_before_exploring(dense_map):
    volume = seen_from_afar(dense_map)
    plan = run(make(), volume, 10)
    assert plan.closer_look
    assert not plan.exhausted
    x, y, _ = plan.target.position_world
    assert 2.5 < x < 4.0, "as close as the floor is known"
    towards = math.atan2(2.8 - y, 4.9 - x)
    assert plan.target.yaw_rad == pytest.approx(towards, abs=0.1)
    assert plan.target.tilt_rad < 0.0


def test_a_small_cluster_gets_no_closer_look(dense_map):
    volume = seen_from_afar(dense_map, voxels=0.1)
    assert not run(make(), volume, 10).closer_look, "4 voxels are less than half of 9"
    assert run(make(closer_look=CloserLookConfig(share=0.3)), volume, 10).closer_look


def test_a_cluster_that_does_not_grow_is_left(dense_map):
    volume = seen_from_afar(dense_map)
    planner = make()
    plan = run(planner, volume, 10)
    assert plan.closer_look
    tilts = set()
    for _ in range(40):
        x, y, _ = plan.target.position_world
        plan = run(planner, volume, 1, base_pose(x, y, 0.0, plan.target.yaw_rad))
        if not plan.closer_look:
            break
        tilts.add(round(plan.target.tilt_rad, 2))
    assert not plan.closer_look
    assert max(tilts) - min(tilts) > 0.4, "it looked down for a way on"
    # It counts again when much more of it shows.
    volume.fill((4.8, 2.5, 0.7), (5.0, 3.1, 0.9), OCCUPIED, ooi=0.95)
    plan = run(planner, volume, 3)
    assert plan.closer_look or plan.target.kind is NodeKind.TERMINATING


def test_a_cluster_that_was_left_stays_so_under_other_levels(dense_map):
    volume = seen_from_afar(dense_map)
    planner = make()
    plan = run(planner, volume, 10)
    there = base_pose(*plan.target.position_world[:2], 0.0, plan.target.yaw_rad)
    for _ in range(40):
        if not run(planner, volume, 1, there).closer_look:
            break
    views = planner._viewpoints.memory.field.surface_views.sum()
    assert views > 0
    planner.set_levels(probabilities=LevelProbabilities().as_array(), termination_min=9.0)
    assert not any(run(planner, volume, 1, there).closer_look for _ in range(5))
    assert planner._viewpoints.memory.field.surface_views.sum() > views, "it was seen before"
    planner.set_goal(probabilities=LevelProbabilities().as_array(), termination_min=9.0)
    assert run(planner, volume, 5, there).closer_look


def test_a_cluster_that_disappears_again_and_again_is_left(dense_map):
    volume = seen_from_afar(dense_map)
    planner = make(closer_look=CloserLookConfig(give_up_steps=30))
    plan, looks = run(planner, volume, 10), 0
    there = base_pose(*plan.target.position_world[:2], 0.0, plan.target.yaw_rad)
    for n in range(180):
        # An image in eleven does not recognise the cluster, before the patience has run out.
        ooi = 0.1 if n % 11 == 10 else 0.95
        volume.fill((4.8, 2.7, 0.7), (5.0, 2.9, 0.9), OCCUPIED, ooi=ooi)
        looks += run(planner, volume, 1, there).closer_look
    assert looks <= 60, "twice as long as a look without interruptions"
    planner.set_goal(probabilities=LevelProbabilities().as_array(), termination_min=9.0)
    assert run(planner, volume, 10, there).closer_look, "for another object"


def test_a_look_does_not_run_out_in_steps_that_do_not_count(dense_map):
    planner, volume = make(closer_look=CloserLookConfig(give_up_steps=5)), seen_from_afar(dense_map)
    assert run(planner, volume, 3).closer_look
    planner.set_searching(True, counts=False)
    assert run(planner, volume, 12).closer_look
    planner.set_searching(True)
    assert not run(planner, volume, 4).closer_look


def test_a_corner_in_sight_is_enough(dense_map):
    volume = seen_from_afar(dense_map)
    # Long enough to be cut off by the wall but at one end.
    volume.fill((4.8, 1.0, 0.7), (5.0, 2.9, 0.9), OCCUPIED, ooi=0.95)
    volume.fill((4.3, 0.7, 0.0), (4.4, 2.7, 2.0), OCCUPIED, ooi=0.0, level=1)
    plan = run(make(), volume, 10)
    assert plan.closer_look
    x, y, _ = plan.target.position_world
    seen = math.atan2(2.85 - y, 4.9 - x)
    assert plan.target.yaw_rad == pytest.approx(seen, abs=0.12), "it looks at what shows"


def test_an_object_behind_a_wall_is_no_reason_to_go_there(dense_map):
    volume = seen_from_afar(dense_map)
    volume.fill((4.3, 0.7, 0.0), (4.4, 4.9, 2.0), OCCUPIED, ooi=0.0, level=1)
    assert not run(make(), volume, 10).closer_look


def test_shares_and_counts_without_meaning_are_refused():
    with pytest.raises(ValueError, match="share must be at least 0"):
        CloserLookConfig(share=-0.1)
