import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ippon.evaluation.metrics import Judge, search_metrics


def _metrics(d0, dT, length, stopped=True):
    return search_metrics(
        shortest_path_m=d0, distance_to_goal_m=dT, path_length_m=length, stopped=stopped
    )


@pytest.mark.parametrize(
    ("d0", "dT", "length", "stopped", "success", "spl", "soft"),
    [
        (5.0, 0.0, 5.0, True, True, 1.0, 1.0),
        (5.0, 0.05, 10.0, True, True, 0.5, 0.5 * (1.0 - 0.05 / 5.0)),
        (5.0, 0.1, 5.0, True, False, 0.0, 1.0 - 0.1 / 5.0),
        (5.0, 0.0, 5.0, False, False, 0.0, 1.0),
        (5.0, 2.5, 2.5, False, False, 0.0, 0.5),
        (5.0, 8.0, 3.0, True, False, 0.0, 0.0),
        (5.0, 0.0, 4.0, True, True, 1.0, 1.0),
    ],
)
def test_the_definitions_of_habitat(d0, dT, length, stopped, success, spl, soft):
    m = _metrics(d0, dT, length, stopped)
    assert m.success == success
    assert m.spl == pytest.approx(spl)
    assert m.soft_spl == pytest.approx(soft)


@pytest.mark.parametrize(
    ("d0", "dT", "length", "spl", "soft"),
    [
        (0.0, 0.0, 0.0, 1.0, 1.0),
        (0.0, 0.0, 2.0, 0.0, 0.0),
        (0.0, 0.5, 2.0, 0.0, 0.0),
        (math.inf, math.inf, 3.0, 0.0, 0.0),
        (4.0, math.inf, 3.0, 0.0, 0.0),
        (0.0, 0.5, 0.0, 0.0, 0.0),
        (math.inf, 0.0, 3.0, 0.0, 0.0),
    ],
)
def test_edge_cases_give_numbers_between_0_and_1(d0, dT, length, spl, soft):
    m = _metrics(d0, dT, length)
    assert (m.spl, m.soft_spl) == (spl, soft)


lengths = st.floats(0.0, 1e3)
some_d0 = st.floats(1e-3, 1e3)


@settings(max_examples=50)
@given(d0=lengths, dT=lengths, length=lengths, stopped=st.booleans())
def test_metrics_lie_between_0_and_1_and_efficiency_needs_success(d0, dT, length, stopped):
    m = _metrics(d0, dT, length, stopped)
    assert 0.0 <= m.soft_spl <= 1.0
    assert 0.0 <= m.spl <= m.success
    assert m.success == (stopped and dT < 0.1)
    assert (m.shortest_path_m, m.distance_to_goal_m, m.path_length_m) == (d0, dT, length)


@settings(max_examples=50)
@given(d0=some_d0, dT=lengths, length=lengths, further=lengths, longer=lengths)
def test_a_longer_way_and_an_end_further_off_never_score_higher(d0, dT, length, further, longer):
    m = _metrics(d0, dT, length)
    assert _metrics(d0, dT, length + longer).spl <= m.spl
    assert _metrics(d0, dT, length + longer).soft_spl <= m.soft_spl
    assert _metrics(d0, dT + further, length).spl <= m.spl
    assert _metrics(d0, dT + further, length).soft_spl <= m.soft_spl


@settings(max_examples=50)
@given(d0=some_d0, share=st.floats(0.0, 2.0), way=st.floats(0.0, 3.0), scale=st.floats(0.1, 10.0))
def test_soft_spl_does_not_depend_on_the_unit_of_length(d0, share, way, scale):
    small = _metrics(d0, share * d0, way * d0)
    large = _metrics(scale * d0, scale * share * d0, scale * way * d0)
    assert large.soft_spl == pytest.approx(small.soft_spl, abs=1e-9)


def _round_the_wall(start, end, radius):
    """Length of a taut string over the wall's end, a body's radius off its two corners."""
    left, right = (3.95, 4.0), (4.05, 4.0)
    total = right[0] - left[0]
    for point, corner, sign in ((start, left, -1.0), (end, right, 1.0)):
        dx, dy = point[0] - corner[0], point[1] - corner[1]
        far = math.hypot(dx, dy)
        total += math.sqrt(far**2 - radius**2)
        # The string leaves the circle where it is at a right angle to the radius.
        tangent = math.atan2(dy, sign * dx) + math.acos(radius / far)
        total += radius * (0.5 * math.pi - tangent)
    return total


def test_a_judge_measures_the_path_around_the_wall(make_scene, flat_boxes, robot):
    scene = make_scene(flat_boxes, start=(2.0, 1.0))
    judge = Judge(scene, robot, "hat")
    d0 = judge.shortest_path_m(scene.start_poses[0])
    lengths = [_round_the_wall((2.0, 1.0), p, 0.2) for p in judge.viewpoints.tolist()]
    assert d0 == pytest.approx(min(lengths), rel=0.02)
    assert not judge.is_success((2.0, 1.0))
    assert judge.is_success(judge.viewpoints[0])
    nearby = judge.viewpoints[0] + (0.0, 0.05)
    assert judge.distance_m(nearby) < 0.1


def test_following_the_shortest_path_scores_close_to_one(make_scene, flat_boxes, robot):
    scene = make_scene(flat_boxes, start=(2.0, 1.0))
    judge = Judge(scene, robot, "hat")
    goal = min(judge.viewpoints.tolist(), key=lambda p: math.hypot(p[0] - 4.05, p[1] - 4.3))
    way = np.array([(2.0, 1.0), (3.72, 4.2), (4.3, 4.2), tuple(goal)])
    m = judge.metrics(way, stopped=True)
    assert m.success
    assert m.spl > 0.95
    gave_up = judge.metrics(way, stopped=False)
    assert not gave_up.success
    assert gave_up.spl == 0.0
    assert gave_up.soft_spl == m.soft_spl
    assert m.path_length_m == pytest.approx(np.hypot(*np.diff(way, axis=0).T).sum())


