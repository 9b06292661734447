"""What a navigator compiles before its first frame is all that it ever needs."""

import dataclasses
import math
import subprocess
import sys

import pytest

from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.warm_up import warm_up
from app.process.kernel_cache import COMPLETE
from ippon.guidance.levels import Level
from ippon.mission.snapshot import MissionState
from ippon.planning.visibility.region_weights import Stroke
from ippon.robot import ZED
from ippon.simulation.robot.mobile_base import camera_of
from ippon.simulation.world import SimulatedWorld, WorldConfig
from tests import kernels
from tests.ippon.mission.conftest import Searcher, boxed_room
from tests.long_robot import LONG

PATIENCE_S = 900.0
"""On a machine with five times more to do than it has cores, and all kernels to compile."""
ROBOTS = {"round": ZED, "long": LONG}
OF_LONG_BODIES = {
    "ippon.planning.terrain.motion_check.can_turn",
    "ippon.planning.roadmap.narrow_passages._passage_kernel",
}
TOILET = ("toilet", "toilet", (5.4, 1.8, 0.0), (5.9, 2.3, 0.8))


@pytest.mark.slow
@pytest.mark.timeout(1.2 * PATIENCE_S)
@pytest.mark.parametrize("robot", ROBOTS)
def test_every_kernel_that_the_navigator_may_call_is_ready(robot):
    # In a process of its own: what is compiled here stays compiled.
    code = f"from {__name__} import not_ready as go; print(*go({robot!r}), sep='|')"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True, text=True, check=False, timeout=PATIENCE_S,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == ""


class _CompilingError(Exception):
    pass


def test_a_first_start_says_that_it_compiles_and_a_later_one_does_not(
    monkeypatch, tmp_path, caplog
):
    def compiles(progress, *, first):
        raise _CompilingError

    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr("app.nodes.navigator.warm_up._compile_map", compiles)
    caplog.set_level("INFO")
    with pytest.raises(_CompilingError):
        warm_up(NavigatorConfig(), lambda _: None)
    assert caplog.messages == ["compiling the kernels: a minute or more, at the first start only"]
    (tmp_path / COMPLETE).touch()
    caplog.clear()
    with pytest.raises(_CompilingError):
        warm_up(NavigatorConfig(), lambda _: None)
    assert caplog.messages == []


def not_ready(robot: str) -> list[str]:
    """Return the kernels that are not ready after a warm-up for a robot.

    And those that searches of many kinds compile, or load, all the same, and those that give away
    what they borrow.
    """
    profile = ROBOTS[robot]
    warm_up(NavigatorConfig(profile=profile), lambda _: None)
    missing = kernels.missing() - (OF_LONG_BODIES if profile.is_round else set())
    before = kernels.ready()
    _find_out_of_reach_and_exhaust(profile)
    _do_all_that_an_operator_may(profile)
    _pass_a_door_and_reject(profile)
    _find_two_in_one_tour(profile)
    return sorted(missing | (kernels.ready() - before) | kernels.returning_borrowed())


class _Linked(Searcher):
    """A robot whose images came over a network: nobody may write to what was unpacked."""

    def _world(self, scene, start):
        camera, config = camera_of(self.robot, 64), WorldConfig.perfect()
        world = SimulatedWorld(scene, self.robot, camera, start, seed=1, config=config)
        observe = world.observe

        def observe_linked():
            frame = observe()
            frame.color.flags.writeable = False
            if frame.heatmap is not None:
                frame.heatmap.probabilities.flags.writeable = False
            return frame

        world.observe = observe_linked
        return world


def _find_out_of_reach_and_exhaust(profile) -> None:
    barrier = ("wall", "wall", (4.0, -0.1, 0.0), (4.1, 4.1, 0.9))
    robot = _Linked([*boxed_room(), barrier, TOILET], 1.0, 2.0, robot=profile)
    robot.ask("toilet")
    robot.search(150.0)
    assert robot.last.outcome == "out_of_reach"
    assert robot.mission.goals.reject_find()
    robot.search(120.0)
    assert robot.last.state is MissionState.EXHAUSTED


def _do_all_that_an_operator_may(profile) -> None:
    home = [*boxed_room(8.0, 4.0), ("sofa", "sofa", (3.0, 3.1, 0.0), (4.6, 3.9, 0.8))]
    robot = _Linked(home, 1.0, 2.0, robot=profile)
    _, guidance = robot.ask("hat", context="on the sofa")
    robot.search(20.0)
    mission = robot.mission
    other = guidance.changed([dataclasses.replace(guidance.rows[0], level=Level.CERTAIN)])
    assert mission.preview(other) is not None
    mission.goals.set_guidance(other)
    stroke = Stroke(kind="look_here", points=((5.0, 2.0),), radius_m=0.8)
    assert mission.operator.set_regions([stroke])
    robot.search(2.0)
    assert mission.operator.go_to((2.0, 2.0)) is not None
    robot.search(2.0)
    late = robot.world.observe()
    mission.step(dataclasses.replace(late, heatmap=None, stamp_ns=late.stamp_ns + 1))
    mission.learn(late)
    touched = dataclasses.replace(robot.world.observe(), contact=True)
    mission.step(dataclasses.replace(touched, stamp_ns=late.stamp_ns + 2))
    mission.voxel_map.add_label("bookcase")
    mission.goals.cancel_goal()
    mission.step(dataclasses.replace(robot.world.observe(), stamp_ns=late.stamp_ns + 3))


def _pass_a_door_and_reject(profile) -> None:
    home = [
        *boxed_room(8.0, 4.0),
        ("wall", "wall", (3.9, 0.0, 0.0), (4.1, 1.6, 2.5)),
        ("wall", "wall", (3.9, 2.4, 0.0), (4.1, 4.0, 2.5)),
        ("toilet", "toilet", (7.3, 0.3, 0.0), (7.8, 0.8, 0.8)),
    ]
    robot = _Linked(home, 1.5, 3.0, 0.25 * math.pi, robot=profile)
    robot.ask("toilet")
    robot.search(90.0)
    assert robot.last.state is MissionState.FOUND
    assert robot.mission.goals.reject_find()
    robot.search(4.0)


def _find_two_in_one_tour(profile) -> None:
    robot = _Linked([*boxed_room(), TOILET], 1.0, 2.0, robot=profile)
    goals = [robot.ask("toilet"), robot.ask("bathtub", goal_id=2)]
    robot.mission.goals.set_goals(goals)
    robot.search(60.0, lambda r: any(one.find is not None for one in r.snapshot.tour))
    assert robot.mission.goals.reject_find()
    robot.search(2.0)
    assert robot.mission.goals.tour is not None
