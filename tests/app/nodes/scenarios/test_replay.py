"""Datasets in four folders' shapes, and bags, become frames."""

import dataclasses
import json
import queue
import re
import threading

import numpy as np
import pytest
import trimesh
from PIL import Image
from rosbags.rosbag2 import StoragePlugin, Writer
from scipy.spatial.transform import Rotation

from app.cli.main import run
from app.datasets import messages as replay_messages
from app.datasets.bag_robot import read_bag_robot
from app.datasets.dataset import DatasetError, open_dataset
from app.datasets.floor_alignment import align_to_floor
from app.datasets.messages import RobotMessage, bag_messages
from app.links.network.session import LinkError, open_client
from app.links.network.subscription import subscribe
from app.links.robot_streams.assembler import FrameAssembler, assemble
from app.messages import keys
from app.messages.cdr import encode, header, make, typestore
from app.messages.depth.depth_images import decode_depth, encode_depth_raw
from app.messages.images import decode_color, decompress_color, encode_color
from app.messages.motion import decode_transforms, encode_transforms
from app.nodes import replay as replay_node
from app.nodes.replay import ReplayConfig, messages_of, play, poses_sent, run_replay
from app.recognition.frames import open_source
from app.recording.writing.limits import RecordingLimits
from app.recording.writing.session import Session
from app.recording.writing.writer import SessionWriter
from ippon.geometry import invert_transform, make_transform, rotation_z
from ippon.mapping.objects.surface_changes import SurfaceTracker
from ippon.mapping.voxel_map import MapConfig, VoxelMap
from tests.app.recording.conftest import all_messages, write_session
from tests.locations import SHARED

KITCHEN = SHARED / "rgbd" / "redkitchen_a"
WIDTH, HEIGHT = 640, 480
# Level, 1.5 m above the floor, looking along +x of a z-up world; then turned left, and lost.
LEVEL = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
POSES = [make_transform(rotation_z(0.1 * n) @ LEVEL, (0.2 * n, 0.0, 1.5)) for n in range(3)]
LOST = np.full((4, 4), np.inf)
READERS = [
    ["replay"],
    ["recognise", "--find", "cup"],
    ["calibrate", "--out", "model.json", "--known", "objects.json"],
]
"""Commands that read a bag, with what each needs beside it."""


def _images(folder, color, depth, unit_m):
    """Write a wall at 2 m, with a corner without reading."""
    (folder / color).parent.mkdir(parents=True, exist_ok=True)
    (folder / depth).parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.full((HEIGHT, WIDTH, 3), 120, np.uint8)).save(folder / color)
    values = np.full((HEIGHT, WIDTH), round(2.0 / unit_m), np.uint16)
    values[:10, :10] = 65535
    Image.fromarray(values).save(folder / depth)


def _sequence(folder, poses):
    frames = []
    for n, pose in enumerate(poses):
        _images(folder, f"c/{n}.jpg", f"d/{n}.png", 1e-3)
        frames.append(
            {"color": f"c/{n}.jpg", "depth": f"d/{n}.png", "camera_to_world": pose.tolist()}
        )
    content = {
        "name": "x", "width": WIDTH, "height": HEIGHT, "depth_unit_m": 1e-3, "rate_hz": 10.0,
        "intrinsics": {"fx": 500.0, "fy": 500.0, "cx": 320.0, "cy": 240.0},
        "gravity_world": [0, 0, -1], "frames": frames,
    }  # fmt: skip
    (folder / "sequence.json").write_text(json.dumps(content).replace("Infinity", "1e999"))


def _tum(folder, poses):
    rgb, depth, truth = ["# colour"], ["# depth"], ["# pose"]
    for n, pose in enumerate(poses):
        _images(folder, f"rgb/{n}.png", f"depth/{n}.png", 1 / 5000)
        rgb.append(f"{100 + n / 10:.4f} rgb/{n}.png")
        depth.append(f"{100 + n / 10 + 0.01:.4f} depth/{n}.png")
        if np.isfinite(pose).all():
            q = Rotation.from_matrix(pose[:3, :3]).as_quat()
            row = " ".join(f"{x:.9f}" for x in (*pose[:3, 3], *q))
            truth.append(f"{100 + n / 10 + 0.003:.4f} {row}")
    for name, lines in [("rgb", rgb), ("depth", depth), ("groundtruth", truth)]:
        (folder / f"{name}.txt").write_text("\n".join(lines))


