import math
from types import SimpleNamespace

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.mission.behaviors.config import LookAroundConfig
from ippon.mission.behaviors.look_around import LookAround
from ippon.mission.journal import Journal
from ippon.robot import HABITAT, ZED, RobotProfile

DT_S = 0.2


def run(look: LookAround, robot: RobotProfile, dt: float = 0.2) -> tuple[list[float], list[float]]:
    yaw, tilt = 3.0, 0.0
    yaws, tilts = [yaw], [tilt]
    for _ in range(600):
        command = look.step(math.remainder(yaw, 2 * math.pi), tilt, DT_S)
        if look.done:
            return yaws, tilts
        yaw += command.yaw_rate_rad_s * dt
        step = robot.max_tilt_rate_rad_s * dt
        tilt += float(np.clip(command.tilt_rad - tilt, -step, step))
        yaws.append(yaw)
        tilts.append(tilt)
    raise AssertionError("the look-around never ended")


@pytest.mark.parametrize("robot", [ZED, HABITAT])
def test_looks_down_before_it_turns_and_sees_the_whole_circle(robot: RobotProfile) -> None:
    look = LookAround(LookAroundConfig(), robot)
    yaws, tilts = run(look, robot)
    first_turn = next(i for i, yaw in enumerate(yaws) if yaw != yaws[0])
    assert min(tilts[: first_turn + 1]) == pytest.approx(-0.9, abs=0.06)
    assert max(yaws) - yaws[0] + robot.horizontal_fov_rad >= 2 * math.pi
    assert look.progress == 1.0


@pytest.mark.parametrize("robot", [ZED, HABITAT])
def test_turns_back_over_the_floor_close_by(robot: RobotProfile) -> None:
    yaws, tilts = run(LookAround(LookAroundConfig(), robot), robot)
    turned = int(np.argmax(yaws))
    low = [y for y, t in zip(yaws[turned:], tilts[turned:], strict=True) if abs(t + 0.75) < 0.06]
    assert max(low) - min(low) + robot.horizontal_fov_rad >= 2 * math.pi
    assert yaws[-1] < max(yaws)


def test_need_not_turn_back() -> None:
    yaws, _ = run(LookAround(LookAroundConfig(floor_tilt_rad=None), ZED), ZED)
    assert yaws[-1] == max(yaws)
    assert yaws[-1] - yaws[0] + ZED.horizontal_fov_rad >= 2 * math.pi


def test_without_initial_yaw_it_only_looks_down() -> None:
    yaws, tilts = run(LookAround(LookAroundConfig(turn=False), ZED), ZED)
    assert set(yaws) == {3.0}
    assert min(tilts) < -0.8


def test_skip_ends_it() -> None:
    look = LookAround(LookAroundConfig(), ZED)
    look.skip()
    assert look.done


def test_what_was_interrupted_at_the_start_is_made_up_for() -> None:
    look = LookAround(LookAroundConfig(), ZED)
    assert look.step(0.0, -0.9, DT_S).yaw_rate_rad_s > 0.0
    look.step(0.3, -0.25, DT_S)
    begun = look.progress
    assert begun > 0.0
    look.interrupt(gone_m=0.2)
    look.step(2.0, -0.25, DT_S)
    assert look.progress == begun, "a turn towards something else is none of it"
    look.step(2.3, -0.25, DT_S)
    assert look.progress == pytest.approx(2 * begun)
    look.interrupt(gone_m=0.8)
    assert look.done


def test_the_noise_of_a_standing_robots_pose_is_no_turn() -> None:
    look, noise = LookAround(LookAroundConfig(), ZED), np.random.default_rng(0)
    for yaw in noise.normal(0.0, 0.01, 500):
        look.step(float(yaw), -0.9, DT_S)
    assert look.progress < 0.02


def test_noise_shortens_neither_turn() -> None:
    look, noise = LookAround(LookAroundConfig(), ZED), np.random.default_rng(0)
    yaw, tilt, most = 0.0, -0.9, 0.0
    while not look.done:
        measured = math.remainder(yaw + float(noise.normal(0.0, 0.05)), 2 * math.pi)
        command = look.step(measured, tilt, DT_S)
        # At a speed limit.
        yaw, tilt = yaw + 0.3 * DT_S * command.yaw_rate_rad_s, command.tilt_rad
        most = max(most, yaw)
    for turned in (most, most - yaw):
        assert turned + ZED.horizontal_fov_rad >= 2 * math.pi


def act(look: LookAround, stamp_s: float, yaw: float) -> None:
    frame = SimpleNamespace(
        stamp_ns=round(1e9 * stamp_s), T_world_base=base_pose(0.0, 0.0, 0.0, yaw), tilt_rad=-0.9
    )
    search = SimpleNamespace(goal=SimpleNamespace(object="hat"), path_length_m=0.0)
    plan = SimpleNamespace(ends_search=False)
    step = SimpleNamespace(frame=frame, search=search, plan=plan, dt_s=DT_S, hold=None)
    assert look.act(step) is not None


def test_a_robot_that_was_turned_while_it_did_not_look_around_has_not_seen_that_side() -> None:
    look = LookAround(LookAroundConfig(), ZED)
    act(look, 10.0, 0.0)
    act(look, 10.2, 0.2)
    seen = look.progress
    assert seen > 0.0
    # A pause, by the end of which somebody has turned it.
    act(look, 14.2, 2.0)
    assert look.progress == seen
    act(look, 14.4, 2.2)
    assert look.progress == pytest.approx(2 * seen)


def test_what_interrupted_it_is_waited_for_some_steps() -> None:
    look = LookAround(LookAroundConfig(), ZED)
    assert not look.waits(), "nothing has interrupted it"
    look.interrupt(gone_m=0.0)
    assert [look.waits() for _ in range(6)] == [True] * 4 + [False] * 2
    look.interrupt(gone_m=0.0)
    look.interrupt(gone_m=0.0)
    assert look.waits()


@pytest.mark.parametrize("robot", [ZED, HABITAT])
def test_a_camera_that_sticks_does_not_hold_up_the_search(robot: RobotProfile) -> None:
    journal = Journal()
    look = LookAround(LookAroundConfig(), robot, journal)
    yaw, most, steps = 3.0, 3.0, 0
    while not look.done:
        yaw += 0.2 * look.step(math.remainder(yaw, 2 * math.pi), -0.3, 0.2).yaw_rate_rad_s
        most, steps = max(most, yaw), steps + 1
        assert 0.2 * steps < 120.0, "the look-around never ended"
    assert most - 3.0 + robot.horizontal_fov_rad >= 2 * math.pi, "with the tilt that it has"
    (event,) = journal.take()
    assert event.text == "the camera does not tilt: the search goes on with the tilt that it has"
