"""A robot that starts anew, in a home that it knows."""

import contextlib
import dataclasses
import functools
import math
import os
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from app.cli.main import run
from app.links.network.registry import running_navigators
from app.links.network.requests import RequestRefusedError, ask, last_message
from app.memory.memory_file import memory_path
from app.memory.room_names import room_names_path
from app.messages import keys
from app.messages.control import ControlReply, ControlRequest, decode
from app.messages.status import Status
from app.nodes.navigator import run as navigator_run
from app.nodes.navigator import stream_conversion
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.localization.alignment import (
    Alignment,
    NoFrameError,
    in_map_frame,
    said_registration,
)
from app.nodes.navigator.state.persistence import RunState, SavedState
from ippon.command import Command
from ippon.geometry import invert_transform, make_transform, rotation_z, yaw_of
from ippon.guidance.language.naming import is_instance_of
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap
from ippon.memory.registration import Registration, RegistrationError
from ippon.mission.config import MissionConfig
from ippon.robot import ZED
from ippon.simulation.robot.mobile_base import camera_of
from ippon.simulation.scene import StartPose
from ippon.simulation.world import SimulatedWorld, WorldConfig
from ippon.vocabulary import MATTERPORT_40
from tests.app.nodes.navigator.test_stream_conversion import FIXED, PERIOD, send
from tests.boxes import boxes_scene

MAP = MapConfig(memory_limit_mb=128.0)
CONFIG = NavigatorConfig(robot="r", mission=MissionConfig(map=MAP))
T_MAP_WORLD = make_transform(rotation_z(0.8), (2.0, -1.0, 0.0))
HOME = [
    ("floor", "floor", (-0.1, -0.1, -0.1), (6.1, 4.1, 0.0)),
    ("wall", "wall", (-0.1, -0.1, 0.0), (0.0, 4.1, 2.5)),
    ("wall", "wall", (6.0, -0.1, 0.0), (6.1, 4.1, 2.5)),
    ("wall", "wall", (0.0, -0.1, 0.0), (6.0, 0.0, 2.5)),
    ("wall", "wall", (0.0, 4.0, 0.0), (6.0, 4.1, 2.5)),
    ("cabinet", "cabinet", (0.0, 3.2, 0.0), (1.5, 4.0, 2.0)),
    ("sofa", "sofa", (4.8, 0.2, 0.0), (5.8, 2.2, 0.7)),
    ("column", "column", (3.8, 2.9, 0.0), (4.3, 3.4, 2.4)),
]


def world_at(x, y, yaw, boxes=HOME):
    scene = boxes_scene(boxes)
    start = StartPose(x=x, y=y, z=0.0, yaw=yaw)
    world = SimulatedWorld(
        scene, ZED, camera_of(ZED, 128), start, 1, WorldConfig.perfect(), is_instance_of
    )
    world.set_labels(MATTERPORT_40, MATTERPORT_40[0])
    return world


class Robot:
    """Takes the place of the frames from the network: a robot with a frame of its own."""

    def __init__(self, world, sent):
        self._world, self._sent = world, sent
        self.arrived_at = 0.0

    def take(self, _):
        self.arrived_at = time.perf_counter()
        self._world.step(self._sent(), 0.2)
        return in_map_frame(self._world.observe(), invert_transform(T_MAP_WORLD))

    def accept(self):
        pass

    def refuse_frame(self, *_):
        pass


@pytest.fixture(scope="module")
def yesterday():
    """The map of the home, from its two ends."""
    voxel_map = VoxelMap(MAP, MATTERPORT_40)
    stamp_ns = 0
    for x, y in ((1.0, 1.0), (3.0, 2.0), (5.0, 3.2)):
        for k in range(8):
            stamp_ns += 100_000_000_000
            frame = world_at(x, y, k * math.pi / 4.0).observe()
            voxel_map.integrate(dataclasses.replace(frame, stamp_ns=stamp_ns))
    return voxel_map


@pytest.fixture
def align(sessions, yesterday):
    def make(world):
        alignment = Alignment(sessions[0], CONFIG, yesterday)
        alignment._intake = Robot(world, lambda: alignment._stream.sent)
        return alignment

    return make