def test_standing_still_earns_nothing(make_scene, flat_boxes, robot):
    scene = make_scene(flat_boxes, start=(2.0, 1.0))
    m = Judge(scene, robot, "hat").metrics(np.array([[2.0, 1.0, 0.0]]), stopped=True)
    assert (m.success, m.spl, m.soft_spl, m.path_length_m) == (False, 0.0, 0.0, 0.0)


def test_a_goal_that_the_home_lacks_can_never_succeed(make_scene, flat_boxes, robot):
    scene = make_scene(flat_boxes)
    judge = Judge(scene, robot, "unicorn")
    assert judge.instances == ()
    assert judge.viewpoints.shape == (0, 2)
    assert judge.nearest_instance((1.0, 1.0)) is None
    assert math.isinf(judge.shortest_path_m(scene.start_poses[0]))
    m = judge.metrics(np.array([[1.0, 1.0], [2.0, 1.0]]), stopped=True)
    assert (m.success, m.spl, m.soft_spl) == (False, 0.0, 0.0)


@pytest.mark.parametrize(
    ("trajectory", "text"),
    [
        (np.empty((0, 2)), "N of at least 1"),
        (np.zeros(3), "N of at least 1"),
        (np.zeros((3, 1)), "N of at least 1"),
        (np.array([[1.0, np.nan]]), "finite positions"),
    ],
)
def test_invalid_trajectories_are_rejected(make_scene, flat_boxes, robot, trajectory, text):
    judge = Judge(make_scene(flat_boxes), robot, "hat")
    with pytest.raises(ValueError, match=text):
        judge.metrics(trajectory, stopped=True)


def test_the_heading_of_a_trajectory_does_not_matter(make_scene, flat_boxes, robot):
    judge = Judge(make_scene(flat_boxes), robot, "hat")
    way = np.array([[2.0, 1.0, np.nan], [2.0, 2.0, np.nan]])
    assert judge.metrics(way, stopped=True) == judge.metrics(way[:, :2], stopped=True)


def test_the_border_of_a_success_is_that_of_the_metrics(make_scene, flat_boxes, robot, monkeypatch):
    judge = Judge(make_scene(flat_boxes), robot, "hat")
    for distance_m, success in ((0.0999, True), (0.1, False), (0.1001, False)):
        monkeypatch.setattr(judge, "distance_m", lambda _, d=distance_m: d)
        assert judge.is_success((2.0, 1.0)) == success
        assert _metrics(5.0, distance_m, 5.0).success == success


def test_the_nearest_of_several_instances_is_named(make_scene, flat_boxes, robot):
    boxes = [*flat_boxes, ("clothes", "hat", (1.2, 5.2, 0.9), (1.5, 5.5, 1.0))]
    scene = make_scene(boxes)
    judge = Judge(scene, robot, "hat")
    behind, before = judge.instances
    assert judge.nearest_instance((1.0, 3.5, 0.0)) == before
    assert judge.nearest_instance((6.5, 3.0, 0.0)) == behind
    assert judge.nearest_instance((3.7, 1.5)) == before, "the other is nearer, behind the wall"
    for viewpoint in judge.viewpoints[[0, -1]]:
        at = (before, behind)[int(viewpoint[0] > 4.0)]
        assert judge.nearest_instance(viewpoint) == at
    path = judge.path_from((1.0, 3.5, 0.0))
    assert path[0] == pytest.approx((1.0, 3.5))
    assert np.abs(judge.viewpoints - path[-1]).max(axis=1).min() < 1e-6


def test_invalid_positions_are_rejected(make_scene, flat_boxes, robot):
    with pytest.raises(ValueError, match="finite x and y"):
        Judge(make_scene(flat_boxes), robot, "hat").is_success((math.nan, 1.0))


def test_what_is_left_of_the_spl_falls_along_a_way(make_scene, flat_boxes, robot):
    judge = Judge(make_scene(flat_boxes), robot, "hat")
    # Towards the wall and back, and then the shortest path to the table behind it.
    there = np.linspace((1.0, 1.0), (3.0, 1.0), 21)
    corners = judge.path_from((1.0, 1.0))
    way = [np.linspace(a, b, 20, endpoint=False) for a, b in itertools.pairwise(corners)]
    path = np.concatenate([there, there[::-1], *way, corners[-1:]])
    left = [judge.attainable_spl(path, k) for k in range(len(path))]
    assert left[0] == 1.0
    assert all(b <= a + 0.01 for a, b in itertools.pairwise(left))
    d0 = judge.distance_m((1.0, 1.0))
    assert left[41] == pytest.approx(d0 / (d0 + 4.0 - 0.1), abs=0.01)
    reached = judge.first_success(path, 41)
    assert judge.is_success(path[reached])
    assert not judge.is_success(path[reached - 1])
    assert judge.first_success(there, 0) == -1
    # A stop at the first place that counts scores what was left there.
    stopped = judge.metrics(path[: reached + 1], stopped=True)
    assert left[reached] == pytest.approx(stopped.spl)


def test_nothing_is_left_of_the_spl_without_a_path(make_scene, flat_boxes, robot):
    judge = Judge(make_scene(flat_boxes), robot, "toilet")
    assert judge.attainable_spl(np.array([(1.0, 1.0), (2.0, 1.0)]), 1) == 0.0
