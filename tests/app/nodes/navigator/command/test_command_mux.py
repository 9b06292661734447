"""The operator's hand becomes a command within a moment, and nothing when it lets go."""

import contextlib
import dataclasses
import itertools
import queue
import re
import threading
import time
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest

from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.driving import TeleopTag
from app.messages.motion import StampedTwist, decode_twist, encode_twist
from app.nodes.navigator.command import command_mux
from app.nodes.navigator.command.command_mux import TICK_S, CommandMux
from app.nodes.navigator.command.command_stream import CommandStream
from app.nodes.navigator.command.teleop_inbox import TeleopMessage
from app.nodes.navigator.command.touch import Touch
from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.control.drive_mode import DriveMode, TeleopInput
from ippon.frame import Frame
from ippon.geometry import base_pose
from ippon.mapping.voxel_map import MapConfig, VoxelMap
from ippon.robot import ZED
from tests.floor_map import floor_with

ROBOT = "ippon"
STALE_S = 1.0
PATIENCE_S = 20.0
END = StampedTwist(stamp_ns=10**18, linear_m_s=0.0, yaw_rate_rad_s=0.0)
PLANNED = Command(linear_m_s=0.4, yaw_rate_rad_s=0.2, tilt_rad=-0.3)
CAMERA = PinholeCamera(width=64, height=40, fx=40.0, fy=40.0, cx=32.0, cy=20.0)
LOOKS_AHEAD = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]]
)


class Bench:
    """A mux, the operator's end of the line, and the robot's."""

    def __init__(self, router, client, *, stale_s, profile=ZED) -> None:
        self.commands: queue.Queue[StampedTwist] = queue.Queue()
        self.refusal: str | None = None
        self.takeovers = 0
        subscribe(client, f"{ROBOT}/{keys.CMD_VEL}", lambda p: self.commands.put(decode_twist(p)))
        self.stream = CommandStream(router, ROBOT, 20.0, stale_s)
        self.mux = CommandMux(
            router,
            ROBOT,
            profile,
            self.stream,
            stale_s,
            refusal=lambda _: self.refusal,
            on_takeover=self._took_over,
        )
        self._router = router
        self._publisher = client.declare_publisher(f"{ROBOT}/{keys.TELEOP}", express=True)
        self._seq = 0
        self.arrays = VoxelMap(MapConfig(), ["wall", "floor"]).arrays()

    def _took_over(self) -> None:
        self.takeovers += 1

    def frame(self, going=None, *, ahead_m=0.0, age_s=0.0, contact=False) -> Command:
        """Let the mission answer a frame, which shows a wall that far ahead of the camera."""
        frame = Frame(
            stamp_ns=time.monotonic_ns(),
            color=np.zeros((40, 64, 3), np.uint8),
            depth=np.full((40, 64), ahead_m, np.float32),
            camera=CAMERA,
            T_world_camera=LOOKS_AHEAD,
            T_world_base=base_pose(0.0, 0.0, 0.0, 0.0),
            tilt_rad=0.1,
            contact=contact,
        )
        return self.mux.follow(PLANNED, frame, self.arrays, going, age_s)

    def hold(self, linear=0.0, yaw=0.0, tilt=0.0, seq=None, epoch=1) -> None:
        """Send one message of the hand."""
        self._seq = self._seq + 1 if seq is None else seq
        twist = StampedTwist(
            stamp_ns=0, linear_m_s=linear, yaw_rate_rad_s=yaw, tilt_rate_rad_s=tilt
        )
        tag = TeleopTag(sender="a", epoch=epoch, seq=self._seq)
        self._publisher.put(encode_twist(twist), attachment=msgspec.json.encode(tag))

    def until_heard(self) -> None:
        """Wait until the mux has the last message of the hand."""
        deadline = time.monotonic() + PATIENCE_S
        while self.mux._last_tag.seq != self._seq:
            assert time.monotonic() < deadline
            time.sleep(0.01)

    def until(self, wanted) -> None:
        """Wait for a command that is as wanted."""
        began = time.monotonic()
        while True:
            left = PATIENCE_S - (time.monotonic() - began)
            if wanted(self.commands.get(timeout=max(left, 1e-3))):
                return

    def hold_until(self, wanted, timeout_s=PATIENCE_S, **hand) -> StampedTwist:
        """Hold keys down, as a page does, while frames come; returns the command as wanted."""
        began = time.monotonic()
        while (now := time.monotonic()) - began < timeout_s:
            self.frame()
            self.hold(**hand)
            with contextlib.suppress(queue.Empty):
                while (left := now + 0.05 - time.monotonic()) > 0.0:
                    if wanted(twist := self.commands.get(timeout=left)):
                        return twist
        raise AssertionError(f"never: {hand}")

    def sent_so_far(self) -> list[StampedTwist]:
        """Return the commands that nobody has taken, however late they come."""
        # It goes after all that was sent before it.
        self._router.put(f"{ROBOT}/{keys.CMD_VEL}", encode_twist(END))
        return list(iter(lambda: self.commands.get(timeout=PATIENCE_S), END))

    def stands_still(self) -> bool:
        """Return whether all commands of the next moments are to stand, or none comes."""
        self.sent_so_far()
        time.sleep(4 * TICK_S)
        return all(map(stands, self.sent_so_far()))

    def close(self) -> None:
        self.mux.close()
        self.stream.close()


