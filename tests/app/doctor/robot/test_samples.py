"""Listening to a robot over zenoh."""

import threading
import time

import pytest

from app.doctor.robot.samples import MOST_KEPT, Samples, listen
from app.messages import keys
from app.messages.motion import StampedTwist, encode_twist


def test_messages_are_kept_with_arrival_and_stamp(sessions):
    robot, doctor = sessions
    subscriber = robot.declare_subscriber(f"r/{keys.CMD_VEL}", lambda _: None)
    token = robot.liveliness().declare_token("r/alive/ros2/1-host-7")
    stop = threading.Event()

    def speak():
        while not stop.wait(0.02):
            twist = StampedTwist(stamp_ns=5_000_000_007, linear_m_s=0.0, yaw_rate_rad_s=0.0)
            robot.put(f"r/{keys.CMD_VEL}", encode_twist(twist))
            robot.put(f"r/{keys.COLOR}", b"short")

    speaker = threading.Thread(target=speak)
    speaker.start()
    samples = listen(doctor, "r", 1.0)
    stop.set()
    speaker.join()
    assert samples.takes_velocities
    assert not samples.takes_goals
    assert not samples.navigator
    assert samples.bridges == ("r/alive/ros2/1-host-7",)
    arrival = samples.arrivals[keys.CMD_VEL][-1]
    assert arrival.stamp_ns == 5_000_000_007
    assert abs(time.time_ns() - arrival.at_ns) < 5_000_000_000
    assert samples.arrivals[keys.COLOR][-1].stamp_ns is None
    assert samples.of(keys.DEPTH, keys.COLOR)[0] == keys.COLOR
    assert samples.of(keys.DEPTH, keys.DEPTH_RAW) == (keys.DEPTH, [])
    assert subscriber is not None
    assert token is not None


def test_who_listens_itself_takes_no_commands(sessions):
    samples = listen(sessions[1], "r", 0.2)
    assert not samples.takes_velocities
    assert not samples.takes_goals


@pytest.mark.parametrize("attachment", [None, keys.COMPUTED])
def test_tf_that_the_navigator_computed_is_noted(sessions, attachment):
    navigator, doctor = sessions
    stop = threading.Event()

    def speak():
        while not stop.wait(0.02):
            navigator.put(f"r/{keys.TF}", b"", attachment=attachment)

    speaker = threading.Thread(target=speak)
    speaker.start()
    samples = listen(doctor, "r", 1.0)
    stop.set()
    speaker.join()
    assert samples.arrivals[keys.TF]
    assert samples.is_mount_assumed == (attachment is not None)


def test_a_recorder_is_told_from_a_simulated_robot(sessions):
    robot, doctor = sessions
    recorder = robot.declare_subscriber("r/**", lambda _: None)
    samples = listen(doctor, "r", 1.0)
    assert samples.takes_velocities
    assert samples.onlookers
    assert not samples.simulated
    recorder.undeclare()
    truth = robot.declare_queryable(f"r/{keys.SIM_TRUTH}", lambda _: None)
    velocities = robot.declare_subscriber(f"r/{keys.CMD_VEL}", lambda _: None)
    samples = listen(doctor, "r", 1.0)
    assert (samples.takes_velocities, samples.onlookers, samples.simulated) == (True, False, True)
    truth.undeclare()
    velocities.undeclare()


def test_of_many_images_only_the_last_stay_whole():
    samples = Samples(seconds=1.0)
    for k in range(2 * MOST_KEPT):
        samples.add(keys.COLOR, bytes(100), k)
    kept = [bool(a.payload) for a in samples.arrivals[keys.COLOR]]
    assert kept == [False] * MOST_KEPT + [True] * MOST_KEPT