@pytest.mark.slow
def test_a_robot_turns_once_and_finds_its_place(align):
    world = world_at(2.2, 1.6, 0.4)
    found = align(world).run(threading.Event())
    error = T_MAP_WORLD @ invert_transform(found.T_map_world)
    assert np.linalg.norm(error[:3, 3]) < 0.3
    assert abs(math.degrees(yaw_of(error))) < 2.0
    assert found.fitness > 0.9
    assert math.hypot(world.base.x_m - 2.2, world.base.y_m - 1.6) < 0.05, "it turned in place"
    said = said_registration(found)
    assert said.startswith("aligned to the kept map: turned by 4")
    assert "of what is seen fits, with an error of 0.0" in said


@pytest.mark.slow
def test_a_robot_in_another_home_is_told_so(align):
    moved = [HOME[0], *((c, n, np.multiply(a, (0.6, 1.6, 1)), np.multiply(b, (0.6, 1.6, 1)))
                        for c, n, a, b in HOME[1:])]  # fmt: skip
    with pytest.raises(RegistrationError, match=r"fits nowhere in the map|several places"):
        align(world_at(1.6, 2.6, 0.4, moved)).run(threading.Event())


class NoSpace:
    """The collision filter of a body that touches something at every heading."""

    def accelerate(self, command, dt_s, *, brakes_at_once):
        return command

    def avoid_collision(self, command, frame, dt_s, age_s):
        self.age_s = age_s
        return Command(tilt_rad=command.tilt_rad), "no space"


def test_a_robot_without_space_to_turn_says_so(align):
    alignment = align(world_at(2.2, 1.6, 0.4))
    alignment._motion = NoSpace()
    with pytest.raises(RegistrationError, match="no space to turn: it turned by 0 degrees"):
        alignment.run(threading.Event())


def test_the_noise_of_the_pose_is_no_turn(align):
    alignment, frame = align(world_at(2.2, 1.6, 0.4)), world_at(2.2, 1.6, 0.4).observe()

    def turned_after(*headings_deg):
        for heading_deg in headings_deg:
            turn = make_transform(rotation_z(math.radians(heading_deg)), (0.0, 0.0, 0.0))
            seen = dataclasses.replace(frame, T_world_base=frame.T_world_base @ turn)
            alignment._note_turn(seen)
            alignment._last = seen
        return math.degrees(alignment._turned_rad)

    assert abs(turned_after(*[0.2, -0.2] * 60)) < 1.0
    assert len(alignment._views) == 1
    assert turned_after(10.0, 21.0) == pytest.approx(20.8)
    assert len(alignment._views) == 2
    alignment._stream.close()


def test_the_age_of_an_image_counts_in_the_turn(align):
    alignment, motion = align(world_at(2.2, 1.6, 0.4)), NoSpace()
    alignment._motion = motion
    frame = alignment._intake.take(0.0)
    alignment._intake.arrived_at -= 0.4
    alignment._step(frame)
    assert motion.age_s >= 0.4
    alignment._stream.close()


def turns(alignment):
    alignment._step(alignment._intake.take(0.0))
    return alignment._stream.sent.yaw_rate_rad_s


def test_a_stop_of_the_last_run_holds_the_turn_until_resume(sessions, yesterday):
    alignment = Alignment(sessions[0], CONFIG, yesterday, held=True)
    alignment._intake = Robot(world_at(2.2, 1.6, 0.4), lambda: alignment._stream.sent)
    assert [turns(alignment) for _ in range(3)] == [0.0, 0.0, 0.0]
    resume = ControlRequest(action="resume")
    assert ask(sessions[1], f"r/{keys.CONTROL}", resume, ControlReply, 20.0).state == "starting"
    assert turns(alignment) > 0.0
    alignment._stream.close()


def test_a_stop_is_no_lack_of_space_and_the_turn_begins_slowly_after_it(align):
    alignment = align(world_at(2.2, 1.6, 0.4))
    before = [turns(alignment) for _ in range(5)]
    alignment._obey(ControlRequest(action="stop"))
    for _ in range(30):
        assert turns(alignment) == 0.0
    assert alignment._blocked_s == 0.0
    alignment._obey(ControlRequest(action="resume"))
    assert 0.0 < turns(alignment) <= before[1] < before[4]
    alignment._stream.close()


