"""A search does not end before what the images recognise lies within the metre of the task."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from ippon.command import Command
from ippon.geometry import base_pose
from ippon.mission.behaviors.config import StepCloserConfig
from ippon.mission.behaviors.confirmation import Confirmation, _Verified
from ippon.mission.behaviors.step_closer import StepCloser
from ippon.mission.config import MissionConfig
from ippon.mission.finds.image_check import ImageCheck
from ippon.mission.finds.second_opinion import SecondOpinions
from ippon.mission.journal import Journal
from ippon.mission.snapshot import Find, MissionState
from ippon.robot import ZED

CONFIG = StepCloserConfig()


def find(x: float, **changes) -> Find:
    values = {
        "position_world": (x, 0.0, 0.7),
        "size_m": (0.3, 0.3, 0.3),
        "probability": 0.98,
        "voxels": 20,
        "box_px": (0, 0, 9, 9),
    }
    return Find(**(values | changes))


def points(near_m: float, far_m: float) -> tuple[np.ndarray, ...]:
    """What five images recognise: points ahead, evenly from one distance to another."""
    x = np.linspace(near_m, far_m, 41)
    return (np.column_stack([x, np.zeros(41)]),) * 5


class Straight:
    """A planner for an empty floor up to a wall, and where its paths lead."""

    def __init__(self, wall_m: float = math.inf, detour_m: float = 0.0) -> None:
        self.wall_m, self.detour_m = wall_m, detour_m

    def path_to_point(self, T_world_base, xy):
        here, end = T_world_base[:2, 3], np.minimum(xy, (self.wall_m, math.inf))
        aside = 0.5 * (here + end) + (0.0, 0.5 * self.detour_m)
        return np.array([here, aside, end])


class Follower:
    """Takes every command; arrives when told."""

    reached = False

    def step(self, plan, *_):
        self.plan = plan
        return Command(linear_m_s=0.2)


def search_of(images) -> SimpleNamespace:
    check = SimpleNamespace(recognised_at=lambda _find: images, share=lambda _find: 1.0)
    goal = SimpleNamespace(display="hat", goal_id=1, object="hat")
    return SimpleNamespace(image_check=check, goal=goal, candidates=())


def step_at(x: float, plan, follower=None, stamp_s: float = 0.0) -> SimpleNamespace:
    frame = SimpleNamespace(
        T_world_base=base_pose(x, 0.0, 0.0, 0.0), stamp_ns=round(stamp_s * 1e9), tilt_rad=0.0
    )
    follower = follower or Follower()
    return SimpleNamespace(
        frame=frame,
        plan=plan,
        follower=follower,
        follow=follower.step,
    )


@pytest.fixture
def plan(searcher, room):
    """Any plan of a planner."""
    robot = searcher(room(4.0, 3.0), 1.0, 1.0)
    robot.ask("bed")
    robot.search(0.3)
    return robot.last.plan


def test_the_robot_goes_closer_to_what_the_images_recognise_beyond_the_metre(plan):
    closer = StepCloser(CONFIG, Straight(), ZED)
    hat, search = find(1.2), search_of(points(1.1, 1.5))
    assert closer.begin(step_at(0.0, plan), search, hat)
    follower = Follower()
    action = closer.act(step_at(0.0, plan, follower), search, hat)
    assert action.state is MissionState.APPROACHING
    assert action.command.linear_m_s == 0.2
    x, y, _ = follower.plan.target.position_world
    assert (x, y) == pytest.approx((1.2 - CONFIG.near_m, 0.0)), "a quarter lies within near_m"
    assert follower.plan.target.tilt_rad < -0.1, "the camera stays on the object"
    assert not action.plan.ends_search
    follower.reached = True
    assert closer.act(step_at(0.3, plan, follower), search, hat) is None


@pytest.mark.parametrize(
    ("images", "planner", "changes"),
    [
        (points(0.9, 1.3), Straight(), {}),
        ((), Straight(), {}),
        (points(1.1, 1.5), Straight(), {"out_of_reach_m": 1.4}),
        (points(1.1, 1.5), Straight(wall_m=0.03), {}),
        (points(1.1, 1.5), Straight(detour_m=1.5), {}),
        (points(1.1, 1.5), SimpleNamespace(), {}),
    ],
    ids=["within reach", "no detector", "out of reach", "a wall", "a detour", "other planner"],
)
def test_it_stays_where_it_is_near_enough_or_no_short_way_leads_closer(
    plan, images, planner, changes
):
    closer = StepCloser(CONFIG, planner, ZED)
    hat, search = find(1.2, **changes), search_of(images)
    assert not closer.begin(step_at(0.0, plan), search, hat)
    assert closer.act(step_at(0.0, plan), search, hat) is None


def test_it_stays_where_what_the_images_recognise_lies_all_around_it(plan):
    around = (np.array([[1.5, 0.0], [-1.5, 0.0], [0.0, 1.5], [0.0, -1.5]]),) * 5
    closer = StepCloser(CONFIG, Straight(), ZED)
    assert not closer.begin(step_at(0.0, plan), search_of(around), find(1.2))


def test_it_does_not_try_for_ever(plan):
    closer = StepCloser(CONFIG, Straight(), ZED)
    hat, search = find(1.2), search_of(points(1.1, 1.5))
    assert closer.begin(step_at(0.0, plan, stamp_s=10.0), search, hat)
    assert closer.act(step_at(0.0, plan, stamp_s=9.9 + CONFIG.most_s), search, hat) is not None
    assert closer.act(step_at(0.0, plan, stamp_s=10.1 + CONFIG.most_s), search, hat) is None


@pytest.mark.parametrize(
    ("x", "candidates", "announced"),
    [
        (0.3, (find(1.25, voxels=30),), True),
        (-2.0, (find(1.25),), False),
        (0.3, (), False),
        (0.3, (find(2.4),), False),
    ],
    ids=["here", "driven away", "gone", "another"],
)
def test_the_search_ends_with_the_find_as_it_is_seen_then(plan, x, candidates, announced):
    config = MissionConfig()
    closer = StepCloser(CONFIG, Straight(), ZED)
    rooms = SimpleNamespace(is_elsewhere=lambda *_: False)
    opinions = SecondOpinions(config.second_opinion)
    confirmation = Confirmation(config, None, Journal(), opinions, rooms, closer)
    search, hat = search_of(points(1.1, 1.5)), find(1.2, probability=0.9)
    search.candidates, search.announced = candidates, []
    search.announce = search.announced.append
    search.found_text = lambda _T_world_base: "found hat"
    assert closer.begin(step_at(0.0, plan), search, hat)
    confirmation._verified = _Verified(1, hat, None)
    assert confirmation._end_closer(step_at(0.1, plan), search).state is MissionState.APPROACHING
    follower = Follower()
    follower.reached = True
    ended = confirmation._end_closer(step_at(x, plan, follower), search)
    if not announced:
        assert ended is None
        assert not search.announced
        return
    assert ended.state is MissionState.FOUND
    (found,) = search.announced
    assert (found.voxels, found.probability) == (30, 0.9)
    assert confirmation._verified is None


@pytest.mark.slow
def test_a_search_ends_nearer_to_what_lies_behind_the_edge_of_its_voxels(
    searcher, room, monkeypatch
):
    bed = ("bed", "bed", (4.0, 1.2, 0.0), (5.9, 3.0, 0.55))

    def end_x_m() -> float:
        robot = searcher([*room(6.0, 4.5), bed], 1.0, 2.0)
        robot.ask("bed")
        robot.search(60.0)
        assert robot.last.state is MissionState.FOUND
        return float(robot.at[0])

    at_the_edge = end_x_m()
    behind = np.column_stack([at_the_edge + np.linspace(1.0, 1.2, 41), np.full(41, 2.0)])
    monkeypatch.setattr(ImageCheck, "recognised_at", lambda _self, _find: (behind,))
    wanted = at_the_edge + 1.05 - CONFIG.near_m
    assert end_x_m() == pytest.approx(wanted, abs=0.09), "0.15 m nearer, to the follower's 8 cm"