def test_in_manual_no_place_is_given_once_frames_stop(sessions):
    """Where goals are a topic, a stop is a goal there, and somebody may have moved the robot."""
    given = queue.SimpleQueue()
    stream = SimpleNamespace(
        give=lambda _, __, pose: given.put(pose), sent=Command(), drop=lambda: None
    )
    mux: Any = CommandMux(
        sessions[0], ROBOT, ZED, stream, 0.2, refusal=lambda _: None, on_takeover=lambda: None
    )
    bench = SimpleNamespace(mux=mux, arrays=VoxelMap(MapConfig(), ["wall", "floor"]).arrays())
    try:
        mux.set_mode(DriveMode.MANUAL, 1.0)
        Bench.frame(bench)
        poses = []
        while not poses or poses[-1] is not None:
            poses.append(given.get(timeout=PATIENCE_S))
        assert poses[0] is not None
        assert given.get(timeout=PATIENCE_S) is None
    finally:
        mux.close()


@pytest.fixture
def bench(sessions, monkeypatch):
    """Neither the hand nor the camera counts as silent: a busy machine may hold up both."""
    monkeypatch.setattr(command_mux, "HAND_S", PATIENCE_S)
    bench = Bench(*sessions, stale_s=PATIENCE_S)
    yield bench
    bench.close()


@pytest.fixture
def guarded(sessions):
    """A bench on which hand and camera count as silent as soon as for users."""
    bench = Bench(*sessions, stale_s=STALE_S)
    yield bench
    bench.close()


def stands(twist: StampedTwist) -> bool:
    return twist.linear_m_s == 0.0 and twist.yaw_rate_rad_s == 0.0


def test_a_held_key_drives_and_a_silent_hand_stops(guarded, monkeypatch):
    bench, tick, ticks = guarded, guarded.mux._tick, []

    def noted(now):
        ticks.append((now - bench.mux._hand_at, tick(now)))
        return ticks[-1][1]

    bench.mux.set_mode(DriveMode.MANUAL, 1.0)
    bench.frame()
    bench.hold_until(
        lambda t: t.linear_m_s == pytest.approx(0.8) and bench.mux.status().by_hand, linear=0.8
    )
    monkeypatch.setattr(bench.mux, "_tick", noted)
    # No message of letting go: the browser is gone. The camera is not.
    deadline = time.monotonic() + PATIENCE_S
    while not (late := [command for silent_s, command in ticks if silent_s > 0.5]):
        assert time.monotonic() < deadline
        bench.frame()
        time.sleep(TICK_S)
    assert {command.linear_m_s for command in late} == {0.0}
    bench.until(stands)
    assert not bench.mux.status().by_hand


def test_the_speed_limit_slows_hand_and_planner_alike(bench):
    bench.mux.set_mode(DriveMode.MANUAL, 0.5)
    bench.frame()
    bench.hold_until(
        lambda t: (t.linear_m_s, t.yaw_rate_rad_s) == pytest.approx((0.4, -0.6)),
        linear=0.8,
        yaw=-1.2,
    )
    bench.mux.set_mode(DriveMode.AUTO, 0.5)
    assert bench.frame() == Command(linear_m_s=0.2, yaw_rate_rad_s=0.1, tilt_rad=-0.3)


