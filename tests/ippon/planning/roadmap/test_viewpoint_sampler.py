"""Adding viewpoints, step by step; the whole of it is in test_planner."""

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.planning.roadmap.narrow_passages import NarrowPassageConfig
from ippon.planning.roadmap.sampling import SamplingConfig
from ippon.planning.roadmap.viewpoint_sampler import ViewpointSampler
from ippon.planning.terrain.reachability import reachable_cells
from ippon.robot import ZED
from tests.ippon.planning.joined import Joined, late
from tests.long_robot import LONG


def sampled(volume, robot=LONG, at=(1.8, 2.8)):
    joined = Joined(volume, base_pose(*at, 0.0, 0.0), robot)
    sampler = ViewpointSampler(
        SamplingConfig(),
        NarrowPassageConfig(),
        10,
        joined.roadmap,
        joined.floor,
        joined.connector,
        0,
    )
    reachable = reachable_cells(joined.floor.grid, joined.floor.limits, *at, 0.02, 0.05)
    return joined, sampler, reachable


def test_a_door_is_led_through_once_and_looked_at_now_and_then(two_rooms):
    joined, sampler, reachable = sampled(two_rooms(0.75))
    sampler.add_narrow_passages(reachable, late())
    assert len(joined.roadmap.nodes) == 0, "that has to wait"
    sampler.add_narrow_passages(reachable)
    nodes = joined.roadmap.nodes
    assert len(nodes) >= 2
    x = joined.roadmap.xy[nodes, 0]
    assert any(joined.roadmap.has_edge(a, b) for a in nodes[x < 3.9] for b in nodes[x > 3.9])
    for node in nodes:
        joined.roadmap.remove_node(int(node))
    for _ in range(4):
        sampler.add_narrow_passages(reachable)
        assert len(joined.roadmap.nodes) == 0
    sampler.add_narrow_passages(reachable)
    before = len(joined.roadmap.nodes)
    assert before >= 2
    for _ in range(10):
        sampler.add_narrow_passages(reachable)
    assert len(joined.roadmap.nodes) == before, "it is joined there already"


def test_a_door_is_found_also_where_no_step_has_time_for_it(two_rooms):
    joined, sampler, reachable = sampled(two_rooms(0.75))
    for _ in range(NarrowPassageConfig().patience_steps):
        sampler.add_narrow_passages(reachable, late())
    assert len(joined.roadmap.nodes) >= 2


def test_a_round_body_needs_no_gates(two_rooms):
    joined, sampler, reachable = sampled(two_rooms(0.75), ZED)
    sampler.add_narrow_passages(reachable)
    assert len(joined.roadmap.nodes) == 0


@pytest.mark.parametrize(("robot", "added"), [(ZED, True), (LONG, False)])
def test_a_viewpoint_is_added_where_the_robot_stands_if_it_can_turn_there(two_rooms, robot, added):
    joined, sampler, _ = sampled(two_rooms(0.75), robot)
    assert (sampler.add_here(3.85, 2.75, 0.1) is not None) is added
    assert sampler.add_here(1.8, 2.8, 0.1) is not None
    assert sampler.add_here(1.85, 2.8, 0.1) is None, "one is there"
    sampler.add_at(np.array([2.4, 2.0]))
    assert len(joined.roadmap.nodes) == 2 + added