def _seven_scenes(folder, poses):
    # Its world is the first camera's: y down.
    for n, pose in enumerate(poses):
        stem = f"frame-{n:06d}"
        _images(folder, f"{stem}.color.png", f"{stem}.depth.png", 1e-3)
        seen = invert_transform(POSES[0]) @ pose if np.isfinite(pose).all() else pose
        np.savetxt(folder / f"{stem}.pose.txt", seen)


def _scannet(folder, poses):
    (folder / "intrinsic").mkdir(parents=True)
    (folder / "pose").mkdir()
    np.savetxt(folder / "intrinsic/intrinsic_depth.txt", np.diag([580.0, 580.0, 1.0, 1.0]))
    for n, pose in enumerate(poses):
        _images(folder, f"color/{n}.jpg", f"depth/{n}.png", 1e-3)
        np.savetxt(folder / f"pose/{n}.txt", pose)


@pytest.mark.parametrize("write", [_sequence, _tum, _seven_scenes, _scannet])
def test_a_dataset_becomes_frames_of_an_upright_robot(write, tmp_path):
    write(tmp_path, [*POSES, LOST])
    dataset = open_dataset(tmp_path)
    assert len(dataset.frames) == 3
    assembler = FrameAssembler()
    frames = []
    for sent in messages_of(ReplayConfig(path=tmp_path, floor_m=_floor(write)), 10**9):
        assemble(assembler, sent.key, sent.payload)
        if sent.key == keys.COLOR:
            frames.append(assembler.take())
    for n, frame in enumerate(frames):
        assert frame.depth[200, 200] == pytest.approx(2.0, abs=1e-3)
        assert frame.depth[5, 5] == 0.0
        np.testing.assert_allclose(frame.T_world_camera[2, 3], 1.5, atol=1e-3)
        np.testing.assert_allclose(frame.T_world_base[:2, 3], frame.T_world_camera[:2, 3])
        moved = np.hypot(*frame.T_world_camera[:2, 3])
        assert moved == pytest.approx(0.2 * n, abs=1e-3)
        assert frame.tilt_rad == pytest.approx(0.0, abs=1e-3)
    assert frames[1].stamp_ns > frames[0].stamp_ns


def _floor(write):
    return -1.5 if write is _seven_scenes else 0.0


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 0, -1), (0, -1, 0), (0.1, 0.9, -0.4)])
def test_up_becomes_z(up, tmp_path):
    _sequence(tmp_path, POSES)
    dataset = open_dataset(tmp_path)
    T = align_to_floor(dataclasses.replace(dataset, up_world=up), 0.0)
    np.testing.assert_allclose(T[:3, :3] @ up / np.linalg.norm(up), [0, 0, 1], atol=1e-12)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)


def test_a_session_is_replayed_as_it_was_sent(tmp_path):
    folder = write_session(tmp_path).writer.folder
    sent = []
    stop = threading.Event()
    config = ReplayConfig(path=folder, rate=100.0, start_s=2.0, heatmaps=False)
    images = play(config, lambda key, payload: sent.append((key, payload)), stop, 0)
    wanted = (keys.TF, keys.CAMERA_INFO, keys.CONTACT, keys.DEPTH, keys.COLOR)
    *played, end = sent
    everything = [(k, p) for _, k, p in all_messages() if k in wanted]
    before, after = everything[: -5 * 20], everything[-5 * 20 :]
    # What some drivers send once comes first, as it was when the replay begins.
    assert played == [[one for one in before if one[0] == keys.CAMERA_INFO][-1], *after]
    assert images == 20
    ended = f"the replay of {folder.name} has ended: 20 images"
    assert end == (keys.ENDED, ended.encode()), "the console says so, in place of a lost robot"
    sent.clear()
    play(dataclasses.replace(config, loop=True), lambda *message: sent.append(message), stop, 0)
    assert sent == played


