"""A budget in seconds: when it has passed, and what that leaves open."""

import math

import pytest

from ippon.planning.deadline import UNLIMITED, Deadline


class Clock:
    """Stands still, or goes on by `jump_s` whenever it is read."""

    def __init__(self, jump_s=0.0):
        self.now_s = 100.0
        self.jump_s = jump_s

    def __call__(self):
        self.now_s += self.jump_s
        return self.now_s


def test_it_passes_when_the_seconds_are_used_up():
    clock = Clock()
    deadline = Deadline(0.5, clock)
    clock.now_s += 0.49
    assert not deadline.passed()
    assert not deadline.cut_short
    clock.now_s += 0.02
    assert not deadline.cut_short, "nobody had anything left to do"
    assert deadline.passed()
    assert deadline.cut_short


def test_a_share_passes_earlier_and_what_it_cuts_short_cuts_short_the_whole():
    clock = Clock()
    deadline = Deadline(1.0, clock)
    clock.now_s += 0.3
    part = deadline.share(0.6)
    assert not part.passed()
    clock.now_s += 0.31
    assert part.passed()
    assert part.cut_short
    assert deadline.cut_short
    assert not deadline.passed()


def test_what_the_whole_cuts_short_says_nothing_of_a_share():
    clock = Clock()
    deadline = Deadline(1.0, clock)
    part = deadline.share(0.6)
    clock.now_s += 2.0
    assert deadline.passed()
    assert not part.cut_short


def test_without_a_budget_no_clock_is_read():
    def forbidden():
        raise AssertionError

    for deadline in (UNLIMITED, Deadline(), Deadline(math.inf, forbidden), UNLIMITED.share(0.1)):
        assert not deadline.passed()
        assert not deadline.cut_short


def test_a_budget_without_a_clock_is_refused():
    with pytest.raises(ValueError, match=r"needs a clock .*: pass clock=time\.monotonic"):
        Deadline(0.04)
