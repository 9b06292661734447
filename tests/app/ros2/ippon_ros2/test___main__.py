"""What the bridge does without ROS 2: reading its profile, and its watchdog."""

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
