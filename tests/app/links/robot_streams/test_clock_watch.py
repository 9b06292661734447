import dataclasses

import pytest

from app.links.robot_streams import clock_watch
from app.links.robot_streams.clock_watch import LONGEST, ClockWatch
from app.messages.motion import StampedTransform, encode_transforms
from tests.app.links.robot_streams.turning_robot import SECOND, TurningRobot


@pytest.fixture(scope="module")
def turning():
    return TurningRobot()


@pytest.fixture
def watch_all(monkeypatch):
    """Return what feeds a watch with a robot's messages, and waits for its comparisons."""
    monkeypatch.setattr(clock_watch, "SOON_S", 0.0)
    monkeypatch.setattr(clock_watch, "EVERY_S", 0.0)

    def watch_all(robot, offset_s, known_s=0.0):
        watch, offset_ns = ClockWatch("map", known_s), round(offset_s * SECOND)
        watch.add_transforms(b"garbage", fixed=True)
        for stamp_ns, T in robot.poses:
            pose = StampedTransform(
                stamp_ns=stamp_ns + offset_ns, parent="map", child="eye", T_parent_child=T
            )
            watch.add_transforms(encode_transforms([pose]), fixed=False)
        for frame in robot.frames:
            watch.add(dataclasses.replace(frame, stamp_ns=frame.stamp_ns + SECOND), "eye")
            if watch._thread is not None:
                watch._thread.join()
        return watch

    return watch_all


@pytest.mark.slow
@pytest.mark.parametrize(("offset_s", "known_s"), [(0.3, 0.0), (-0.2, 0.0), (0.4, 0.1)])
def test_clocks_that_are_apart_are_told_with_the_entry_of_the_profile(
    turning, watch_all, offset_s, known_s
):
    problem = watch_all(turning, offset_s, known_s).problem()
    apart_ms = abs(round(1e3 * (offset_s - known_s)))
    said = int(problem.split(" ms apart", 1)[0].rsplit(" ", 1)[1])
    entry = int(problem.split("clock_offset_ms: ", 1)[1].split("`", 1)[0])
    assert said == pytest.approx(apart_ms, abs=10)
    assert entry == pytest.approx(1e3 * offset_s, abs=10)


@pytest.mark.slow
def test_clocks_that_agree_and_a_robot_that_stands_are_not(turning, watch_all):
    for robot, offset_s, compared in ((turning, 0.0, 2), (TurningRobot(yaw_rate=0.0), 0.3, 0)):
        watch = watch_all(robot, offset_s)
        assert watch.problem() == ""
        assert len(watch._estimates) == compared


def test_messages_that_are_too_long_are_not_kept():
    watch = ClockWatch("map", 0.0)
    for size in (LONGEST, LONGEST + 1):
        watch.add_transforms(bytes(size), fixed=False)
        watch.add_transforms(bytes(size), fixed=True)
    assert [len(one) for one in (*watch._poses, *watch._fixed)] == [LONGEST] * 2
