import math

import numpy as np
import pytest

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
    ],
)
def test_edge_cases_give_numbers_between_0_and_1(d0, dT, length, spl, soft):
    m = _metrics(d0, dT, length)
    assert (m.spl, m.soft_spl) == (spl, soft)


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
    assert math.isinf(judge.shortest_path_m(scene.start_poses[0]))
    m = judge.metrics(np.array([[1.0, 1.0], [2.0, 1.0]]), stopped=True)
    assert (m.success, m.spl, m.soft_spl) == (False, 0.0, 0.0)


@pytest.mark.parametrize(
    ("trajectory", "text"),
    [
        (np.empty((0, 2)), "N of at least 1"),
        (np.zeros(3), "N of at least 1"),
        (np.array([[1.0, np.nan]]), "finite positions"),
    ],
)
def test_invalid_trajectories_are_rejected(make_scene, flat_boxes, robot, trajectory, text):
    judge = Judge(make_scene(flat_boxes), robot, "hat")
    with pytest.raises(ValueError, match=text):
        judge.metrics(trajectory, stopped=True)


def test_invalid_positions_are_rejected(make_scene, flat_boxes, robot):
    with pytest.raises(ValueError, match="finite x and y"):
        Judge(make_scene(flat_boxes), robot, "hat").is_success((math.nan, 1.0))
