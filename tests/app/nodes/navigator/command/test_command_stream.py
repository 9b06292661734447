import queue
import time

import pytest

from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.motion import (
    StampedTwist,
    decode_number,
    decode_twist,
    encode_number,
    encode_twist,
)
from app.nodes.navigator.command.command_stream import CommandStream
from app.nodes.navigator.config import NavigatorConfig
from ippon.command import Command

DRIVE = Command(linear_m_s=0.5, yaw_rate_rad_s=0.2, tilt_rad=-0.3)
PATIENCE_S = 20.0
END = StampedTwist(stamp_ns=10**18, linear_m_s=0.0, yaw_rate_rad_s=0.0)


class Heard:
    """What reaches the robot, in order: ("twist" | "tilt", value)."""

    def __init__(self, navigator, messages):
        self._navigator, self._messages = navigator, messages

    def since(self, wait_s=0.3):
        """All since the last call that is sent within so long, however late it comes."""
        time.sleep(wait_s)
        # It goes after all that was sent before it.
        self._navigator.put(f"r/{keys.CMD_VEL}", encode_twist(END))
        found = []
        while (message := self._messages.get(timeout=PATIENCE_S)) != ("twist", END):
            found.append(message)
        return found

    def until_zero(self):
        """All twists up to the first that stands."""
        found = []
        while not found or found[-1].linear_m_s:
            kind, value = self._messages.get(timeout=PATIENCE_S)
            if kind == "twist":
                found.append(value)
        return found

    def twists(self):
        return [value for kind, value in self.since() if kind == "twist"]


@pytest.fixture
def heard(sessions):
    navigator, robot = sessions
    messages = queue.SimpleQueue()
    subscribe(robot, f"r/{keys.CMD_VEL}", lambda p: messages.put(("twist", decode_twist(p))))
    subscribe(robot, f"r/{keys.CMD_TILT}", lambda p: messages.put(("tilt", decode_number(p))))
    wanted = {"twist", "tilt"}
    nothing = StampedTwist(stamp_ns=0, linear_m_s=0.0, yaw_rate_rad_s=0.0)
    probes = {keys.CMD_VEL: encode_twist(nothing), keys.CMD_TILT: encode_number(0.0)}
    give_up = time.monotonic() + PATIENCE_S
    while wanted and time.monotonic() < give_up:
        # What is said before a subscription has come through is lost.
        for key, payload in probes.items():
            navigator.put(f"r/{key}", payload)
        time.sleep(0.05)
        while not messages.empty():
            wanted -= {messages.get()[0]}
    assert not wanted
    heard = Heard(navigator, messages)
    heard.since()
    return heard


@pytest.fixture
def stream(sessions, heard):
    """No command of it gets stale within a test, however busy the machine is."""
    stream = CommandStream(sessions[0], "r", rate_hz=50.0, stale_s=PATIENCE_S)
    yield stream
    stream.close()


def test_the_tilt_comes_before_the_twist_that_a_robot_in_lock_step_waits_for(stream, heard):
    for k in range(20):
        stream.give(Command(linear_m_s=0.1, tilt_rad=0.01 * k), stamp_ns=k)
    tilt, at_stamp = None, {}
    for kind, value in heard.since():
        if kind == "tilt":
            tilt = value
        else:
            at_stamp.setdefault(value.stamp_ns, tilt)
    assert at_stamp == {k: 0.01 * k for k in range(20)}


def test_a_command_is_repeated_while_fresh_and_then_zero(sessions, heard):
    stream = CommandStream(sessions[0], "r", rate_hz=50.0, stale_s=1.0)
    stream.give(DRIVE, stamp_ns=7)
    sent = heard.until_zero()
    after = heard.twists()
    stream.close()
    assert after == []
    assert len(sent) > 5
    assert {(t.linear_m_s, t.yaw_rate_rad_s, t.stamp_ns) for t in sent[:-1]} == {(0.5, 0.2, 7)}
    assert (sent[-1].linear_m_s, sent[-1].yaw_rate_rad_s) == (0.0, 0.0)


