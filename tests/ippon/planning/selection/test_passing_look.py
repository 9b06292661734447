"""What may be a small object is looked at once from nearby, before exploring goes on."""

import math

import pytest

from ippon.geometry import base_pose
from ippon.guidance.levels import LevelProbabilities
from ippon.mapping.arrays import FREE, OCCUPIED
from ippon.planning.config import PlannerConfig
from ippon.planning.planner import ViewpointPlanner
from ippon.planning.selection.closer_look import CloserLookConfig
from ippon.planning.selection.passing_look import PassingLookConfig
from ippon.robot import ZED

POSE = base_pose(1.4, 2.8, 0.0, 0.0)
THING = (4.3, 2.8)
OF_41_LABELS = -math.log(41)
"""Log-odds of p(v in O) without evidence."""


def seen_from_afar(dense_map, ooi=0.3):
    """A long room with a door at the robot's back that promises a lot, and one doubtful voxel."""
    volume = dense_map((8.0, 5.6, 2.4)).room((0.8, 0.8), (6.9, 4.8))
    volume.fill((0.7, 2.0, 0.0), (0.8, 3.4, 2.0), FREE)
    x, y = THING
    return volume.fill((x, y, 0.6), (x + 0.1, y + 0.1, 0.7), OCCUPIED, ooi=ooi)


def make(t_min=1.0, **config) -> ViewpointPlanner:
    looks = CloserLookConfig(passing=PassingLookConfig(**config))
    planner = ViewpointPlanner(PlannerConfig(closer_look=looks), ZED, 0)
    planner.set_goal(probabilities=LevelProbabilities().as_array(), termination_min=t_min)
    return planner


def run(planner, volume, steps, pose=POSE, prior=OF_41_LABELS):
    for _ in range(steps):
        arrays = volume.arrays()._replace(ooi_prior_log_odds=prior)
        plan = planner.step(arrays, pose, -0.2)
    return plan


def test_a_doubtful_voxel_is_looked_at_from_nearby(dense_map):
    plan = run(make(), seen_from_afar(dense_map), 20)
    assert plan.closer_look
    assert not plan.exhausted
    x, y, _ = plan.target.position_world
    assert 0.3 < math.dist((x, y), THING) <= 1.5
    towards = math.atan2(THING[1] - y, THING[0] - x)
    assert plan.target.yaw_rad == pytest.approx(towards, abs=0.15)


def test_it_is_looked_at_once(dense_map):
    planner, volume = make(), seen_from_afar(dense_map)
    target = run(planner, volume, 20).target
    x, y, _ = target.position_world
    there = base_pose(x, y, 0.0, target.yaw_rad)
    assert run(planner, volume, 5, there).closer_look
    assert not run(planner, volume, 3, there).closer_look
    assert not run(planner, volume, 5).closer_look, "not from elsewhere either"
    planner.set_goal(probabilities=LevelProbabilities().as_array(), termination_min=1.0)
    assert run(planner, volume, 20).closer_look, "for another object"


def test_a_look_that_does_not_come_about_ends(dense_map):
    planner, volume = make(give_up_steps=4), seen_from_afar(dense_map)
    assert run(planner, volume, 20).closer_look is False, "4 steps on the way were too few"


@pytest.mark.parametrize(
    ("ooi", "prior"),
    [(0.09, OF_41_LABELS), (0.3, -math.log(3)), (0.3, math.inf)],
    ids=["too little evidence", "the same with few labels", "no object of interest"],
)
def test_what_has_too_little_evidence_is_not_looked_at(dense_map, ooi, prior):
    volume = seen_from_afar(dense_map, ooi)
    assert not run(make(), volume, 20, prior=prior).closer_look


def test_few_voxels_are_no_reason_to_look_for_a_large_object(dense_map):
    assert not run(make(t_min=6.0), seen_from_afar(dense_map), 20).closer_look


@pytest.mark.parametrize("config", [{"near_m": 0.05}, {"within_s": 0.5}, {"enabled": False}])
def test_a_detour_that_is_too_long_or_not_wanted_is_not_taken(dense_map, config):
    assert not run(make(**config), seen_from_afar(dense_map), 20).closer_look


def test_what_is_surely_the_object_comes_first(dense_map):
    volume = seen_from_afar(dense_map)
    volume.fill((2.6, 4.2, 0.6), (2.8, 4.4, 0.7), OCCUPIED, ooi=0.95)
    plan = run(make(), volume, 20)
    assert math.dist(plan.target.position_world[:2], (2.7, 4.3)) < 1.0


def test_an_added_label_changes_what_is_doubtful(dense_map):
    planner, volume = make(), seen_from_afar(dense_map)
    assert not run(planner, volume, 10, prior=-math.log(3)).closer_look
    assert run(planner, volume, 20).closer_look


@pytest.mark.parametrize(
    "config",
    [
        {"evidence_nat": 0.0},
        {"evidence_nat": math.nan},
        {"near_m": 0.0},
        {"within_s": -1.0},
        {"patience_steps": 0},
        {"give_up_steps": 0},
        {"max_voxels": 0},
    ],
)
def test_distances_and_counts_without_meaning_are_refused(config):
    with pytest.raises(ValueError, match="at least"):
        PassingLookConfig(**config)
