import dataclasses
import math
from types import SimpleNamespace

import pytest

from ippon.command import Command
from ippon.frame import NANOSECONDS
from ippon.geometry import base_pose
from ippon.mission.behaviors.config import RecoveryConfig
from ippon.mission.behaviors.recovery import Recovery
from ippon.robot import HABITAT, ZED, RobotProfile

S = NANOSECONDS
HERE = base_pose(1.0, 2.0, 0.0, 0.0)
DRIVE = Command(linear_m_s=0.4)


def frame(stamp_ns, T_world_base, *, contact=False, tilt_rad=0.0):
    return SimpleNamespace(
        stamp_ns=stamp_ns, T_world_base=T_world_base, contact=contact, tilt_rad=tilt_rad
    )


def freeing(recovery, stamp_ns, tilt_rad):
    action = recovery.act(SimpleNamespace(frame=frame(stamp_ns, HERE, tilt_rad=tilt_rad)))
    return None if action is None else action.command


def test_contact_is_reported_once_while_it_lasts() -> None:
    recovery = Recovery(RecoveryConfig(), ZED)
    assert recovery.is_blocked(frame(0, HERE, contact=True), DRIVE)
    assert not recovery.is_blocked(frame(S // 5, HERE, contact=True), DRIVE)
    assert not recovery.is_blocked(frame(2 * S, HERE, contact=False), DRIVE)
    assert recovery.is_blocked(frame(3 * S, HERE, contact=True), DRIVE)


@pytest.mark.parametrize("robot", [ZED, HABITAT])
def test_backs_off_for_a_moment_or_turns_where_it_cannot(robot: RobotProfile) -> None:
    config = RecoveryConfig()
    recovery = Recovery(config, robot)
    recovery.is_blocked(frame(0, HERE, contact=True), DRIVE)
    command = freeing(recovery, S // 10, -0.2)
    assert command is not None
    assert command.tilt_rad == -0.2
    assert (command.linear_m_s < 0) is robot.can_reverse
    assert (command.yaw_rate_rad_s > 0) is not robot.can_reverse
    assert freeing(recovery, 3 * S, 0.0) is None


def test_a_robot_that_drove_backwards_frees_itself_forwards() -> None:
    recovery = Recovery(RecoveryConfig(), ZED)
    for drove_m_s, sign in ((-0.2, 1.0), (0.3, -1.0), (0.0, -1.0)):
        recovery.is_blocked(frame(0, HERE, contact=True), Command(linear_m_s=drove_m_s))
        command = freeing(recovery, S // 10, 0.0)
        assert command is not None
        assert command.linear_m_s * sign > 0.0
        recovery.is_blocked(frame(S, HERE), Command())


def test_backs_off_no_faster_than_it_may_drive() -> None:
    recovery = Recovery(RecoveryConfig(), dataclasses.replace(ZED, max_linear_m_s=0.1))
    recovery.is_blocked(frame(0, HERE, contact=True), DRIVE)
    command = freeing(recovery, S // 10, 0.0)
    assert command is not None
    assert command.linear_m_s == -0.1


def test_a_robot_that_does_not_follow_its_commands_is_stuck() -> None:
    recovery = Recovery(RecoveryConfig(stuck_after_s=2.0), ZED)
    stuck_at = None
    for k in range(40):
        stamp = k * S // 5
        if recovery.is_blocked(frame(stamp, HERE, contact=False), DRIVE):
            stuck_at = stamp
            break
        recovery.watch(frame(stamp, HERE), DRIVE)
    assert stuck_at is not None
    assert 2.0 * S < stuck_at <= 2.4 * S


@pytest.mark.parametrize("share", [0.1, 0.5])
def test_a_robot_at_a_speed_limit_counts_as_stuck_after_as_much_longer(share: float) -> None:
    recovery = Recovery(RecoveryConfig(stuck_after_s=2.0), ZED)
    stuck_at = None
    for k in range(200):
        if recovery.is_blocked(frame(k * S // 5, HERE), DRIVE):
            stuck_at = k / 5
            break
        recovery.watch(frame(k * S // 5, HERE), DRIVE, share)
    assert stuck_at is not None
    assert 2.0 / share < stuck_at <= 2.0 / share + 0.4


def test_a_robot_that_ends_a_turn_at_a_speed_limit_is_not_stuck() -> None:
    recovery = Recovery(RecoveryConfig(), ZED)
    share, off = 0.1, 0.2
    for k in range(200):
        here = base_pose(1.0, 2.0, 0.0, 0.5 - off)
        turn = Command(yaw_rate_rad_s=min(ZED.max_yaw_rate_rad_s, off / 0.3))
        assert not recovery.is_blocked(frame(k * S // 5, here), turn)
        recovery.watch(frame(k * S // 5, here), turn, share)
        off -= 0.2 * share * turn.yaw_rate_rad_s


def test_a_moving_or_waiting_robot_is_not_stuck() -> None:
    moving, waiting = Recovery(RecoveryConfig(), ZED), Recovery(RecoveryConfig(), ZED)
    for k in range(60):
        stamp = k * S // 5
        pose = base_pose(0.08 * k, 0.0, 0.0, 0.0)
        assert not moving.is_blocked(frame(stamp, pose, contact=False), DRIVE)
        moving.watch(frame(stamp, pose), DRIVE)
        assert not waiting.is_blocked(frame(stamp, HERE, contact=False), DRIVE)
        waiting.watch(frame(stamp, HERE), dataclasses.replace(DRIVE, linear_m_s=0.0))


@pytest.mark.parametrize("robot", [ZED, HABITAT])
def test_a_reset_of_the_clock_ends_the_recovery(robot: RobotProfile) -> None:
    recovery = Recovery(RecoveryConfig(), robot)
    recovery.is_blocked(frame(1000 * S, HERE, contact=True), DRIVE)
    assert freeing(recovery, 1000 * S, 0.0) is not None
    assert freeing(recovery, 3 * S, 0.0) is None
    # Nor does it go on when the new clock gets to where the old one was.
    assert freeing(recovery, 1000 * S, 0.0) is None


def test_a_robot_is_not_stuck_after_a_reset_of_the_clock() -> None:
    recovery = Recovery(RecoveryConfig(stuck_after_s=2.0), ZED)
    recovery.watch(frame(100 * S, HERE), DRIVE)
    assert not recovery.is_blocked(frame(S, HERE, contact=False), DRIVE)
    stuck_at = next(n for n in range(5, 40) if _drives_and_is_blocked(recovery, n * S // 5))
    assert stuck_at / 5 == pytest.approx(3.2), "it counts from the new clock on"


def _drives_and_is_blocked(recovery, stamp_ns):
    blocked = recovery.is_blocked(frame(stamp_ns, HERE), DRIVE)
    recovery.watch(frame(stamp_ns, HERE), DRIVE)
    return blocked


@pytest.mark.parametrize("away_s", [3, 3600])
def test_seconds_without_frames_are_no_seconds_without_movement(away_s: int) -> None:
    """The camera was away, in which time the robot stood, or its clock was set ahead."""
    recovery = Recovery(RecoveryConfig(), ZED)
    assert not _drives_and_is_blocked(recovery, 0)
    assert not _drives_and_is_blocked(recovery, away_s * S)
    for n in range(1, 10):
        assert not _drives_and_is_blocked(recovery, away_s * S + n * S // 5)
    assert any(_drives_and_is_blocked(recovery, away_s * S + n * S // 5) for n in range(10, 14))


def test_a_robot_with_one_frame_a_second_is_stuck_in_the_end() -> None:
    recovery = Recovery(RecoveryConfig(), ZED)
    assert any(_drives_and_is_blocked(recovery, n * S) for n in range(10))


@pytest.mark.parametrize("yaw", [0.0, math.pi])
def test_a_robot_whose_pose_trembles_is_stuck_whichever_way_it_faces(yaw: float) -> None:
    recovery = Recovery(RecoveryConfig(stuck_after_s=2.0), ZED)
    blocked = False
    for k in range(40):
        here = base_pose(1.0, 2.0, 0.0, yaw + 1e-3 * (-1) ** k)
        blocked = blocked or recovery.is_blocked(frame(k * S // 5, here, contact=False), DRIVE)
        recovery.watch(frame(k * S // 5, here), DRIVE)
    assert blocked
