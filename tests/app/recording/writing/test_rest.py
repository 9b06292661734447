"""When a robot rests: it stands, and searches for nothing."""

import msgspec
import pytest

from app.messages.motion import robot_transforms
from app.messages.recording import RecordingGap
from app.messages.status import Event
from app.recording.timeline import Transforms
from app.recording.writing.rest import RestWatch
from ippon.geometry import base_pose
from ippon.robot import ZED


def _transforms(x_m=0.0, yaw_rad=0.0, tilt_rad=-0.3):
    T_world_base = base_pose(x_m, 0.5, 0.0, yaw_rad)
    transforms = robot_transforms(0, T_world_base, ZED.T_base_camera(tilt_rad))
    return Transforms(tuple(transforms), are_fixed=False)


@pytest.fixture
def status(made_up):
    """The status of a robot that searches for nothing."""
    return msgspec.structs.replace(made_up.status_of(0), state="exhausted")


def _stand(watch, status, from_s, until_s):
    for tick in range(round(10 * from_s), round(10 * until_s)):
        watch.note(_transforms(), tick / 10)
        watch.note(status, tick / 10)


@pytest.fixture
def watch(status):
    """A robot that has stood for ten seconds."""
    watch = RestWatch()
    _stand(watch, status, 0.0, 10.0)
    return watch


def test_a_robot_that_stands_and_searches_for_nothing_rests_after_a_while(status):
    watch = RestWatch()
    _stand(watch, status, 0.0, 4.9)
    assert not watch.is_at_rest(4.9)
    _stand(watch, status, 4.9, 6.0)
    assert watch.is_at_rest(6.0)


@pytest.mark.parametrize(
    "moved", [{"x_m": 0.03}, {"yaw_rad": 0.03}, {"tilt_rad": -0.27}], ids=["x", "yaw", "tilt"]
)
def test_motion_of_base_or_camera_ends_the_rest_for_a_while(watch, status, moved):
    watch.note(_transforms(**moved), 10.0)
    assert not watch.is_at_rest(10.0)
    for tick in range(10, 16):
        watch.note(_transforms(**moved), tick)
        watch.note(status, tick)
        assert watch.is_at_rest(tick) is (tick == 15)


def test_jitter_is_no_motion_and_slow_motion_is(watch):
    watch.note(_transforms(x_m=0.01, yaw_rad=0.01), 10.0)
    assert watch.is_at_rest(10.0)
    watch.note(_transforms(x_m=0.021), 10.0)
    assert not watch.is_at_rest(10.0)


@pytest.mark.parametrize("state", ["searching", "looking_around", "approaching", "manual"])
def test_a_search_ends_the_rest_at_once(watch, status, state):
    watch.note(msgspec.structs.replace(status, state=state), 10.0)
    assert not watch.is_at_rest(10.0)


def test_an_event_ends_the_rest_for_a_while(watch):
    watch.note(Event(stamp_ns=0, kind="contact", text="contact"), 10.0)
    assert not watch.is_at_rest(10.0)


def test_a_robot_that_is_not_heard_or_has_no_pose_does_not_rest(watch, status):
    assert watch.is_at_rest(11.0)
    assert not watch.is_at_rest(12.0)
    watch.note(status, 13.0)
    assert not watch.is_at_rest(13.0)
    poseless = RestWatch()
    for tick in range(200):
        poseless.note(status, tick / 10)
    assert not poseless.is_at_rest(20.0)
    assert not RestWatch().is_at_rest(20.0)


def test_after_a_gap_nothing_is_thinned_for_a_while(watch):
    watch.note(RecordingGap(), 10.0)
    assert not watch.is_at_rest(10.0)