def test_the_turn_ends_while_the_bumper_is_pressed(align):
    alignment = align(world_at(2.2, 1.6, 0.4))
    free = alignment._intake.take
    assert [turns(alignment) for _ in range(3)][-1] > 0.0
    alignment._intake.take = lambda _: dataclasses.replace(free(_), contact=True)
    assert turns(alignment) == 0.0
    with pytest.raises(RegistrationError, match="the bumper is pressed; the robot has turned by"):
        alignment.run(threading.Event(), patience_s=2.0)


def test_its_status_tells_what_it_does_and_whether_it_is_stopped(sessions, yesterday):
    alignment = Alignment(sessions[0], CONFIG, yesterday, held=True)
    for state, why in (("stopped", "press Resume"), ("starting", "find its place in the map")):
        alignment._status_at = 0.0
        alignment._publish_status()
        status = decode(last_message(sessions[1], f"r/{keys.STATUS}", 20.0), Status)
        assert (status.state, status.goal, status.frames) == (state, None, 0)
        assert why in status.why
        assert status.voxel_size_m == MAP.voxel_size_m, "another one would count as another map"
        alignment._obey(ControlRequest(action="resume"))
    alignment._stream.close()


def test_at_the_end_of_the_process_it_ends(align):
    stop = threading.Event()
    stop.set()
    assert align(world_at(2.2, 1.6, 0.4)).run(stop) is None


def test_raw_colour_and_odometry_are_converted_meanwhile(sessions, yesterday, monkeypatch):
    monkeypatch.setattr(stream_conversion, "SILENT_S", 0.3)
    config = dataclasses.replace(CONFIG, profile=FIXED)
    alignment, stop = Alignment(sessions[0], config, yesterday), threading.Event()

    def robot():
        for n in range(1, 150):
            send(sessions[1], n * PERIOD)
            if alignment._last is not None:
                break
            stop.wait(0.1)
        stop.set()

    thread = threading.Thread(target=robot)
    thread.start()
    assert alignment.run(stop) is None
    thread.join()
    assert alignment._last is not None, "a frame came"
    assert alignment._last.T_world_base[:2, 3] == pytest.approx((1.5, 0.5))


@pytest.mark.parametrize(
    ("sends", "lacks"),
    [
        (False, "what is missing: colour, depth, pose"),
        (True, "what is missing: colour, pose; odom: odometry without tf does not tell"),
    ],
)
def test_without_an_image_the_map_stays_as_it_is(
    sends, lacks, sessions, yesterday, monkeypatch, tmp_path
):
    kept = tmp_path / "home.map"
    kept.write_bytes(b"yesterday")
    run = functools.partialmethod(Alignment.run, patience_s=6.0 if sends else 0.1)
    monkeypatch.setattr(Alignment, "run", run)
    monkeypatch.setattr(stream_conversion, "SILENT_S", 60.0)
    config = dataclasses.replace(CONFIG, keep_map=str(kept))
    saved = SavedState(voxel_map=yesterday, requests=())
    stop, alignment = threading.Event(), Alignment(sessions[0], config, yesterday)

    def robot():
        for n in range(1, 100):
            send(sessions[1], n * PERIOD)
            if stop.wait(0.1):
                break

    thread = threading.Thread(target=robot if sends else lambda: None)
    thread.start()
    try:
        with pytest.raises(NoFrameError, match=r"home\.map stays as it is") as raised:
            navigator_run._align(alignment, config, saved, stop)
    finally:
        stop.set()
        thread.join()
    assert lacks in str(raised.value)
    assert [one.name for one in tmp_path.iterdir()] == ["home.map"]


def test_a_stop_is_obeyed_and_nothing_else_is_taken(align, sessions):
    alignment = align(world_at(2.2, 1.6, 0.4))

    def request(action):
        message = ControlRequest(action=action)
        return ask(sessions[1], f"r/{keys.CONTROL}", message, ControlReply, 20.0).state

    assert request("stop") == "stopped"
    alignment._step(alignment._intake.take(0.0))
    assert alignment._stream.sent.yaw_rate_rad_s == 0.0
    with pytest.raises(RequestRefusedError, match="finding its place in the map"):
        request("cancel")
    assert request("resume") == "starting"
    alignment._stream.close()


def test_a_camera_that_nothing_turns_is_not_aligned(tmp_path, capsys):
    arguments = ["navigate", "--map", str(tmp_path / "home.map"), "--profile", "hand-held"]
    assert run([*arguments, "--align"]) == 2
    assert "profile hand-held takes none: begin another map" in capsys.readouterr().err


