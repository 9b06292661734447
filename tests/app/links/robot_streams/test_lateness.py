import pytest

from app.links.robot_streams.lateness import WINDOW_S, Lateness


def feed(lateness, stamps, delay_s, rate=1.0):
    for k in stamps:
        lateness.add(round(0.2 * k * 1e9), 1000.0 + 0.2 * k / rate + delay_s)


def test_images_that_a_network_queues_are_late_until_it_is_forgotten():
    lateness = Lateness()
    assert lateness.late_s() == 0.0
    feed(lateness, range(1, 50), 0.1)
    assert lateness.late_s() == 0.0
    feed(lateness, range(50, 70), 2.4)
    assert lateness.late_s() == pytest.approx(2.3)
    feed(lateness, range(70, 90), 0.3)
    assert lateness.late_s() == 0.0
    feed(lateness, range(90, 90 + round(4 * WINDOW_S)), 2.4)
    assert lateness.late_s() > 2.0
    feed(lateness, range(90 + round(4 * WINDOW_S), 110 + round(5 * WINDOW_S)), 2.4)
    assert lateness.late_s() == 0.0, "that is its delay now"


def test_a_slow_simulation_and_a_clock_that_is_set_are_not_late():
    slow = Lateness()
    feed(slow, range(1, 100), 0.0, rate=0.5)
    assert slow.late_s() == 0.0
    clock = Lateness()
    feed(clock, range(100, 200), 0.0)
    feed(clock, range(50, 80), 30.0)
    assert clock.late_s() == 0.0
