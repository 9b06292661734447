"""The same images and settings give the same map; other settings another."""

import dataclasses
from contextlib import contextmanager

import msgspec
import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from app.datasets.bag_robot import BagRobot
from app.export import mesh
from app.export.mesh import write_mesh
from app.export.session_data import read_session_data
from app.links.robot_streams.assembler import FrameAssembler
from app.messages import keys
from app.messages.control import encode
from app.messages.depth.depth_images import decode_depth, encode_depth
from app.messages.images import decode_camera, decode_color, encode_camera, encode_color
from app.messages.motion import (
    StampedTwist,
    decode_transforms,
    decode_twist,
    encode_transforms,
    encode_twist,
    robot_transforms,
)
from app.messages.navigation import StampedPose, encode_pose
from app.messages.perception.heatmaps import decode_heatmap, encode_heatmap
from app.messages.status import Event, GoalStatus, LevelRow, LevelTable
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.review.recompute import Recomputation, recompute
from app.nodes.review.settings import read_settings
from app.recognition import frames
from app.recording.errors import RecordingError
from app.recording.reading.recording import Recording
from app.recording.writing.limits import RecordingLimits
from app.recording.writing.session import Session
from ippon.camera import PinholeCamera
from ippon.guidance.levels import Guidance, LabelLevel, Level
from ippon.mapping.mesh import copy_signed_distances, extract_mesh
from ippon.mapping.objects.surface_changes import SurfaceTracker
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission
from ippon.robot import ZED
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.world import SimulatedWorld
from tests.app.recording.conftest import status_of

FRAMES = 8
CAMERA_FRAME = "camera"


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    """A few steps of a search, recorded as its messages; and the mission that made them."""
    config = NavigatorConfig(robot="home/3")
    scene = generate_home(4)
    camera = PinholeCamera.from_horizontal_fov(96, 60, 1.29)
    world = SimulatedWorld(scene, ZED, camera, scene.start_poses[0])
    world.set_labels(list(config.labels), "plant")
    mission = Mission(config.mission, ZED, config.labels, config.seed)
    rows = tuple(LabelLevel(label=n, level=Level.AVERAGE, reason="") for n in config.labels)
    guidance = Guidance(ooi="plant", context="", provider="test", rows=rows)
    mission.goals.set_goal(
        Goal(goal_id=1, object="plant", display="plant", category="plant"), guidance
    )
    table = LevelTable(
        goal_id=1, object="plant", context="", provider="test", elapsed_ms=0.0,
        rows=[LevelRow(label=n, level="average", reason="") for n in config.labels],
    )  # fmt: skip
    root = tmp_path_factory.mktemp("searched")
    session = Session(root, "home/3", RecordingLimits(min_free_gb=0.0), 0)

    def say(key, payload):
        say.n += 1
        session.add(key, payload, 10**18 + say.n * 10**7, say.n * 0.01)

    say.n = 0
    say(keys.CONFIGURATION, msgspec.json.encode(config))
    say(keys.STATUS, encode(status_of(0)))
    say(keys.LEVELS, encode(table))
    assembler = FrameAssembler()
    for n in range(FRAMES):
        seen = world.observe()
        stamp = seen.stamp_ns
        T_base_camera = world.robot.T_base_camera(world.base.tilt_rad)
        sent = [
            (keys.TF, encode_transforms(
                robot_transforms(stamp, seen.T_world_base, T_base_camera, CAMERA_FRAME)
            )),
            (keys.HEATMAP, encode_heatmap(seen.heatmap, stamp, CAMERA_FRAME)),
            (keys.CAMERA_INFO, encode_camera(seen.camera, stamp, CAMERA_FRAME)),
            (keys.DEPTH, encode_depth(seen.depth, stamp, CAMERA_FRAME)),
            (keys.COLOR, encode_color(seen.color, stamp, CAMERA_FRAME)),
        ]  # fmt: skip
        # The heatmaps of two frames come late, when one of them has gone without.
        late = [sent.pop(1)] if n in (3, 4) else []
        for key, payload in sent:
            say(key, payload)
        sent[1:1] = late
        assembler.add_transforms(decode_transforms(sent[0][1]))
        if not late:
            assembler.add_heatmap(decode_heatmap(sent[1][1]))
        assembler.add_camera(decode_camera(sent[2][1]))
        assembler.add_depth(decode_depth(sent[3][1]))
        assembler.add_color(decode_color(sent[4][1]))
        # One frame comes too fast for the navigator: it is recorded, and answered by nothing.
        frame = assembler.take()
        assert (frame is None) is (n == 3)
        if n not in (3, 5):
            result = mission.step(frame)
            twist = StampedTwist(stamp_ns=stamp, linear_m_s=0.0, yaw_rate_rad_s=0.0)
            say(keys.CMD_VEL, encode_twist(twist))
            for event in result.snapshot.events:
                say(keys.EVENT, encode(Event(stamp_ns=stamp, kind=event.kind, text=event.text)))
        if n == 4:
            for key, payload in late:
                say(key, payload)
                assembler.add_heatmap(decode_heatmap(payload))
            assert mission.voxel_map.integrate_heatmap(assembler.take_late()) > 100
        world.step(result.command, 0.2)
    session.close()
    recording = Recording(session.writer.folder)
    yield recording, mission
    recording.close()