def test_in_auto_the_hand_has_no_part(bench):
    bench.frame()
    bench.hold(linear=-0.5)
    time.sleep(0.2)
    assert bench.frame() == PLANNED


def test_a_message_that_is_older_than_the_last_does_not_count(bench):
    bench.mux.set_mode(DriveMode.MANUAL, 1.0)
    bench.frame()
    bench.hold_until(lambda t: t.linear_m_s == pytest.approx(0.3), linear=0.3)
    bench.hold(linear=0.7, seq=1)
    bench.hold(linear=0.2, seq=1001)
    bench.until(lambda t: t.linear_m_s == pytest.approx(0.2))
    seen = []
    while not bench.commands.empty():
        seen.append(bench.commands.get().linear_m_s)
    assert all(speed <= 0.2 for speed in seen)


def test_a_hand_without_the_right_to_drive_is_told_why(bench):
    bench.refusal = "Anna has control"
    bench.mux.set_mode(DriveMode.MANUAL, 1.0)
    bench.frame()
    bench.hold(linear=0.8)
    deadline = time.monotonic() + 20.0
    while bench.mux.status().intervention != "Anna has control":
        assert time.monotonic() < deadline
        # What is held is let go 0.3 s after its last message.
        bench.hold(linear=0.8)
        time.sleep(0.01)
    assert stands(bench.commands.get(timeout=PATIENCE_S))


def test_without_pictures_there_is_no_driving(guarded):
    guarded.mux.set_mode(DriveMode.MANUAL, 1.0)
    framed_at = time.monotonic()
    guarded.frame()
    reason = re.compile(r"stopped: no picture for (\d+\.\d) s")
    while not (told := reason.fullmatch(guarded.mux.status().intervention)):
        assert time.monotonic() - framed_at < PATIENCE_S
        guarded.hold(linear=0.5)
        time.sleep(0.05)
    assert STALE_S <= float(told[1]) <= time.monotonic() - framed_at + 0.1
    assert stands(guarded.sent_so_far()[-1])


def test_a_picture_that_was_old_when_it_was_in_the_map_does_not_drive(guarded):
    mux = guarded.mux
    late = "stopped: the newest picture was 1.6 s old when it was in the map: this machine is slow"
    with mux._lock:  # No tick without a key comes between.
        assert _filtered(guarded, age_s=0.6) == 0.8
        assert _filtered(guarded, age_s=1.6) == 0.0
        assert mux.status().intervention == f"{late} or busy"


def test_the_reason_stays_while_slow_commands_pass_the_filter(bench, monkeypatch):
    reasons = itertools.cycle(["stopped: obstacle 0.3 m ahead", None, None])
    monkeypatch.setattr(
        command_mux, "filter_among_hazards", lambda wanted, *_: (wanted, next(reasons))
    )
    assert command_mux.REASON_S > 3 * TICK_S, "two commands pass between two that do not"
    monkeypatch.setattr(command_mux, "REASON_S", PATIENCE_S)
    bench.mux.set_mode(DriveMode.MANUAL, 1.0)

    def told():
        bench.frame()
        bench.hold(linear=0.5)
        time.sleep(TICK_S)
        return bench.mux.status().intervention

    until = time.monotonic() + PATIENCE_S
    while not told() and time.monotonic() < until:
        pass
    assert {told() for _ in range(9)} == {"stopped: obstacle 0.3 m ahead"}
    reasons = itertools.repeat(None)
    monkeypatch.setattr(command_mux, "REASON_S", 0.1)
    while told():
        assert time.monotonic() < until


def test_the_camera_tilts_by_rate_and_stays_where_it_is_let_go(bench):
    bench.mux.set_mode(DriveMode.MANUAL, 1.0)
    bench.frame()
    deadline = time.monotonic() + PATIENCE_S
    while bench.frame().tilt_rad <= 0.1:
        assert time.monotonic() < deadline
        bench.hold(tilt=1.2)
        time.sleep(0.05)
    bench.hold()
    bench.until_heard()
    held = bench.frame().tilt_rad
    time.sleep(0.1)
    assert bench.frame().tilt_rad == held


