import pytest

from app.view.camera.stream_budget import BIT_S, LADDER, StreamBudget


def _stream(budget, source_hz, size_of, seconds=20.0, link_bit_s=1e9):
    """Play a stream over a link; return time, size and trip of each picture."""
    sent, now = [], 0.0
    free_s = 0.0
    while now < seconds:
        now += max(1.0 / source_hz, budget.wait_s(now))
        size = size_of(budget.rung)
        while budget.is_too_large(size):
            size = size_of(budget.rung)
        budget.sent(now, size)
        free_s = max(free_s, now) + 8.0 * size / link_bit_s
        sent.append((now, size, free_s - now))
        budget.acknowledged(free_s - now)
    return sent


def _jpeg_size(bits_per_pixel):
    """About what a JPEG of 4:3 takes by size and quality."""
    return lambda rung: int(
        0.75 * rung.longest_px**2 * bits_per_pixel * (rung.quality / 80) ** 1.5 / 8
    )


@pytest.mark.parametrize("bits_per_pixel", [0.5, 1.2, 4.0, 12.0])
def test_ten_pictures_a_second_fit_two_megabits_whatever_the_scene(bits_per_pixel):
    sent = _stream(StreamBudget(), 30.0, _jpeg_size(bits_per_pixel))
    settled = [(at, size) for at, size, _ in sent if at > 5.0]
    bits = 8 * sum(size for _, size in settled) / 15.0
    assert bits <= BIT_S * 1.02 < 2e6
    assert len(settled) / 15.0 >= 9.5, "the rate stays; the size gives way"


def test_a_simple_scene_is_shown_larger_than_a_complex_one():
    simple, complex_ = StreamBudget(), StreamBudget()
    _stream(simple, 30.0, _jpeg_size(0.5))
    _stream(complex_, 30.0, _jpeg_size(6.0))
    assert simple.rung.longest_px > complex_.rung.longest_px


def test_a_slow_link_lowers_the_rate_and_a_good_one_raises_it_again():
    budget = StreamBudget()
    sent = _stream(budget, 30.0, _jpeg_size(1.2), link_bit_s=4e5)
    assert max(trip for at, _, trip in sent if at > 5.0) < 0.6, "no backlog"
    assert sum(at > 10.0 for at, _, _ in sent) > 80, "still nearly ten a second"
    assert budget.allowed_bit_s < 6e5
    _stream(budget, 30.0, _jpeg_size(1.2), seconds=40.0)
    assert budget.allowed_bit_s == pytest.approx(BIT_S)


def test_a_camera_of_two_hertz_is_neither_delayed_nor_sent_twice():
    budget = StreamBudget()
    sent = _stream(budget, 2.0, _jpeg_size(1.2))
    assert len(sent) == 40
    assert budget.wait_s(sent[-1][0] + 0.5) == 0.0


def test_no_picture_is_below_the_ladder():
    budget = StreamBudget()
    for n in range(100):
        budget.sent(0.1 * n, 10**7)
    assert budget.rung == LADDER[0]
    assert not budget.is_too_large(10**7)


def test_refuses_limits_without_meaning():
    with pytest.raises(ValueError, match=r"at least 100000 bit/s and a positive rate; got 5 bit/s"):
        StreamBudget(5.0)
    with pytest.raises(ValueError, match=r"got 1.8e\+06 bit/s and 0 Hz"):
        StreamBudget(hz=0.0)
