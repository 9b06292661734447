"""Errors of the pose of a frame at 1 m/s and 1 rad/s; `docs/results.md` states them."""

import math

import numpy as np
import pytest

from app.links.robot_streams.transforms import TransformBuffer
from app.messages.motion import StampedTransform
from ippon.geometry import base_pose, invert_transform, yaw_of

TF_HZ = 25.0
RATE = 1.0
TURN = 1.0


def true_pose(t, *, swings):
    """A circle of 1 m at constant speed; or to and fro, 1 m/s and 1 rad/s at most, period 4 s."""
    if not swings:
        return base_pose(math.sin(t), 1.0 - math.cos(t), 0.0, t)
    w = 2.0 * math.pi / 4.0
    yaw = TURN / w * math.sin(w * t)
    return base_pose(RATE / w * math.sin(w * t), 0.0, 0.0, yaw)


def errors(*, swings, skew_s=0.0, jitter_s=0.0, dropped=0.0, swapped=0.0, newest_only=False):
    """Return the largest errors of position (m) and heading (degrees), and frames with a pose."""
    rng, buffer = np.random.default_rng(0), TransformBuffer(history=5000)
    stamps = np.arange(0.0, 40.0, 1.0 / TF_HZ)
    order = list(range(len(stamps)))
    for k in range(len(order) - 1):
        if rng.random() < swapped:
            order[k], order[k + 1] = order[k + 1], order[k]
    sent = [k for k in order if rng.random() >= dropped]
    images = np.arange(2.0, 38.0, 0.203)
    found, wrong_m, wrong_deg, fed = 0, [0.0], [0.0], 0
    for image in images:
        # A frame is assembled when its image has come: with the poses up to then only.
        until = image if newest_only else image + 1.0
        while fed < len(sent) and stamps[sent[fed]] <= until:
            t = stamps[sent[fed]]
            stamp = t + skew_s + jitter_s * rng.standard_normal()
            pose = true_pose(t, swings=swings)
            buffer.add(
                StampedTransform(
                    stamp_ns=round(1e9 * stamp), parent="map", child="base_link",
                    T_parent_child=pose,
                )
            )  # fmt: skip
            fed += 1
        T = buffer.lookup("map", "base_link", round(1e9 * image))
        if T is None:
            continue
        found += 1
        off = invert_transform(true_pose(image, swings=swings)) @ T
        wrong_m.append(float(np.linalg.norm(off[:3, 3])))
        wrong_deg.append(abs(math.degrees(yaw_of(off))))
    return max(wrong_m), max(wrong_deg), found / len(images)


CASES = {
    # name: (changes, most metres, most degrees, least share of frames)
    "nothing wrong": ({}, 0.001, 0.05, 1.0),
    "the newest pose up to 40 ms old": ({"newest_only": True}, 0.006, 0.3, 1.0),
    "clocks 50 ms apart": ({"skew_s": 0.05}, 0.051, 2.9, 1.0),
    "stamps with 10 ms of jitter": ({"jitter_s": 0.01}, 0.035, 2.0, 1.0),
    "a third of the poses dropped": ({"dropped": 0.33}, 0.05, 2.5, 1.0),
    "half of the poses overtaken": ({"swapped": 0.5}, 0.001, 0.05, 1.0),
}


@pytest.mark.parametrize("swings", [False, True], ids=["constant", "to and fro"])
@pytest.mark.parametrize("name", CASES)
def test_the_error_of_a_pose(name, swings):
    changes, most_m, most_deg, least = CASES[name]
    metres, degrees, share = errors(swings=swings, **changes)
    assert metres <= most_m, (metres, degrees)
    assert degrees <= most_deg, (metres, degrees)
    assert share >= least


def test_a_gap_of_more_than_a_second_gives_no_pose():
    buffer = TransformBuffer()
    for t in (0.0, 0.5, 1.6, 2.0):
        buffer.add(
            StampedTransform(
                stamp_ns=round(1e9 * t), parent="map", child="base_link",
                T_parent_child=base_pose(t, 0.0, 0.0, 0.0),
            )
        )  # fmt: skip
    assert buffer.lookup("map", "base_link", 300_000_000)[0, 3] == pytest.approx(0.3)
    assert buffer.lookup("map", "base_link", 1_000_000_000) is None
    assert buffer.lookup("map", "base_link", 2_040_000_000)[0, 3] == pytest.approx(2.04)