@pytest.mark.parametrize(
    ("sensor_hz", "note"),
    [
        (0.0, ""),
        (
            2.0,
            r"has 12 depth images for 30 colour images: .* \(recorded with --sensor-hz 2; 0 keeps",
        ),
    ],
)
def test_a_replay_says_that_a_recording_was_thinned(
    tmp_path, caplog, free_endpoint, sensor_hz, note
):
    session = Session(tmp_path, "r", RecordingLimits(min_free_gb=0.0), 10**18, sensor_hz)
    for time_ns, key, payload in all_messages():
        session.add(key, payload, time_ns, 1e-9 * time_ns)
    session.close()
    config = ReplayConfig(path=session.writer.folder, connect=free_endpoint)
    with pytest.raises(LinkError):
        run_replay(config)
    (said,) = [text for text in caplog.messages if "depth images for" in text] or [""]
    assert re.search(note, said) if note else said == ""


def test_a_replay_says_how_many_images_of_a_dataset_are_left_out(tmp_path, caplog, free_endpoint):
    _sequence(tmp_path, [*POSES, LOST])
    with pytest.raises(LinkError):
        run_replay(ReplayConfig(path=tmp_path, connect=free_endpoint))
    left = "1 of 4 colour images are left out, for want of a depth image of their time or a valid"
    assert left in caplog.text


def test_a_replay_opens_a_bag_three_times_and_aligns_a_dataset_once(
    tmp_path, sessions, free_endpoint, monkeypatch
):
    """A bag for the first message, its poses and each round; its images are counted meanwhile."""
    done = []

    def counted(module, name):
        inner = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *a, **k: done.append(name) or inner(*a, **k))

    counted(replay_messages, "Recording")
    to_router = {"connect": free_endpoint, "robot": "r", "rate": 100.0}
    run_replay(ReplayConfig(path=write_session(tmp_path / "s").writer.folder, **to_router))
    assert done == ["Recording"] * 3
    done.clear()
    counted(replay_node, "align_to_floor")
    _sequence(tmp_path / "d", POSES)
    run_replay(ReplayConfig(path=tmp_path / "d", floor_m=0.0, **to_router))
    assert done == ["align_to_floor"]


def test_a_bag_of_ros_2_in_sqlite_is_replayed(tmp_path):
    wanted = (keys.COLOR, keys.DEPTH, keys.CAMERA_INFO, keys.TF)
    kinds = {key: keys.ROS_TYPES[key] for key in wanted}
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connections = {
            key: writer.add_connection(f"/spot/{key}", kind, typestore=typestore())
            for key, kind in kinds.items()
        }
        for time_ns, key, payload in all_messages():
            if key in kinds:
                writer.write(connections[key], time_ns, payload)
    got = [(s.key, s.payload) for s in bag_messages(tmp_path / "bag", 0.0, heatmaps=True)]
    assert got == [(k, p) for _, k, p in all_messages() if k in kinds]
    assert isinstance(next(bag_messages(tmp_path / "bag", 0.0, heatmaps=True)), RobotMessage)


def _bag(folder, *, root="map", camera=True, late_s=0.0, base_frame="base_link"):
    """Write a session whose tf has another root or base, no camera, or stamps of its own."""
    writer = SessionWriter(folder, "r")
    for time_ns, key, payload in all_messages():
        if key == keys.TF:
            base, mount = decode_transforms(payload)
            base = dataclasses.replace(base, parent=root, child=base_frame)
            mount = dataclasses.replace(mount, parent=base_frame)
            links = [base, mount] if camera else [base]
            moved = [
                dataclasses.replace(t, stamp_ns=t.stamp_ns + round(late_s * 1e9)) for t in links
            ]
            writer.add(key, encode_transforms(moved), time_ns, 0.0)
        else:
            writer.add(key, payload, time_ns, 0.0)
    writer.close()
    return folder


