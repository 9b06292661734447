"""Colour and depth of a robot's camera, thinned: what is carried belongs together."""

import math

import numpy as np
import pytest

from app.messages.motion import StampedTwist, encode_twist
from app.ros2.ippon_ros2 import rates
from app.ros2.ippon_ros2.rates import PairedRates, RateLimit, TiltSteps
from app.ros2.ippon_ros2.serialized import stamp_of


def stamped(stamp_s):
    """Return a message of which only the stamp matters."""
    stamp_ns = round(1e9 * stamp_s)
    return encode_twist(StampedTwist(stamp_ns=stamp_ns, linear_m_s=0.0, yaw_rate_rad_s=0.0))


def carried(limits, colors, depths, *, color_delay_s=0.0, depth_delay_s=0.0):
    """Return the stamps of the images that are carried, given those that are taken."""
    arrivals = sorted(
        [(s + color_delay_s, 0, s) for s in colors] + [(s + depth_delay_s, 1, s) for s in depths]
    )
    came = [], []
    for _, is_depth, stamp in arrivals:
        if is_depth:
            came[1].extend(limits.depth(stamped(stamp)))
        else:
            passes, waited = limits.color(stamped(stamp))
            if passes:
                came[0].append(stamped(stamp))
            came[1].extend(waited)
    return tuple(np.array([stamp_of(p) for p in of]) for of in came)


def paired(colors, depths, within_s=rates.PAIRED_S):
    """Return the share of colour images with a depth image of their time."""
    return np.mean([np.abs(depths - c).min(initial=math.inf) <= within_s + 1e-6 for c in colors])


def test_the_rate_limit_keeps_messages_of_the_same_stamps():
    payloads = [stamped(k / 30.0) for k in range(90)]
    one, other = RateLimit(10.0), RateLimit(10.0)
    kept = [one.passes(p) for p in payloads]
    assert kept == [other.passes(p) for p in payloads]
    assert math.isclose(sum(kept), 30, abs_tol=1)
    assert all(RateLimit(0.0).passes(p) for p in payloads)
    assert RateLimit(1.0).passes(b"cut")


@pytest.mark.parametrize("order", [(0.0, 0.0), (0.03, 0.0), (0.0, 0.05)])
@pytest.mark.parametrize("late_s", [-0.012, 0.005, 0.016])
@pytest.mark.parametrize(("camera_hz", "max_hz"), [(30.0, 10.0), (30.0, 7.0), (15.0, 5.0)])
def test_each_carried_colour_image_has_its_depth_at_every_phase(camera_hz, max_hz, late_s, order):
    for phase in np.linspace(0.0, 1.0 / max_hz, 23):
        colors = 100.0 + phase + np.arange(90) / camera_hz
        depths = colors + late_s
        limits = PairedRates(max_hz, max_hz)
        color, depth = carried(
            limits, colors, depths, color_delay_s=order[0], depth_delay_s=order[1]
        )
        assert paired(color[:-1], depth) == 1.0
        assert len(depth) <= len(color) + 1  # One may come before the first colour image.
        assert len(color) == pytest.approx(max_hz * 90 / camera_hz, abs=1.5)


def test_the_nearest_depth_image_is_taken():
    colors = 50.0 + np.arange(240) / 60.0
    color, depth = carried(PairedRates(10.0, 10.0), colors, colors + 0.005, depth_delay_s=0.02)
    # The one before lies within the tolerance, too. At first the spacing is unknown.
    assert paired(color[:-1], depth, within_s=0.0051) == 1.0


def test_each_limit_holds():
    colors = 10.0 + np.arange(300) / 30.0
    color, depth = carried(PairedRates(10.0, 5.0), colors, colors + 0.005)
    assert (len(color), len(depth)) == (pytest.approx(100, abs=1), pytest.approx(50, abs=1))
    assert paired(depth, color) == 1.0
    color, depth = carried(PairedRates(0.0, 5.0), colors, colors + 0.005)
    assert (len(color), len(depth)) == (300, pytest.approx(50, abs=1))
    color, depth = carried(PairedRates(5.0, 0.0), colors, colors + 0.005)
    assert (len(color), len(depth)) == (pytest.approx(50, abs=1), 300)


def test_depth_without_colour_is_thinned_by_itself():
    depths = 10.0 + np.arange(90) / 30.0
    _, depth = carried(PairedRates(10.0, 10.0), [], depths)
    assert len(depth) == pytest.approx(30, abs=1)
    # Colour ends after a second.
    _, depth = carried(PairedRates(10.0, 10.0), depths[:30], depths)
    assert depth[-1] > 12.8


def test_a_clock_that_begins_again_and_a_cut_message():
    limits = PairedRates(10.0, 10.0)
    for start in (1000.0, 5.0):
        colors = start + np.arange(60) / 30.0
        color, depth = carried(limits, colors, colors + 0.005)
        assert paired(color[:-1], depth) == 1.0
    assert limits.color(b"cut") == (True, [])
    assert limits.depth(b"cut") == [b"cut"]


def test_few_depth_images_are_held():
    limits = PairedRates(10.0, 10.0)
    limits.color(stamped(1.0))
    for k in range(100):
        limits.depth(stamped(1.1 + 0.005 * k))
    assert len(limits._held) == rates.MOST_HELD


def test_a_tilt_is_sent_when_it_changes_and_again_in_case_it_was_lost():
    steps = TiltSteps()
    sent = [k for k in range(60) if steps.is_due(-0.3, 0.05 * k)]
    assert sent == [0, 20, 40]
    assert steps.is_due(-0.2, 3.0)
    assert not steps.is_due(-0.205, 3.05)
    assert steps.is_due(-0.215, 3.1)