def test_a_hand_takes_over_on_the_way_to_a_point(bench):
    bench.mux.set_mode(DriveMode.MANUAL, 1.0)
    assert bench.frame(going=(1.0, 0.0)) == PLANNED, "the robot goes there by itself"
    bench.hold(yaw=1.0)
    bench.until(lambda t: t.linear_m_s == 0.0 and t.yaw_rate_rad_s > 0.0)
    bench.hold_until(lambda t: t.yaw_rate_rad_s == pytest.approx(1.0), yaw=1.0)
    assert bench.takeovers == 1


@pytest.mark.parametrize("mode", [DriveMode.MANUAL, DriveMode.ASSISTED])
def test_on_the_way_to_a_point_a_robot_without_pictures_stands(guarded, monkeypatch, mode):
    stream, put, sent = guarded.stream, guarded.stream._put_twist, []

    def noted(linear_m_s, yaw_rate_rad_s):
        sent.append((time.monotonic(), linear_m_s))
        put(linear_m_s, yaw_rate_rad_s)

    monkeypatch.setattr(stream, "_put_twist", noted)
    guarded.mux.set_mode(mode, 1.0)
    assert guarded.frame(going=(1.0, 0.0)) == PLANNED
    framed_at = time.monotonic()
    guarded.until(lambda t: t.linear_m_s == pytest.approx(PLANNED.linear_m_s))
    guarded.until(stands)
    late = [linear_m_s for at, linear_m_s in sent if at - framed_at > 1.2 * STALE_S]
    assert set(late) <= {0.0}, "not after the frame is stale"
    assert guarded.stands_still(), "the ticks of the mux do not bring the old command back"


def test_what_the_navigator_drops_stays_dropped_on_the_way_to_a_point(bench):
    bench.mux.set_mode(DriveMode.MANUAL, 1.0)
    bench.frame(going=(1.0, 0.0))
    bench.stream.drop()
    assert bench.stands_still()
    assert bench.frame(going=(1.0, 0.0)) == PLANNED, "with the next frame it goes on"
    bench.until(lambda t: t.linear_m_s == pytest.approx(PLANNED.linear_m_s))


def test_a_robot_that_takes_no_command_does_not_keep_the_operators_stop_waiting(bench, sessions):
    router, client = sessions
    stop_came, blocked, released = threading.Event(), threading.Event(), threading.Event()
    subscribe(router, f"{ROBOT}/stop", lambda _: stop_came.set())
    bench.mux.set_mode(DriveMode.MANUAL, 1.0)
    bench.frame()
    bench.hold_until(lambda t: t.linear_m_s == pytest.approx(0.3), linear=0.3)

    def put(_):
        blocked.set()
        assert released.wait(PATIENCE_S)

    bench.stream._twist = SimpleNamespace(put=put)
    try:
        bench.hold(linear=0.3)
        assert blocked.wait(PATIENCE_S)
        # The command of this message waits for the one that is blocked.
        bench.hold(linear=0.4)
        time.sleep(0.2)
        client.put(f"{ROBOT}/stop", b"")
        assert stop_came.wait(PATIENCE_S / 2)
    finally:
        released.set()


def test_a_hand_that_waited_does_not_end_a_way_that_was_given_since(bench):
    bench.mux.set_mode(DriveMode.MANUAL, 1.0)
    bench.frame(going=(1.0, 0.0))
    tag, hand = TeleopTag(sender="a", epoch=1, seq=5), TeleopInput(forward=1.0)
    waited = TeleopMessage(tag, hand, time.monotonic() - 2 * command_mux.HAND_S)
    bench.mux._inbox._messages.put(waited)
    bench._seq = tag.seq
    bench.until_heard()
    assert bench.mux.status().waypoint == (1.0, 0.0)
    assert bench.takeovers == 0


def test_hostile_messages_are_skipped(bench, sessions):
    bench.mux.set_mode(DriveMode.MANUAL, 1.0)
    bench.frame()
    key = f"{ROBOT}/{keys.TELEOP}"
    sessions[1].put(key, b"\x00" * 40)
    sessions[1].put(key, encode_twist(StampedTwist(stamp_ns=0, linear_m_s=1, yaw_rate_rad_s=0)))
    bench.hold_until(lambda t: t.linear_m_s == pytest.approx(0.25), linear=0.25)


