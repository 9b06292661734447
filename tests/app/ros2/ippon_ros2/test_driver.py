import logging
import math

import pytest

from app.messages.motion import StampedTwist, encode_twist
from app.ros2.ippon_ros2.driver import WATCHDOG_S, ZEROS_S, Driver


def twist(linear, turn=0.0, stamp_s=1.0):
    return encode_twist(
        StampedTwist(stamp_ns=round(1e9 * stamp_s), linear_m_s=linear, yaw_rate_rad_s=turn)
    )


@pytest.fixture
def sent():
    return []


@pytest.fixture
def driver(sent):
    return Driver(lambda *velocity: sent.append(velocity), 0.5, 1.0)


def test_commands_pass_within_the_limits_of_the_profile(driver, sent, caplog):
    driver.take(twist(0.3, -0.4), 0.0)
    driver.take(twist(0.9, -4.0, 1.1), 0.1)
    driver.take(twist(-0.9, 0.2, 1.2), 0.2)
    assert sent == [(0.3, -0.4), (0.5, -1.0), (-0.5, 0.2)]
    assert driver.clamped == 2
    assert caplog.text.count("exceeds the profile's limits") == 1


def test_zero_velocity_follows_the_last_command_and_ends(driver, sent, caplog):
    driver.take(twist(0.3), 10.0)
    for tick in range(100):
        driver.tick(10.0 + 0.02 * tick)
    zeros = sent[1:]
    assert set(zeros) == {(0.0, 0.0)}
    assert len(zeros) == pytest.approx(ZEROS_S / 0.02, abs=2)
    assert caplog.text.count("zero velocity") == 1
    driver.tick(20.0)
    assert len(sent) == 1 + len(zeros), "another source may drive now"


def test_a_process_that_was_held_up_sends_zero_velocity_when_it_goes_on(driver, sent):
    driver.take(twist(0.3), 10.0)
    driver.tick(30.0)
    driver.tick(30.0 + 0.9 * ZEROS_S)
    driver.tick(30.0 + 1.1 * ZEROS_S)
    assert sent[1:] == [(0.0, 0.0)] * 2
    driver.take(twist(0.3, stamp_s=3.0), 40.0)
    driver.release()
    driver.tick(41.0)
    assert len(sent) == 4, "the robot's own navigation drives"


def test_no_zero_before_the_first_command_and_while_commands_come(driver, sent):
    driver.tick(5.0)
    for k in range(20):
        now = 5.0 + 0.25 * k
        driver.take(twist(0.2, stamp_s=now), now)
        driver.tick(now + WATCHDOG_S - 0.01)
    assert set(sent) == {(0.2, 0.0)}


def test_a_command_that_was_overtaken_is_dropped_and_a_reset_clock_is_not(driver, sent):
    driver.take(twist(0.2, stamp_s=5.0), 0.0)
    driver.take(twist(0.4, stamp_s=4.9), 0.01)
    driver.take(twist(0.1, stamp_s=1.0), 0.02)
    assert sent == [(0.2, 0.0), (0.1, 0.0)]


def test_a_refused_command_does_not_keep_the_robot_moving(driver, sent, caplog):
    caplog.set_level(logging.WARNING)
    driver.take(twist(0.3), 0.0)
    for tick in range(1, 20):
        driver.take(b"nonsense", 0.02 * tick)
        driver.take(twist(math.nan), 0.02 * tick)
        driver.tick(0.02 * tick)
    assert sent[0] == (0.3, 0.0)
    assert sent[-1] == (0.0, 0.0)
    assert driver.refused == 38
    assert caplog.text.count("refused") == 1


def test_stop_sends_zero_at_once(driver, sent):
    driver.take(twist(0.3), 0.0)
    driver.stop()
    assert sent[-1] == (0.0, 0.0)
    driver.tick(0.1)
    assert len(sent) == 2


def test_commands_that_arrive_after_the_stop_are_not_followed(driver, sent):
    driver.take(twist(0.3), 0.0)
    driver.stop()
    driver.take(twist(0.3, stamp_s=1.1), 0.03)
    driver.tick(0.5)
    assert sent == [(0.3, 0.0), (0.0, 0.0)]


def test_a_command_that_answers_an_old_image_stops_the_robot(driver, sent, caplog):
    caplog.set_level(logging.INFO)
    driver.saw_image(100.0, 7.0)
    driver.take(twist(0.3, stamp_s=99.8), 7.1)
    driver.take(twist(0.3, stamp_s=99.8), 7.9)
    driver.saw_image(101.0, 8.0)
    driver.take(twist(0.4, stamp_s=99.9), 8.1)
    driver.take(twist(0.4, stamp_s=100.9), 8.2)
    assert sent == [(0.3, 0.0), (0.0, 0.0), (0.0, 0.0), (0.4, 0.0)]
    assert caplog.text.count("answer images that are 1.1 s old") == 1
    assert caplog.text.count("in time again") == 1


def test_a_command_without_a_stamp_and_one_of_another_clock_pass(driver, sent):
    driver.take(twist(0.1, stamp_s=5.0), 1.0)
    driver.saw_image(100.0, 7.0)
    driver.take(twist(0.2, stamp_s=0.0), 7.5)
    driver.take(twist(0.3, stamp_s=5000.0), 7.5)
    assert [linear for linear, _ in sent] == [0.1, 0.2, 0.3]
