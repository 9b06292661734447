import pytest

from app.links.robot_streams.depth_match import WINDOW, DepthMatch

PERIOD_NS = 33_000_000


def feed(match, count, *, every=1, off_ns=0, first=0):
    for k in range(first, first + count):
        match.add_color(k * PERIOD_NS)
        if k % every == 0:
            match.add_depth(k * PERIOD_NS + off_ns)


@pytest.mark.parametrize(("every", "off_ns", "alone"), [(2, 0, 25), (1, 25_000_000, 50)])
def test_images_without_depth_are_counted_until_depth_keeps_up(every, off_ns, alone):
    match = DepthMatch(0.02 if every > 1 else 0.002)
    feed(match, WINDOW - 1, every=every, off_ns=off_ns)
    assert match.problem() == "", "too few to tell"
    feed(match, WINDOW + 1, every=every, off_ns=off_ns, first=WINDOW - 1)
    assert match.problem().startswith(f"{alone} of the last {WINDOW} colour images have no depth")
    feed(match, WINDOW, first=2 * WINDOW)
    assert match.problem() == ""


def test_depth_that_comes_later_or_earlier_or_more_often_is_that_of_its_image():
    match = DepthMatch(0.02)
    for k in range(2 * WINDOW):
        match.add_depth((k + 20) * PERIOD_NS // 2)
        match.add_color(k * PERIOD_NS // 2)
    assert match.problem() == ""
    match = DepthMatch(0.02)
    for k in range(2 * WINDOW):
        match.add_color(k * PERIOD_NS)
        match.add_depth((k - 9) * PERIOD_NS)
    assert match.problem() == "", "nine of fifty are on their way"


def test_a_clock_that_is_set_back_begins_anew_and_silence_of_depth_is_not_counted():
    match = DepthMatch(0.02)
    feed(match, WINDOW, every=2, first=1000)
    feed(match, 10)
    assert match.problem() == ""
    silent = DepthMatch(0.02)
    for k in range(WINDOW):
        silent.add_color(k * PERIOD_NS)
    assert silent.problem() == ""