def test_the_root_of_tf_is_the_world_of_a_bag_without_map(tmp_path):
    bag, mapped = _bag(tmp_path / "a", root="odom"), _bag(tmp_path / "b")
    source = open_source(bag)
    assert source.note == f"{bag} has no frame 'map': 'odom' is taken as the world"
    assert open_source(mapped).note == ""
    poses = [frame.T_world_camera for frame in source.frames()]
    assert len(poses) > 5
    np.testing.assert_allclose(poses, [f.T_world_camera for f in open_source(mapped).frames()])
    config = ReplayConfig(path=bag, start_s=1.0)
    first = next(messages_of(config, 0, poses_sent(config)))
    (same,) = decode_transforms(first.payload)
    assert (first.at_s, first.key, same.parent, same.child) == (0.0, keys.TF_STATIC, "map", "odom")
    np.testing.assert_array_equal(same.T_parent_child, np.eye(4))


@pytest.mark.parametrize("root", ["map", "odom"])
def test_the_base_of_a_bag_is_the_frame_that_was_named(tmp_path, root):
    bag = _bag(tmp_path / "a", root=root, base_frame="base_footprint")
    with pytest.raises(DatasetError, match=r"must be called 'base_link'.* with --base-frame, or"):
        open_source(bag)
    named = list(open_source(bag, base="base_footprint").frames())
    usual = list(open_source(_bag(tmp_path / "b", root=root)).frames())
    assert len(named) == len(usual) > 5
    for attribute in ("T_world_camera", "T_world_base"):
        ours, theirs = ([getattr(f, attribute) for f in fs] for fs in (named, usual))
        np.testing.assert_allclose(ours, theirs)
    config = ReplayConfig(path=bag, base="base_footprint")
    first = next(messages_of(config, 0, poses_sent(config)))
    *_, same = decode_transforms(first.payload)
    assert (first.key, same.parent, same.child) == (keys.TF_STATIC, "base_footprint", "base_link")


@pytest.mark.parametrize(
    ("has", "options", "status", "text"),
    [
        ("base_footprint", [], 1, "or --base-frame names the frame of the base"),
        ("base_footprint", ["--base-frame", "/base_footprint"], 0, "whole"),
        ("base_footprint", ["--base-frame", "chassis"], 1, "nothing names 'chassis'"),
        ("base_footprint", ["--base-frame", ""], 2, "such as base_footprint"),
        ("base_link", ["--base-frame", "chassis"], 1, "whose place 'chassis' cannot take"),
    ],
)
def test_the_doctor_of_a_bag_takes_the_base_that_is_named(
    has, options, status, text, tmp_path, capsys
):
    bag = _bag(tmp_path / "a", base_frame=has)
    assert run(["doctor", str(bag), *options]) == status
    told = capsys.readouterr()
    assert text in told.out + told.err


def test_what_a_bag_without_poses_cannot_be_exported_as_leads_to_the_doctor(tmp_path, capsys):
    bag = _bag(tmp_path / "a", base_frame="base_footprint")
    assert run(["export", str(bag), "tum", "mesh", "--out", str(tmp_path / "out")]) == 1
    assert capsys.readouterr().out.count("; `ippon doctor FILE` says w") == 2


@pytest.mark.parametrize("command", READERS)
@pytest.mark.parametrize(
    ("has", "name", "why"),
    [
        ("base_footprint", "chassis", "nothing names 'chassis'; tf has base_footprint, camera_"),
        ("base_link", "/chassis", "has a frame 'base_link' already: 'chassis' cannot take its"),
        ("base_footprint", "", "--base-frame names the frame of the base, such as base_footprint"),
    ],
)
def test_a_base_that_a_bag_does_not_have_is_refused(
    command, has, name, why, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "objects.json").write_text('{"objects": [], "absent": ["cup"]}')
    bag = _bag(tmp_path / "s", base_frame=has)
    assert run([command[0], str(bag), *command[1:], "--base-frame", name]) == 2
    assert why in capsys.readouterr().err