def test_an_alignment_is_said_in_degrees_and_metres():
    found = Registration(T_map_world=T_MAP_WORLD, fitness=0.97, rmse_m=0.052, lead=0.3)
    assert said_registration(found) == (
        "aligned to the kept map: turned by 45.8 degrees, moved by (2.00, -1.00, 0.00) m; 97% of "
        "what is seen fits, with an error of 0.05 m"
    )


@pytest.mark.parametrize("is_stopped", [False, True])
@pytest.mark.parametrize("was_held", [False, True])
def test_a_stop_during_the_alignment_holds_the_search_of_a_killed_run(
    monkeypatch, was_held, is_stopped
):
    """Also one that is answered after the turn, until the session closes; Resume releases it."""
    ran = RunState(held=was_held, mode="auto", speed_limit=0.4)
    saved = SavedState(voxel_map=VoxelMap(MAP, ("wall",)), requests=(), interrupted=ran)
    begun, served = [], []

    class Session:
        def close(self):
            if begun:
                begun[0].is_stopped = is_stopped

    def begin(*_, held):
        begun.append(SimpleNamespace(run=lambda _: None, is_stopped=held))
        return begun[0]

    def navigator(config, session, model, left, *_):
        assert begun[0].is_stopped == is_stopped, "the session of the alignment is closed"
        served.append(left)

    monkeypatch.setattr(navigator_run, "ProcessStopSignal", ProcessStop)
    monkeypatch.setattr(navigator_run, "open_router", lambda _: Session())
    monkeypatch.setattr(navigator_run, "starting", lambda *_: contextlib.nullcontext())
    monkeypatch.setattr(navigator_run, "warm_up", lambda *_: None)
    monkeypatch.setattr(navigator_run, "Alignment", begin)
    monkeypatch.setattr(navigator_run, "Navigator", navigator)
    monkeypatch.setattr(navigator_run, "register", lambda _: None)
    monkeypatch.setattr(navigator_run, "_serve", lambda *_: None)
    navigator_run.run_navigator(CONFIG, lambda _: None, saved=saved, align=True)
    assert served[0].interrupted == RunState(held=is_stopped, mode="auto", speed_limit=0.4)


class ProcessStop(threading.Event):
    """The stop signal of a process, without its signal handlers."""

    def interrupting(self):
        return contextlib.nullcontext()


def test_it_is_listed_while_it_turns(monkeypatch, free_endpoint, tmp_path):
    """So that `ippon control stop` finds it."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(navigator_run, "ProcessStopSignal", ProcessStop)
    monkeypatch.setattr(navigator_run, "warm_up", lambda *_: None)
    monkeypatch.setattr(navigator_run, "Alignment", lambda *_, **__: None)

    def turn(*_):
        listed = [one for one in running_navigators() if one.pid == os.getpid()]
        assert [one.robot for one in listed] == ["r"]
        raise NoFrameError("it turned")

    monkeypatch.setattr(navigator_run, "_align", turn)
    config = dataclasses.replace(CONFIG, listen=free_endpoint)
    saved = SavedState(voxel_map=VoxelMap(MAP, ("wall",)), requests=())
    with pytest.raises(NoFrameError, match="it turned"):
        navigator_run.run_navigator(config, lambda _: None, saved=saved, align=True)
    assert not [one for one in running_navigators() if one.pid == os.getpid()]


def test_without_a_certain_place_the_map_keeps_its_memory_and_its_room_names(monkeypatch, tmp_path):
    kept = tmp_path / "home.map"
    for path in (kept, memory_path(kept), room_names_path(kept)):
        path.write_bytes(b"yesterday")

    def run(_):
        raise RegistrationError("two places fit")

    config = dataclasses.replace(CONFIG, keep_map=str(kept))
    saved = SavedState(voxel_map=VoxelMap(MAP, ("wall",)), requests=())
    left, _, note = navigator_run._align(SimpleNamespace(run=run), config, saved, threading.Event())
    assert left.voxel_map is None
    assert "two places fit; it is kept as home.map.aside-1, and a new map begins" in note
    aside = tmp_path / "home.map.aside-1"
    assert sorted(tmp_path.iterdir()) == sorted([aside, memory_path(aside), room_names_path(aside)])