def _map_of(mission):
    delta = SurfaceTracker(mission.voxel_map).keyframe()
    return {f.name: getattr(delta, f.name) for f in dataclasses.fields(delta)}


@pytest.mark.slow
def test_the_same_settings_give_the_same_map_bit_for_bit(searched):
    recording, live = searched
    work = Recomputation(recording, read_settings(recording, ()))
    kinds = {message.key for message in work.messages()}
    assert work.frames == FRAMES - 2
    assert work.refused == 0
    assert {keys.MAP_VOXELS, keys.MAP_KEYFRAME, keys.PLAN_TREE, keys.STATUS} <= kinds
    a, b = live.voxel_map._pools, work.mission.voxel_map._pools
    for name in ("tsdf", "weight", "state", "ooi", "level"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    expected, got = _map_of(live), _map_of(work.mission)
    for name, value in expected.items():
        np.testing.assert_array_equal(value, got[name], err_msg=name)
    assert len(expected["index"]) > 100


@pytest.mark.slow
def test_frames_of_a_robot_that_drives_to_goals_by_itself_are_recomputed(searched, tmp_path):
    recording, _ = searched
    # While a goal is in force no velocity is sent, so that only the first frame has an answer.
    answered = [one.time_ns for one in recording.all_messages((keys.CMD_VEL,))][:1]
    goal = encode_pose(StampedPose(stamp_ns=1, T_frame_base=np.eye(4)))
    with _changed(
        recording,
        tmp_path,
        lambda one: one.key != keys.CMD_VEL or one.time_ns in answered,
        (keys.NAVIGATION_GOAL, goal),
    ) as driven:
        work = Recomputation(driven, read_settings(driven, ()))
        for _ in work.messages():
            pass
    # All but that whose heatmap comes late.
    assert work.frames == FRAMES - 1


@pytest.mark.slow
def test_a_search_that_began_before_the_recording_is_recomputed_with_its_goal(searched, tmp_path):
    recording, _ = searched
    last_ns = decode_twist(recording.latest(keys.CMD_VEL, recording.end_ns).payload).stamp_ns
    later = Event(stamp_ns=last_ns, kind="goal_set", text="searching for sofa", goal_id=2)
    with _changed(
        recording, tmp_path, lambda one: not _begins_a_search(one), (keys.EVENT, encode(later))
    ) as joined:
        work = Recomputation(joined, read_settings(joined, ()))
        for _ in work.messages():
            if work.frames == 1:
                assert work.mission.goal.goal_id == 1
                break
        else:
            pytest.fail("no frame was integrated")


def _begins_a_search(message):
    return message.key == keys.EVENT and (
        msgspec.json.decode(message.payload, type=Event).kind == "goal_set"
    )


@contextmanager
def _changed(recording, root, keeps, more):
    """Open a copy of a recording with some of its messages, and with another one before them."""
    session = Session(root, "home/3", RecordingLimits(min_free_gb=0.0), recording.start_ns)
    session.add(*more, recording.start_ns, 0.0)
    for message in recording.all_messages():
        if keeps(message):
            at_s = (message.time_ns - recording.start_ns) * 1e-9
            session.add(message.key, message.payload, message.time_ns, at_s)
    session.close()
    copy = Recording(session.writer.folder)
    try:
        yield copy
    finally:
        copy.close()


@pytest.mark.slow
def test_the_exported_mesh_is_the_surface_of_the_live_map(searched, tmp_path):
    recording, live = searched
    session = read_session_data(recording.path)
    shares = []
    write_mesh(session, tmp_path / "mesh.ply", shares.append)
    session.recording.close()
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0, abs=0.05)
    exported = trimesh.load(tmp_path / "mesh.ply")
    expected = extract_mesh(copy_signed_distances(live.voxel_map))
    # The live map left two frames out, and this one has them.
    far, _ = cKDTree(exported.vertices).query(expected.vertices)
    assert np.quantile(far, 0.95) < live.config.map.voxel_size_m


@pytest.mark.slow
def test_the_mesh_of_a_session_has_the_clock_offset_of_its_navigator(
    searched, tmp_path, monkeypatch
):
    recording, _ = searched
    settings = read_settings(recording, ())
    late = dataclasses.replace(settings.navigator, camera_clock_offset_s=0.06)
    late = dataclasses.replace(settings, navigator=late)
    monkeypatch.setattr(mesh, "read_settings", lambda *_: late)
    opened = []

    def open_source(*path, **told):
        opened.append(told["clock_offset_s"])
        return frames.open_source(*path, **told)

    monkeypatch.setattr(mesh, "open_source", open_source)
    session = read_session_data(recording.path)
    write_mesh(session, tmp_path / "mesh.ply")
    named = dataclasses.replace(session, robot=BagRobot(clock_offset_s=0.02))
    write_mesh(named, tmp_path / "mesh.ply")
    session.recording.close()
    assert opened == [0.06, 0.02]


