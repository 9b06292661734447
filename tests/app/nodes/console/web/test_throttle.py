"""Limit on password guesses."""

import pytest

from app.nodes.console.web.throttle import FORGOTTEN_S, FREE, LONGEST_WAIT_S, MAX_KEYS, Throttle


@pytest.fixture
def throttle():
    return Throttle()


def fail(throttle, times, now=0.0, name="anna", address="10.0.0.1"):
    for _ in range(times):
        throttle.failed(address, name, now)


def test_five_mistakes_are_free_and_each_further_one_doubles_the_wait(throttle):
    fail(throttle, FREE - 1)
    assert throttle.wait_s("10.0.0.1", "anna", 0.0) == 0.0
    waits = []
    for _ in range(4):
        fail(throttle, 1)
        waits.append(throttle.wait_s("10.0.0.1", "anna", 0.0))
    assert waits == [2.0, 4.0, 8.0, 16.0]
    assert throttle.wait_s("10.0.0.1", "anna", 15.0) == 1.0
    assert throttle.wait_s("10.0.0.1", "anna", 16.0) == 0.0


def test_the_wait_has_a_bound(throttle):
    fail(throttle, 100)
    assert throttle.wait_s("10.0.0.1", "anna", 0.0) == LONGEST_WAIT_S


def test_another_address_is_not_locked_out(throttle):
    fail(throttle, 50)
    assert throttle.wait_s("10.0.0.2", "anna", 0.0) == 0.0


def test_one_address_cannot_go_through_many_names(throttle):
    for number in range(4 * FREE):
        fail(throttle, 1, name=f"user{number}")
    assert throttle.wait_s("10.0.0.1", "new", 0.0) > 0.0


def test_the_right_password_forgives(throttle):
    fail(throttle, FREE)
    throttle.succeeded(throttle.failed("10.0.0.1", "anna", 0.0))
    assert throttle.wait_s("10.0.0.1", "anna", 0.0) == 0.0


def test_logins_are_no_failures_of_their_address(throttle):
    for number in range(10 * FREE):
        throttle.succeeded(throttle.failed("10.0.0.1", f"user{number}", 60.0 * number))
    assert throttle.wait_s("10.0.0.1", "new", 600.0 * FREE) == 0.0
    assert throttle._failures == {}


def test_a_login_takes_back_no_failure_of_another_name(throttle):
    for number in range(4 * FREE):
        fail(throttle, 1, name=f"user{number}")
        throttle.succeeded(throttle.failed("10.0.0.1", "anna", 0.0))
    assert throttle.wait_s("10.0.0.1", "new", 0.0) == 2.0
    # Logins neither lengthen the wait, nor keep old failures from being forgotten.
    throttle.succeeded(throttle.failed("10.0.0.1", "anna", 2.0))
    assert throttle.wait_s("10.0.0.1", "new", 2.0) == 0.0
    fail(throttle, 1, now=FORGOTTEN_S + 1.0)
    assert throttle.wait_s("10.0.0.1", "new", FORGOTTEN_S + 1.0) == 0.0


def test_a_failure_during_a_login_counts_from_its_own_time(throttle):
    fail(throttle, 4 * FREE)
    login = throttle.failed("10.0.0.1", "anna", 100.0)
    fail(throttle, 1, now=101.0, name="bert")
    throttle.succeeded(login)
    assert throttle.wait_s("10.0.0.1", "new", 101.0) == 4.0


def test_old_mistakes_are_forgotten(throttle):
    fail(throttle, 50)
    fail(throttle, 1, now=FORGOTTEN_S + 1.0)
    assert throttle.wait_s("10.0.0.1", "anna", FORGOTTEN_S + 1.0) == 0.0


def test_memory_is_bounded(throttle):
    for number in range(MAX_KEYS):
        throttle.failed(f"address {number}", "anna", 0.0)
    assert len(throttle._failures) <= MAX_KEYS
