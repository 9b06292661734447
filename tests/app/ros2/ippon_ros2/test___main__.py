"""What the bridge does without ROS 2: reading its profile, and its watchdog."""

import importlib
import sys
from types import ModuleType, SimpleNamespace
from unittest import mock

import pytest

from app.ros2.ippon_ros2 import __main__
from app.ros2.ippon_ros2.__main__ import StopFlag, _check, _read_profile, _watch
from app.ros2.ippon_ros2.settings import Ros2Error, Topic

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


@pytest.fixture
def streams():
    """What `--check` looks at: the streams' module, with a stub for rclpy."""
    classes = {
        "rclpy": [],
        "rclpy.executors": [],
        "rclpy.event_handler": ["SubscriptionEventCallbacks"],
        "rclpy.qos": ["DurabilityPolicy", "QoSProfile", "ReliabilityPolicy"],
    }
    stubs = {name: mock.MagicMock(spec=[*with_these]) for name, with_these in classes.items()}
    stubs["rclpy"].executors = stubs["rclpy.executors"]
    stubs["rclpy.executors"].SingleThreadedExecutor = mock.MagicMock()
    with mock.patch.dict(sys.modules, stubs):
        yield importlib.import_module("app.ros2.ippon_ros2.streams")


def check(monkeypatch, of):
    """Run `--check` at 100 s; return its exit status."""
    monkeypatch.setattr(__main__, "time", SimpleNamespace(monotonic=lambda: 100.0))
    stop = StopFlag()
    stop.set()
    node = SimpleNamespace(streams=SimpleNamespace(of=of), command_topics=list)
    return _check(node, stop)


def test_check_counts_from_the_begin_of_each_subscription(streams, monkeypatch, capsys):
    color = streams.Stream(
        Topic("/color"), type="an image", reliability="reliable", received=30, bytes=3_000_000,
        problem="", since=98.0,
    )  # fmt: skip
    assert check(monkeypatch, {"color": color}) == 0
    assert "/color  an image, reliable, 15.0 Hz, 1.50 MB/s" in capsys.readouterr().out


def test_check_needs_no_tf_of_a_camera_whose_pose_is_tracked(streams, monkeypatch, capsys):
    assert check(monkeypatch, {"tf": streams.Stream(Topic("/tf"))}) == 1
    assert check(monkeypatch, {"tf": streams.Stream(Topic("/tf", is_optional=True))}) == 0
    missing, whole = capsys.readouterr().out.splitlines()
    assert missing.startswith("MISSING tf")
    assert whole.startswith("ok      tf")
    assert "the camera's pose is tracked" in whole


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