def test_who_comes_after_the_start_of_a_replay_gets_its_fixed_transforms(
    tmp_path, sessions, free_endpoint, monkeypatch
):
    router, _ = sessions
    began, stop, heard = threading.Event(), threading.Event(), queue.Queue()
    subscribe(router, f"r/{keys.COLOR}", lambda _: began.set())

    def come_late():
        assert began.wait(20.0)
        subscribe(router, f"r/{keys.TF_STATIC}", hear, kept=True)

    def hear(payload):
        heard.put(payload)
        stop.set()

    # It plays until they have come, or for a minute.
    monkeypatch.setattr(replay_node, "ProcessStopSignal", lambda: stop)
    late = threading.Thread(target=come_late)
    late.start()
    bag = _bag(tmp_path / "s", root="odom")
    run_replay(ReplayConfig(path=bag, connect=free_endpoint, robot="r", rate=0.1))
    late.join()
    (same,) = decode_transforms(heard.get(timeout=5.0))
    assert (same.parent, same.child) == ("map", "odom")


@pytest.mark.parametrize("command", READERS)
def test_a_bag_whose_images_cannot_have_a_pose_is_refused(command, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "objects.json").write_text('{"objects": [], "absent": ["cup"]}')
    bag = _bag(tmp_path / "s", root="odom", camera=False)
    assert run([command[0], str(bag), *command[1:]]) == 2
    error = capsys.readouterr().err
    assert (
        "no image has a pose: no way from 'odom' to 'camera_color_optical_frame': nothing names "
        "'camera_color_optical_frame'; tf has base_link, odom, and there is no tf_static"
    ) in error
    assert "ippon replay --no-poses" in error


@pytest.mark.parametrize("command", READERS)
def test_a_bag_whose_poses_are_of_another_time_is_refused(command, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "objects.json").write_text('{"objects": [], "absent": ["cup"]}')
    bag = _bag(tmp_path / "s", late_s=100.0)
    assert run([command[0], str(bag), *command[1:]]) == 2
    error = capsys.readouterr().err
    assert (
        "no image has a pose: by their stamps the images end 94.20 s before the first pose of "
        "'base_link': the clocks of camera and poses differ. Record again with clocks that agree"
    ) in error


@pytest.mark.parametrize("command", [["doctor"], *READERS])
def test_the_clock_offset_of_a_profile_counts_where_times_are_compared(
    command, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "objects.json").write_text('{"objects": [], "absent": ["cup"]}')
    # Nobody is there to replay to.
    monkeypatch.setattr(replay_node, "open_client", lambda _: open_client("tcp/127.0.0.1:1", 0.2))
    text = ROBOT.partition("ros2:")[0].replace("tilt: 0", "tilt: 0, clock_offset_ms: 900")
    (tmp_path / "own.yaml").write_text(text)
    bag = str(_bag(tmp_path / "s", late_s=6.2))
    apart = "the images end 0.40 s before the first pose"
    run([command[0], bag, *command[1:]])
    assert apart in "".join(capsys.readouterr())
    run([command[0], bag, *command[1:], "--profile", "own.yaml"])
    assert "no image has a pose" not in "".join(capsys.readouterr())