def test_a_hand_speeds_up_as_fast_as_the_robot_can(bench):
    bench.mux.set_mode(DriveMode.MANUAL, 1.0)
    bench.frame()
    bench.until(stands)
    began, told = time.monotonic(), []

    def note(twist):
        told.append((time.monotonic() - began, twist.linear_m_s, twist.yaw_rate_rad_s))
        return twist.linear_m_s == pytest.approx(0.7)

    bench.hold_until(note, linear=0.7, yaw=1.1)
    for after_s, speed, turn in told:
        # A tick that comes late makes up for less than two.
        assert speed <= ZED.max_linear_acceleration_m_s2 * (after_s + 2 * TICK_S) + 1e-9
        assert turn <= ZED.max_yaw_acceleration_rad_s2 * (after_s + 2 * TICK_S) + 1e-9
    speeds = np.array([speed for _, speed, _ in told])
    assert np.diff(speeds).max() <= ZED.max_linear_acceleration_m_s2 * 2 * TICK_S + 1e-9
    assert np.diff(speeds).min() >= 0.0
    assert len(np.unique(speeds)) >= 0.7 / (ZED.max_linear_acceleration_m_s2 * 2 * TICK_S)


@pytest.mark.parametrize("back", [0.0, -0.4])
def test_what_is_let_go_or_turned_round_stops_at_once(bench, back):
    bench.mux.set_mode(DriveMode.MANUAL, 1.0)
    bench.frame()
    bench.hold_until(lambda t: t.linear_m_s == pytest.approx(0.5), linear=0.5)
    slow = ZED.max_linear_acceleration_m_s2 * 2 * TICK_S
    bench.hold(linear=back)
    told = []
    bench.until(lambda t: told.append(t.linear_m_s) or t.linear_m_s <= 0.0)
    assert set(told[:-1]) <= {0.5}, "nothing between"
    assert -slow <= told[-1] <= 0.0
    if back:
        bench.hold_until(lambda t: t.linear_m_s == pytest.approx(back), linear=back)


def test_after_a_stop_the_hand_starts_from_rest(bench):
    bench.mux.set_mode(DriveMode.MANUAL, 1.0)
    bench.frame()
    bench.hold_until(lambda t: t.linear_m_s == pytest.approx(0.5), linear=0.5)
    bench.stream.halt()
    bench.hold_until(stands, linear=0.5)
    assert bench.stream.release(bench.stream.halts)
    # Held all the while.
    first = bench.hold_until(lambda t: t.linear_m_s > 0.0, linear=0.5)
    assert first.linear_m_s <= ZED.max_linear_acceleration_m_s2 * 2 * TICK_S + 1e-9


def test_the_planner_learns_what_the_hand_commanded_last(bench):
    assert bench.mux.by_hand() is None
    bench.mux.set_mode(DriveMode.MANUAL, 1.0)
    bench.frame()
    bench.hold_until(lambda t: t.linear_m_s == pytest.approx(0.3), linear=0.3)
    bench.hold(linear=0.3)
    bench.mux.set_mode(DriveMode.AUTO, 1.0)
    assert bench.mux.by_hand().linear_m_s == pytest.approx(0.3)
    assert bench.frame() == PLANNED
    assert bench.mux.by_hand() is None, "the planner drives"


def test_along_the_plan_the_planner_goes_on_by_itself(bench):
    bench.mux.set_mode(DriveMode.ASSISTED, 1.0)
    bench.frame()
    assert bench.mux.by_hand().linear_m_s == 0.0, "nothing is held"
    bench.hold_until(lambda t: t.linear_m_s == pytest.approx(0.4), linear=0.8)
    bench.hold(linear=0.8)
    bench.frame()
    assert bench.mux.by_hand() is None


def _filtered(bench, wanted=0.8, mode=DriveMode.MANUAL, **frame) -> float:
    """Return the speed that is left of what the hand wants right after a frame."""
    bench.mux.set_mode(mode, 1.0)
    bench.frame(**frame)
    mux, command = bench.mux, Command(linear_m_s=wanted)
    return mux._filtered(command, mux._framed_at, as_planned=False).linear_m_s


