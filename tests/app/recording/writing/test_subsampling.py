"""What a recording keeps of depth and heatmaps belongs together, however slow the network is."""

import numpy as np
import pytest

from app.messages import keys
from app.messages.motion import StampedTwist, encode_twist
from app.recording.writing import subsampling
from app.recording.writing.subsampling import Arrived, RestSubsampling, SensorSubsampling

SENSOR_HZ = 2.0


def message(key, stamp_s, came_s, size=0):
    """Return a message of which only the stamp matters."""
    stamp_ns = round(1e9 * stamp_s)
    head = encode_twist(StampedTwist(stamp_ns=stamp_ns, linear_m_s=0.0, yaw_rate_rad_s=0.0))
    return Arrived(key, head + bytes(size), round(1e9 * came_s))


def stamps(kept, *of):
    return np.array([subsampling._stamp_of(one) * 1e-9 for one in kept if one.key in of])


def record(arrivals, sensor_hz=SENSOR_HZ):
    """Return what is kept of (time of arrival, key, stamp), with the end of the session."""
    thinning = SensorSubsampling(sensor_hz)
    kept = [
        one
        for came_s, key, stamp_s in sorted(arrivals)
        for one in thinning.take(message(key, stamp_s, came_s))
    ]
    return kept + thinning.drain()


def camera(seconds=20.0, phase=0.0, late_s=0.005, start=100.0):
    """Return stamps of colour images at 30 Hz, and the arrivals of their depth images."""
    colors = start + phase + np.arange(round(30 * seconds)) / 30.0
    return colors, [(c + late_s + 0.01, keys.DEPTH, c + late_s) for c in colors]


@pytest.mark.parametrize("network_hz", [30, 10, 5, 3, 1])
@pytest.mark.parametrize("delay_s", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("phase", [0.0, 0.016, 0.497])
def test_each_kept_heatmap_has_its_depth_image(network_hz, delay_s, phase):
    colors, depths = camera(phase=phase)
    seen = [(c + delay_s, keys.HEATMAP, c) for c in colors[:: 30 // network_hz]]
    kept = record([*depths, *seen])
    heatmaps, images = stamps(kept, keys.HEATMAP), stamps(kept, keys.DEPTH)
    assert len(heatmaps) == pytest.approx(20 * min(network_hz, SENSOR_HZ), abs=2)
    assert all(np.abs(images - h).min() <= 0.0051 for h in heatmaps)
    # No more is kept than one of each period, or two where a heatmap comes in its middle.
    assert len(heatmaps) <= len(images) <= 20 * SENSOR_HZ + 4


def test_without_a_network_the_first_of_each_period_is_kept():
    colors, depths = camera()
    images = stamps(record(depths), keys.DEPTH)
    assert len(images) == 40
    np.testing.assert_allclose(images % 0.5, 0.005, atol=1e-3)
    assert np.abs(images - colors[0]).min() < 0.006


def test_a_message_keeps_the_time_at_which_it_came():
    _, depths = camera(5.0)
    for one in record(depths):
        stamp_s = subsampling._stamp_of(one) * 1e-9
        assert one.wall_ns == pytest.approx(1e9 * (stamp_s + 0.01), abs=1e3)


def test_boxes_and_their_masks_share_a_depth_image():
    colors, depths = camera()
    boxes = [(c + 0.2, keys.BOXES, c) for c in colors[::10]]
    masks = [(c + 0.21, keys.MASKS_COMPRESSED, c) for c in colors[::10]]
    kept = record([*depths, *boxes, *masks])
    assert len(stamps(kept, keys.BOXES)) == len(stamps(kept, keys.MASKS_COMPRESSED)) == 40
    assert len(stamps(kept, keys.DEPTH)) == pytest.approx(40, abs=2)


def test_a_clock_that_is_set_back_keeps_both_parts():
    _, first = camera(5.0, start=1000.0)
    _, second = camera(5.0, start=10.0)
    thinning = SensorSubsampling(SENSOR_HZ)
    kept = [
        one
        for k, (_, key, stamp_s) in enumerate([*first, *second])
        for one in thinning.take(message(key, stamp_s, 0.03 * k))
    ]
    images = stamps(kept + thinning.drain(), keys.DEPTH)
    assert ((images > 900.0).sum(), (images < 100.0).sum()) == (10, 10)


def test_few_bytes_are_held(monkeypatch):
    monkeypatch.setattr(subsampling, "MOST_HELD_BYTES", 10_000)
    thinning = SensorSubsampling(SENSOR_HZ)
    for k in range(100):
        thinning.take(message(keys.DEPTH, 1.0 + k / 30.0, 0.0, size=1000))
        assert thinning._held_bytes <= 10_000
        assert thinning._held_bytes == sum(
            len(one.message.payload) for held in thinning._held.values() for one in held
        )


def test_without_thinning_and_without_a_stamp_everything_is_kept():
    for sensor_hz, payload in ((0.0, b""), (2.0, b"short")):
        one = Arrived(keys.DEPTH, payload, 1)
        assert SensorSubsampling(sensor_hz).take(one) == [one]
    other = message(keys.COLOR, 1.0, 1.0)
    assert SensorSubsampling(2.0).take(other) == [other]


@pytest.mark.parametrize("network_hz", [30, 3, 1])
@pytest.mark.parametrize("delay_s", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("phase", [0, 7])
def test_each_heatmap_that_is_kept_at_rest_has_its_depth_and_its_colour_image(
    network_hz, delay_s, phase
):
    colors, depths = camera(40.0)
    images = [(c + 0.01, keys.COLOR, c) for c in colors]
    seen = [
        (c + delay_s, keys.HEATMAP, c)
        for c in colors[phase % (30 // network_hz) :: 30 // network_hz]
    ]
    thinning, resting = SensorSubsampling(SENSOR_HZ), RestSubsampling()
    kept = [
        one
        for came_s, key, stamp_s in sorted([*depths, *images, *seen])
        for one in resting.take(thinning.take(message(key, stamp_s, came_s)))
    ]
    heatmaps = stamps(kept, keys.HEATMAP)
    assert len(heatmaps) == 4
    for key, apart_s, least, most in ((keys.DEPTH, 0.006, 4, 9), (keys.COLOR, 1e-6, 40, 45)):
        of_key = stamps(kept, key)
        assert all(np.abs(of_key - h).min() < apart_s for h in heatmaps)
        assert least <= len(of_key) <= most
        assert len(np.unique(of_key)) == len(of_key)


def test_few_bytes_of_colour_images_are_held(monkeypatch):
    monkeypatch.setattr(subsampling, "MOST_HELD_BYTES", 10_000)
    resting = RestSubsampling()
    for k in range(100):
        resting.take([message(keys.COLOR, 1.0 + k / 30.0, 0.0, size=1000)])
        assert sum(len(one.message.payload) for one in resting._colors) <= 10_000
    monkeypatch.undo()
    for k in range(100):
        resting.take([message(keys.COLOR, 10.0 + k / 30.0, 0.0, size=1000)])
        assert len(resting._colors) <= 46
