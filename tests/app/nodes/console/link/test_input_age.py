"""How late the input of a page arrives."""

import pytest

from app.nodes.console.link.input_age import LATE_S, InputAge


def test_input_on_an_uplink_that_queues_is_late_though_it_comes_at_its_rate():
    age = InputAge()
    taken = [age.late_s(50.0 * n, 100.0 + 0.05 * n + 0.1 * max(0, n - 20)) for n in range(40)]
    assert taken[:20] == pytest.approx([0.0] * 20)
    assert taken[24] < LATE_S < taken[27]


def test_a_clock_that_stood_still_is_set_right_by_the_next_short_round_trip():
    age = InputAge()
    assert age.late_s(0.0, 100.0) == 0.0
    assert age.late_s(1000.0, 104.0) == pytest.approx(3.0), "asleep for three seconds"
    age.ping(2000.0, None, 105.0)
    assert age.late_s(2500.0, 105.5) == pytest.approx(3.0)
    age.ping(4000.0, 20.0, 107.0)
    assert age.late_s(4050.0, 107.05) == pytest.approx(0.0)


def test_on_a_line_with_a_long_round_trip_the_clock_is_set_right_as_well():
    age = InputAge()
    age.ping(0.0, None, 100.0)
    age.ping(2000.0, 650.0, 102.0)
    age.ping(4000.0, 640.0, 107.0)
    assert age.late_s(4500.0, 107.5) == pytest.approx(3.0), "asleep for three seconds"
    age.ping(6000.0, 660.0, 109.0)
    assert age.late_s(6500.0, 109.5) == pytest.approx(0.0)


def test_a_long_round_trip_shows_nothing_of_the_clock():
    age = InputAge()
    assert age.late_s(0.0, 100.0) == 0.0
    age.ping(1000.0, None, 101.0)
    age.ping(2000.0, 20.0, 105.0)
    age.ping(4000.0, 3010.0, 107.0)
    assert age.late_s(4050.0, 107.05) == pytest.approx(3.0)
