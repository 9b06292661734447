"""A robot is followed through errors of the link and floods of messages."""

import threading

import pytest

from app.links.network import inbox
from app.messages.scene import encode_voxels
from app.nodes.viewers.live_robot import LiveRobot, clock_ns
from tests.app.nodes.console.drawn_home import status_of
from tests.app.recording.conftest import cloud_of

pytestmark = pytest.mark.process


class Note:
    """A viewer that notes what it is shown."""

    def __init__(self):
        self.links, self.parts, self.taken = [], set(), []

    def take(self, key, payload):
        self.taken.append(key)

    def draw(self, scene, changed):
        self.parts |= changed

    def show_link(self, state, text):
        self.links.append(state)


def test_each_change_of_the_link_is_told_once(start_home, show, wait):
    note = Note()
    with show(note) as robot:
        wait(lambda: note.links == ["waiting"])
        assert clock_ns(robot.model) == 0
        home = start_home()
        wait(lambda: note.links == ["waiting", "live"])
        wait(lambda: {"voxels", "tree", "path", "pose", "camera", "image"} <= note.parts)
        home.close()
        wait(lambda: note.links == ["waiting", "live", "silent"])
    assert clock_ns(robot.model) > 10_000_000_000


def test_a_flood_costs_no_part_of_the_map(start_home, show, wait, monkeypatch, caplog):
    home, note = start_home(), Note()
    with show(note) as robot:
        wait(lambda: robot.model.voxels.count > 0)
        monkeypatch.setattr(inbox, "_LIMIT", 0)
        home.tick()
        wait(lambda: "messages were dropped" in caplog.text)
        home.frozen = True
        monkeypatch.undo()
        count = len(home.keyframe().ooi)
        wait(lambda: robot.model.voxels.count == count)


def test_what_is_missed_while_the_whole_map_is_fetched_is_fetched_again(monkeypatch):
    robot = LiveRobot("tcp/127.0.0.1:9", "ippon")
    robot.model.on_status(status_of())
    monkeypatch.setattr(robot._listener, "check", lambda: None)

    def fetch(missed):
        def query(_):
            robot._listener.openings += missed
            return encode_voxels(cloud_of(20, 1))

        monkeypatch.setattr(robot._listener, "query", query)
        robot._wants_map.set()
        robot._check()
        robot._gaps.are_new()
        robot._read(Note())
        return robot.model.needs_keyframe

    assert fetch(missed=1)
    assert not fetch(missed=0)


def test_an_unexpected_error_of_the_link_ends_it(monkeypatch):
    robot = LiveRobot("tcp/127.0.0.1:9", "ippon")

    def fail():
        raise KeyError("unexpected")

    monkeypatch.setattr(robot._listener, "check", fail)
    with pytest.raises(KeyError, match="unexpected"):
        robot.run(Note(), threading.Event())


def test_a_prefix_that_is_a_pattern_is_refused():
    with pytest.raises(ValueError, match="a robot's key prefix is letters"):
        LiveRobot("tcp/127.0.0.1:9", "**")