@pytest.mark.parametrize("drove", [0.5, -0.5])
def test_what_the_robot_touches_stops_the_hand_and_lets_it_back_away(bench, drove):
    mux, touched = bench.mux, "stopped: the bumper is pressed"
    mux.set_mode(DriveMode.MANUAL, 1.0)
    bench.frame()
    bench.hold_until(lambda t: t.linear_m_s == pytest.approx(drove), linear=drove)
    with mux._lock:  # No tick without a key comes between.
        assert _filtered(bench, drove, contact=True) == 0.0
        assert mux.status().intervention == touched
    for hand, left in ((drove, 0.0), (-drove, -drove)):
        command = Command(linear_m_s=hand, yaw_rate_rad_s=0.5)
        safe = mux._filtered(command, mux._framed_at, as_planned=False)
        assert safe == dataclasses.replace(command, linear_m_s=left)
    assert _filtered(bench, drove) == drove, "nothing is touched any more"


def test_who_turned_round_before_the_contact_was_known_may_back_away():
    touch = Touch()
    touch.drove(0.5, 1.0)
    touch.drove(-0.2, 2.0)
    touch.saw(1.5, contact=True)
    assert touch.blocks(0.5)
    assert not touch.blocks(-0.2)
    touch.saw(2.5, contact=False)
    touch.saw(2.6, contact=True)
    assert touch.blocks(-0.2), "backwards into something"
    assert not touch.blocks(0.5)


@pytest.mark.parametrize("mode", [DriveMode.MANUAL, DriveMode.ASSISTED])
def test_who_steps_in_front_stops_the_hand_with_the_first_image(bench, mode):
    assert _filtered(bench, mode=mode) == 0.8
    assert _filtered(bench, mode=mode, ahead_m=ZED.radius_m + 0.1) < 0.2
    assert _filtered(bench, mode=mode, ahead_m=3.0) == 0.8


@pytest.mark.parametrize("mode", [DriveMode.MANUAL, DriveMode.ASSISTED])
def test_a_hand_does_not_drive_over_the_edge_of_the_floor(bench, mode):
    bench.arrays = floor_with(holes=[(ZED.radius_m + 0.2, -2.0, 3.0, 2.0)])
    with bench.mux._lock:  # No tick without a key comes between.
        assert _filtered(bench, mode=mode) == 0.0
        assert bench.mux.status().intervention == "stopped: drop 0.35 m ahead"
        assert _filtered(bench, -0.4, mode=mode) == -0.4, "away from it"


def test_a_hand_does_not_drive_where_an_edge_hides_the_floor_and_the_plan_may(bench):
    near, edge = ZED.radius_m + 0.2, ZED.radius_m + 0.6
    bench.arrays = floor_with(holes=[(edge, -2.0, 3.0, 2.0)], unseen=[(near, -2.0, edge, 2.0)])
    mux = bench.mux
    with mux._lock:  # No tick without a key comes between.
        assert _filtered(bench, 0.4, mode=DriveMode.ASSISTED) < 0.4
        assert mux.status().intervention.endswith(": drop 0.45 m ahead")
        planned = Command(linear_m_s=0.4)
        assert mux._filtered(planned, mux._framed_at, as_planned=True) == planned


def test_the_later_a_frame_comes_the_farther_ahead_the_hand_is_checked(bench):
    speeds = [_filtered(bench, ahead_m=1.25, age_s=age_s) for age_s in (0.0, 0.2, 0.8, 1.0, 1.1)]
    assert speeds[0] == speeds[1] == 0.8, "a frame of ordinary age costs nothing"
    assert 0.8 > speeds[2] >= speeds[3] > speeds[4] == 0.0


def test_obstacles_are_kept_as_far_as_a_fast_robot_brakes(sessions):
    fast = dataclasses.replace(ZED, max_linear_m_s=2.0, max_linear_acceleration_m_s2=0.8)
    bench = Bench(*sessions, stale_s=STALE_S, profile=fast)
    braking_m = 2.0 * 2.0 / (2 * 0.8)
    assert _filtered(bench, 2.0, ahead_m=fast.radius_m + braking_m + 0.5) < 2.0
    bench.close()