def test_a_bag_with_odometry_in_place_of_tf_is_read(tmp_path):
    """Its poses are those of the odometry, and where the camera is comes from tf or a profile."""
    mapped = [frame.T_world_camera for frame in open_source(_bag(tmp_path / "tf")).frames()]
    bag = _odometry_bag(tmp_path / "a")
    source = open_source(bag)
    assert source.note == (
        f"{bag}: the poses are those of its odometry, which drifts; {bag} has no frame 'map': "
        "'odom' is taken as the world"
    )
    frames = list(source.frames())
    np.testing.assert_allclose([f.T_world_camera for f in frames], mapped, atol=1e-9)
    config = ReplayConfig(path=bag)
    assert {m.key for m in messages_of(config, 0, poses_sent(config))} == {
        keys.COLOR, keys.DEPTH, keys.CAMERA_INFO, keys.TF, keys.TF_STATIC, keys.CONTACT,
        keys.HEATMAP,
    }  # fmt: skip

    bare = _odometry_bag(tmp_path / "b", mount=False, child="base_footprint")
    with pytest.raises(
        DatasetError,
        match=r"no way from 'odom' to 'camera_color_optical_frame'.*"
        "Odometry says where the base is; --profile FILE with a fixed `tilt`",
    ):
        open_source(bare)
    (tmp_path / "own.yaml").write_text(ROBOT.partition("ros2:")[0])
    mount = read_bag_robot(str(tmp_path / "own.yaml")).T_base_camera
    assert mount[2, 3] == 1.0
    assert read_bag_robot("hand-held").T_base_camera is None
    assert read_bag_robot(None).T_base_camera is None
    source = open_source(bare, mount=mount)
    assert "where the camera is on the base is taken from the profile" in source.note
    for frame, known in zip(source.frames(), frames, strict=True):
        np.testing.assert_allclose(frame.T_world_base, known.T_world_base)
        np.testing.assert_allclose(frame.T_world_camera, known.T_world_base @ mount)


def test_tf_that_leads_to_the_camera_is_taken_before_odometry(tmp_path):
    assert open_source(_odometry_bag(tmp_path / "a", tf=True)).note == ""


def _odometry_bag(folder, *, mount=True, child="base_link", tf=False):
    """Write a session whose pose is nav_msgs/Odometry, in place of tf or beside it."""
    writer = SessionWriter(folder, "r")
    for n, (time_ns, key, payload) in enumerate(all_messages()):
        if key != keys.TF:
            writer.add(key, payload, time_ns, 0.0)
            continue
        base, camera = decode_transforms(payload)
        if tf:
            writer.add(keys.TF, payload, time_ns, 0.0)
        elif mount and n < 10:
            writer.add(keys.TF_STATIC, encode_transforms([camera]), time_ns, 0.0)
        writer.add(keys.ODOM, _odometry(base, child), time_ns, 0.0)
    writer.close()
    return folder


def _odometry(base, child):
    x, y, z = base.T_parent_child[:3, 3]
    q = Rotation.from_matrix(base.T_parent_child[:3, :3]).as_quat()
    pose = make(
        "geometry_msgs/msg/Pose",
        position=make("geometry_msgs/msg/Point", x=x, y=y, z=z),
        orientation=make("geometry_msgs/msg/Quaternion", x=q[0], y=q[1], z=q[2], w=q[3]),
    )
    zero = make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
    twist = make("geometry_msgs/msg/Twist", linear=zero, angular=zero)
    none = np.zeros(36)
    return encode(
        "nav_msgs/msg/Odometry",
        header=header(base.stamp_ns, "odom"), child_frame_id=child,
        pose=make("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=none),
        twist=make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=none),
    )  # fmt: skip


@pytest.mark.slow
def test_the_doctor_says_that_images_cannot_have_a_pose(tmp_path, capsys):
    assert run(["doctor", str(_bag(tmp_path / "a", camera=False))]) == 1
    out = capsys.readouterr().out
    assert "no image has a pose: no way from 'map' to 'camera_color_optical_frame'" in out
    assert "whole" not in out
    assert run(["doctor", str(_bag(tmp_path / "late", late_s=100.0))]) == 1
    assert "the images end 94.20 s before the first pose of" in capsys.readouterr().out
    assert run(["doctor", str(_bag(tmp_path / "b", root="odom"))]) == 0
    assert "no image has a pose" not in capsys.readouterr().out
    assert run(["doctor", str(_odometry_bag(tmp_path / "c"))]) == 0
    assert "tf" not in capsys.readouterr().out
    bare = str(_odometry_bag(tmp_path / "d", mount=False))
    assert run(["doctor", bare]) == 1
    assert "--profile FILE with a fixed `tilt` says where the camera is" in capsys.readouterr().out
    (tmp_path / "own.yaml").write_text(ROBOT.partition("ros2:")[0])
    assert run(["doctor", bare, "--profile", str(tmp_path / "own.yaml")]) == 0