def test_the_stream_says_something_more_often_than_every_50_ms(sessions, heard, monkeypatch):
    stream = CommandStream(sessions[0], "r", rate_hz=NavigatorConfig().command_hz, stale_s=10.0)
    wait, late_s = stream._closed.wait, []

    def wait_and_note(period_s):
        began = time.monotonic()
        ended = wait(period_s)
        late_s.append(time.monotonic() - began - period_s)
        return ended

    monkeypatch.setattr(stream._closed, "wait", wait_and_note)
    stream.give(DRIVE, stamp_ns=1)
    time.sleep(2.0)
    stream.close()
    sent = [kind for kind, _ in heard.since(wait_s=0.0)]
    # Time in which the machine ran something else, though the stream was to go on.
    busy_s = sum(late_s)
    assert sent.count("twist") >= 20.0 * (2.0 - busy_s) + 1, "on the average"
    assert sent.count("tilt") == sent.count("twist") - 1, "the last one is the zero of the end"


def test_stop_is_at_once_and_holds_whatever_is_given(stream, heard):
    stream.give(DRIVE, stamp_ns=1)
    assert stream.sent == DRIVE
    stream.halt()
    assert stream.sent == Command(tilt_rad=DRIVE.tilt_rad)
    sent = []
    for k in range(5):
        stream.give(DRIVE, stamp_ns=2 + k)
    sent = heard.twists()
    first_zero = next(k for k, t in enumerate(sent) if t.linear_m_s == 0.0)
    assert all(t.linear_m_s == 0.0 and t.yaw_rate_rad_s == 0.0 for t in sent[first_zero:])
    assert sent[-1].stamp_ns == 6, "a robot in lock-step is answered also while it is stopped"
    assert stream.release(if_count=stream.halts)
    stream.give(DRIVE, stamp_ns=9)
    assert any(t.linear_m_s == 0.5 for t in heard.twists())


def test_a_hold_waits_for_no_thread_that_sends(stream, heard):
    stream.give(DRIVE, stamp_ns=1)
    with stream._lock:  # As while the network does not take a command.
        stream.hold()
    heard.since()
    stream.give(DRIVE, stamp_ns=2)
    assert not any(t.linear_m_s for t in heard.twists())


def test_a_release_that_was_asked_for_before_a_halt_does_not_undo_it(stream, heard):
    stream.halt()
    asked_at = stream.halts
    stream.halt()
    assert not stream.release(if_count=asked_at)
    stream.give(DRIVE, stamp_ns=1)
    assert not any(t.linear_m_s for t in heard.twists())
    assert stream.release(if_count=stream.halts)


def test_a_release_does_not_undo_a_hold_whose_halt_is_still_to_come(stream, heard):
    stream.halt()
    asked_at = stream.halts
    stream.hold()
    assert not stream.release(if_count=asked_at)
    stream.give(DRIVE, stamp_ns=1)
    assert not any(t.linear_m_s for t in heard.twists())
    stream.halt()
    assert stream.release(if_count=stream.halts), "each hold ends with its halt"
    stream.give(DRIVE, stamp_ns=2)
    assert any(t.linear_m_s for t in heard.twists())


def test_nothing_moves_by_itself_after_a_release(stream, heard):
    stream.give(DRIVE, stamp_ns=1)
    stream.halt()
    heard.since()
    assert stream.release(if_count=stream.halts)
    assert not any(t.linear_m_s for t in heard.twists())


def test_a_dropped_command_is_not_repeated(stream, heard):
    stream.give(DRIVE, stamp_ns=1)
    stream.drop()
    sent = heard.twists()
    assert sent[-1].linear_m_s == 0.0
    assert not any(t.linear_m_s for t in heard.twists())


def test_the_last_word_is_zero(sessions, heard):
    stream = CommandStream(sessions[0], "r", rate_hz=50.0, stale_s=10.0)
    stream.give(DRIVE, stamp_ns=1)
    stream.close()
    assert heard.twists()[-1].linear_m_s == 0.0
