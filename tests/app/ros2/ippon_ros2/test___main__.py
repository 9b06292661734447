"""What the bridge does without ROS 2: reading its profile, and its watchdog."""

import importlib
import sys
from types import ModuleType
from unittest import mock

import pytest

from app.ros2.ippon_ros2.__main__ import StopFlag, _read_profile, _watch
from app.ros2.ippon_ros2.settings import Ros2Error

LAUGHS = "a: &a [x, x]\nb: &b [*a, *a]\nros2: [*b, *b]\n"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (LAUGHS, "aliases .* are not read"),
        ("[" * 600 + "]" * 600, "nested too deeply"),
        ("motion: [", "while parsing"),
        ("- 1", "holds no entries"),
    ],
)
def test_profiles_that_are_none_are_refused(tmp_path, text, reason):
    profile = tmp_path / "scout.yaml"
    profile.write_text(text)
    with pytest.raises(Ros2Error, match=reason):
        _read_profile(profile)


@pytest.mark.parametrize("events", ["rclpy.qos_event", "rclpy.event_handler"])
def test_the_bridge_finds_the_events_of_ros_2_humble_and_of_later_ones(events):
    classes = {
        "rclpy": [],
        events: ["PublisherEventCallbacks", "SubscriptionEventCallbacks"],
        "rclpy.qos": ["DurabilityPolicy", "QoSProfile", "ReliabilityPolicy"],
    }
    stubs = {name: ModuleType(name) for name in classes}
    for name, module in stubs.items():
        vars(module).update({one: object() for one in classes[name]})
    with mock.patch.dict(sys.modules, stubs):
        for name in ("commands", "streams"):
            importlib.import_module(f"app.ros2.ippon_ros2.{name}")


def test_the_watchdog_goes_on_after_a_message_that_could_not_be_sent(caplog):
    stop, ticks = StopFlag(), []

    class Node:
        def tick(self):
            ticks.append(1)
            if len(ticks) == 5:
                stop.set()
            if len(ticks) < 3:
                raise RuntimeError("no memory")

    _watch(Node(), stop)
    assert len(ticks) == 5
    assert caplog.text.count("the watchdog could not send") == 1