def test_other_settings_give_another_session_to_compare(searched, tmp_path):
    recording, _ = searched
    settings = read_settings(recording, ("map.voxel_size_m=0.2", "guidance.levels.floor=far"))
    shares = []
    again = Recording(recompute(recording, settings, tmp_path, shares.append))
    assert shares[-1] == pytest.approx(1.0, abs=0.05)
    assert again.latest(keys.COLOR, again.end_ns).payload == (
        recording.latest(keys.COLOR, recording.end_ns).payload
    )
    table = msgspec.json.decode(again.first(keys.LEVELS).payload, type=LevelTable)
    levels = {row.label: row.level for row in table.rows}
    assert (levels["floor"], levels["wall"]) == ("far", "average")
    status = msgspec.json.decode(again.latest(keys.STATUS, again.end_ns).payload)
    assert status["voxel_size_m"] == 0.2
    again.close()


def test_a_recomputation_that_fails_leaves_no_session_behind(searched, tmp_path):
    recording, _ = searched
    settings = read_settings(recording, ())
    with (
        _changed(
            recording,
            tmp_path / "blind",
            lambda one: one.key not in (keys.DEPTH, keys.LEVELS),
            (keys.STATUS, encode(status_of(1))),
        ) as blind,
        pytest.raises(RecordingError, match="has no frame"),
    ):
        recompute(blind, settings, tmp_path / "recomputed", lambda _: None)
    other = LevelTable(
        goal_id=1, object="plant", context="", provider="test", elapsed_ms=0.0,
        rows=[LevelRow(label="wall", level="average", reason="")],
    )  # fmt: skip
    with (
        _changed(
            recording, tmp_path / "other", lambda one: one.key != keys.LEVELS,
            (keys.LEVELS, encode(other)),
        ) as changed,
        pytest.raises(RecordingError, match="other labels"),
    ):  # fmt: skip
        recompute(changed, settings, tmp_path / "recomputed", lambda _: None)
    assert list((tmp_path / "recomputed").iterdir()) == []


def test_what_was_planned_by_the_clock_is_recomputed_by_count(searched):
    recording, live = searched
    settings = read_settings(recording, ())
    planner = dataclasses.replace(live.config.planner, step_budget_s=1e-6)
    mission = dataclasses.replace(live.config, planner=planner)
    navigator = dataclasses.replace(settings.navigator, mission=mission)
    hurried = dataclasses.replace(settings, navigator=navigator)
    assert Recomputation(recording, hurried).mission.config == live.config


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ("map.voxel_size_m", "NAME=VALUE"),
        (
            "map.voxel_size=0.1",
            r"no field 'voxel_size' in mission\.map; did you mean mission\.map\.voxel_size_m",
        ),
        ("map.voxel_size_m=-1", "voxel_size_m must be positive"),
        ("map.fusion=sum", "refused"),
        ("planner.step_budget_s=0.02", "planner.step_budget_s has no effect"),
        ("guidance.levels.sofa=close", "the levels are far, average, near, certain"),
        ("guidance.levels.ufo=far", "unknown label 'ufo'"),
    ],
)
def test_changes_that_are_none_are_refused(searched, change, text):
    with pytest.raises(RecordingError, match=text):
        read_settings(searched[0], (change,))


def test_a_bag_of_others_cannot_be_recomputed(tmp_path):
    session = Session(tmp_path, "r", RecordingLimits(min_free_gb=0.0), 0)
    session.add(keys.STATUS, encode(status_of(0)), 1, 0.0)
    session.close()
    recording = Recording(session.writer.folder)
    with pytest.raises(RecordingError, match="only sessions recorded by ippon"):
        read_settings(recording, ())
    recording.close()


def test_a_tour_of_several_objects_cannot_be_recomputed(tmp_path):
    session = Session(tmp_path, "r", RecordingLimits(min_free_gb=0.0), 1)
    config = NavigatorConfig(robot="r")
    session.add(keys.CONFIGURATION, msgspec.json.encode(config), 1, 0.0)
    tour = [GoalStatus(goal_id=n, object=name) for n, name in enumerate(("hat", "mug"))]
    for stamp, goals in ((1, []), (2, tour)):
        status = msgspec.structs.replace(status_of(stamp), tour=goals)
        session.add(keys.STATUS, encode(status), stamp, 0.0)
    session.close()
    recording = Recording(session.writer.folder)
    with pytest.raises(RecordingError, match="several objects in one tour"):
        Recomputation(recording, read_settings(recording, []))
    recording.close()