def test_the_doctor_counts_images_without_depth_in_bags_of_others(own_bag, tmp_path, capsys):
    bag, profile = own_bag
    assert run(["doctor", str(bag), "--profile", str(profile)]) == 0
    assert "whole" in capsys.readouterr().out
    with Writer(tmp_path / "half", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        to, depths = {}, 0
        for time_ns, key, payload in all_messages():
            if key in (keys.COLOR, keys.DEPTH, keys.CAMERA_INFO, keys.TF):
                kind = keys.ROS_TYPES[key]
                if key not in to:
                    to[key] = writer.add_connection(f"/x/{key}", kind, typestore=typestore())
                depths += key == keys.DEPTH
                if key != keys.DEPTH or depths % 2:
                    writer.write(to[key], time_ns, payload)
    assert run(["doctor", str(tmp_path / "half")]) == 1
    out = capsys.readouterr().out
    assert "15 of 30 colour images have no depth image within 20 ms of their stamp" in out
    source = open_source(tmp_path / "half")
    assert len(list(source.frames())) == 15
    assert source.tally.note.startswith("15 of 30 colour images were not mapped")
    assert "without" not in out, "what only our recordings hold is not missed in others"
    assert run(["doctor", str(tmp_path)]) == 2
    assert "it holds no .mcap or .db3 file" in capsys.readouterr().err


ROBOT = """
name: own
body: {radius_m: 0.3, height_m: 1.0, clearance_m: 0.05}
motion: {max_speed_m_s: 0.5, max_turn_deg_s: 40}
camera: {height_m: 1.0, horizontal_fov_deg: 70, width_over_height: 1.6, tilt: 0}
ros2: {namespace: /own, color: front/rgb, depth: front/range, camera_info: front/info}
"""


@pytest.fixture(scope="module")
def own_bag(tmp_path_factory):
    """A bag with raw images on topics of a robot's own names, and another camera's images."""
    folder = tmp_path_factory.mktemp("own")
    topics = {
        keys.COLOR: ("/own/front/rgb", keys.ROS_TYPES[keys.COLOR_RAW]),
        keys.DEPTH: ("/own/front/range", keys.ROS_TYPES[keys.DEPTH_RAW]),
        keys.CAMERA_INFO: ("/own/front/info", keys.ROS_TYPES[keys.CAMERA_INFO]),
        keys.TF: ("/tf", keys.ROS_TYPES[keys.TF]),
    }
    other = ("/rear/camera/color/image_raw/compressed", keys.ROS_TYPES[keys.COLOR])
    with Writer(folder / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        to = {
            topic: writer.add_connection(*topic, typestore=typestore())
            for topic in (*topics.values(), other)
        }
        for time_ns, key, payload in all_messages():
            if key == keys.COLOR:
                writer.write(to[other], time_ns, encode_color(np.zeros((8, 8, 3), "u1"), 0, "rear"))
            if key in topics:
                writer.write(to[topics[key]], time_ns, _raw(key, payload))
    (folder / "own.yaml").write_text(ROBOT)
    return folder / "bag", folder / "own.yaml"


def _raw(key, payload):
    if key == keys.DEPTH:
        depth = decode_depth(payload)
        return encode_depth_raw(depth.depth, depth.stamp_ns, "front")
    if key == keys.COLOR:
        color = decode_color(payload)
        pixels = decompress_color(color.encoded)
        height, width = pixels.shape[:2]
        return encode(
            "sensor_msgs/msg/Image", header=header(color.stamp_ns, "front"), height=height,
            width=width, encoding="rgb8", is_bigendian=0, step=3 * width, data=pixels.reshape(-1),
        )  # fmt: skip
    return payload


def test_the_mesh_of_a_bag_is_made_with_the_names_of_its_robot(own_bag, tmp_path, capsys):
    bag, profile = own_bag
    words = ["export", str(bag), "mesh", "--out", str(tmp_path / "out")]
    assert run(words) == 1
    assert "--profile FILE with a section `ros2` that names them" in capsys.readouterr().out
    assert run([*words, "--profile", str(profile)]) == 0
    mesh = trimesh.load(tmp_path / "out" / "mesh.ply", process=False)
    assert len(mesh.faces) > 100
    assert run([*words, "--profile", "nobody"]) == 2
    assert "no robot profile 'nobody'" in capsys.readouterr().err


def test_a_bag_is_read_with_the_names_of_its_robot(own_bag):
    bag, profile = own_bag
    frames = list(open_source(bag, names=read_bag_robot(str(profile)).names).frames())
    assert len(frames) > 5
    for frame in frames:
        assert frame.color.shape == (40, 64, 3)
        np.testing.assert_allclose(frame.depth, 2.0, atol=1e-3)
    config = ReplayConfig(path=bag, names=read_bag_robot(str(profile)).names)
    assert {m.key for m in messages_of(config, 0)} == {
        keys.COLOR, keys.DEPTH_RAW, keys.CAMERA_INFO, keys.TF,
    }  # fmt: skip


@pytest.mark.parametrize("command", READERS)
def test_topics_that_a_bag_has_under_other_names_are_listed(command, own_bag, capsys, monkeypatch):
    bag, profile = own_bag
    monkeypatch.chdir(bag.parent)
    assert run([command[0], str(bag), *command[1:]]) == 2
    error = capsys.readouterr().err
    assert (
        "has no topic that ends in camera/depth/image_raw/compressedDepth or "
        "camera/depth/image_raw, camera/color/camera_info: "
    ) in error
    assert "It has /own/front/info (sensor_msgs/msg/CameraInfo), /own/front/range (" in error
    assert "--profile FILE" in error
    profile.with_name("none.yaml").write_text(ROBOT.replace("front/range", "front/deep"))
    assert run([command[0], str(bag), *command[1:], "--profile", "none.yaml"]) == 2
    error = capsys.readouterr().err
    assert "image_raw/compressedDepth or camera/depth/image_raw: " in error


def test_a_bag_without_depth_is_refused_by_name(tmp_path, capsys):
    writer = SessionWriter(tmp_path / "s", "r")
    for time_ns, key, payload in all_messages():
        if key != keys.DEPTH:
            writer.add(key, payload, time_ns, 0.0)
    writer.close()
    assert run(["replay", str(tmp_path / "s")]) == 2
    assert "has no topic that ends in camera/depth" in capsys.readouterr().err


def test_what_is_no_dataset_is_said(tmp_path):
    with pytest.raises(DatasetError, match=r"TUM RGB-D has groundtruth.txt"):
        open_dataset(tmp_path)
    (tmp_path / "sequence.json").write_text("{")
    with pytest.raises(DatasetError, match="is damaged"):
        open_dataset(tmp_path)
    with pytest.raises(DatasetError, match="there is no"):
        messages_of(ReplayConfig(path=tmp_path / "none"), 0)
    with pytest.raises(ValueError, match="100 times real time"):
        ReplayConfig(path=tmp_path, rate=0.0)


@pytest.mark.slow
@pytest.mark.skipif(not KITCHEN.exists(), reason="the kitchen sequence is not at ../shared/rgbd")
def test_a_real_kitchen_is_mapped_upright_with_its_floor_at_zero():
    dataset = open_dataset(KITCHEN)
    known = json.loads((KITCHEN / "sequence.json").read_text())
    T = align_to_floor(dataset)
    assert -T[2, 3] == pytest.approx(known["floor_height_along_up_m"], abs=0.2)
    assembler, voxel_map = FrameAssembler(), VoxelMap(MapConfig(max_camera_speed_m_s=1e9), ("x",))
    taken = 0
    for sent in messages_of(ReplayConfig(path=KITCHEN, floor_m=-T[2, 3]), 10**9):
        assemble(assembler, sent.key, sent.payload)
        if sent.key == keys.COLOR:
            voxel_map.integrate(assembler.take())
            taken += 1
            if taken == 12:
                break
    voxels = SurfaceTracker(voxel_map).keyframe().index
    assert len(voxels) > 1000
    assert (voxels[:, 2] * 0.1 > -0.5).mean() > 0.98
