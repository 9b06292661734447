"""A short made-up session with every kind of message that a robot and a navigator send."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from mcap.writer import Writer

from app.messages import keys
from app.messages.control import encode
from app.messages.depth.depth_images import encode_depth
from app.messages.images import encode_camera, encode_color
from app.messages.keys import CAMERA_FRAME
from app.messages.memory import MapAlignment
from app.messages.motion import (
    StampedPath,
    StampedTwist,
    encode_flag,
    encode_number,
    encode_path,
    encode_transforms,
    encode_twist,
    robot_transforms,
)
from app.messages.perception.heatmaps import encode_heatmap
from app.messages.scene import (
    FoundObject,
    VoxelCloud,
    encode_found_objects,
    encode_tree,
    encode_voxels,
)
from app.messages.status import (
    Event,
    FindReport,
    GoalStatus,
    LevelRow,
    LevelTable,
    Status,
    Timings,
)
from app.recording.writing.limits import RecordingLimits
from app.recording.writing.session import Session
from ippon.camera import PinholeCamera
from ippon.geometry import base_pose
from ippon.observation import Heatmap
from ippon.planning.plan import TreeView
from ippon.robot import ZED
from tests.app.messages.robot_messages import odometry

START_NS = 1_750_000_000_000_000_000
HZ = 5
VOXEL_M = 0.1
LABELS = ("wall", "floor", "sofa")
CAMERA = PinholeCamera.from_horizontal_fov(64, 40, 1.2)


def cloud_of(count, stamp_ns):
    """Return voxels of a growing floor; the last ones look like the object."""
    k = np.arange(count)
    ooi = np.full(count, 10, np.uint8)
    ooi[-3:] = 230
    return VoxelCloud(
        stamp_ns=stamp_ns,
        centers_world=np.stack([k % 40, k // 40, 0 * k], 1).astype(np.float32) * VOXEL_M + 0.05,
        color=np.stack([k % 256, k // 7 % 256, 0 * k + 90], 1).astype(np.uint8),
        ooi=ooi,
        proximity=(k % 250).astype(np.uint8),
        level=(k % 4).astype(np.uint8),
        label=(k % 3).astype(np.uint8),
        confidence=np.full(count, 200, np.uint8),
        removed=np.zeros(count, bool),
    )


def rows_of(cloud, rows):
    """Return some rows of a cloud."""
    names = [f.name for f in dataclasses.fields(cloud) if f.name != "stamp_ns"]
    return dataclasses.replace(cloud, **{name: getattr(cloud, name)[rows] for name in names})


def tree_of(count):
    """Return a straight tree."""
    k = np.arange(count)
    return TreeView(
        positions_world=np.stack([k * 0.3, 0 * k, 0 * k], 1).astype(np.float32),
        parents=(k - 1).astype(np.int32),
        yaws_rad=np.zeros(count, np.float32),
        tilts_rad=np.zeros(count, np.float32),
        gains=np.linspace(0, 5, count).astype(np.float32),
        terminations=np.zeros(count, np.float32),
        path_costs_s=np.linspace(0, 5, count).astype(np.float32),
        levels=np.zeros(count, np.uint8),
        kinds=np.zeros(count, np.uint8),
    )


def status_of(tick, outcome="active"):
    """Return the status of one tick."""
    goal = GoalStatus(goal_id=1, object="hat", context="on the sofa", outcome=outcome)
    find = FindReport(
        goal_id=1, object="hat", position_world=(1.0, 0.5, 0.1), size_m=(0.3, 0.3, 0.2),
        probability=0.9, voxels=20, box_px=(10, 10, 30, 30),
    )  # fmt: skip
    return Status(
        robot="home/3", version="0.1.0", stamp_ns=tick * 10**9 // HZ, wall_ns=START_NS,
        state="found" if outcome == "found" else "searching", why="going to the sofa", goal=goal,
        queue=[], history=[], find=find if outcome == "found" else None, streams=[],
        timings=Timings(step_ms=80.0), frames=tick, elapsed_s=tick / HZ,
        path_length_m=tick * 0.02, best_ooi=min(0.95, tick / 20), explored_m2=tick * 0.3,
        surface_voxels=tick * 40, voxel_size_m=VOXEL_M, map_revision=tick,
    )  # fmt: skip


def table_of(level="near"):
    """Return the proximity table."""
    rows = [LevelRow(label=label, level=level, reason="made up") for label in LABELS]
    return LevelTable(
        goal_id=1, object="hat", context="on the sofa", provider="embedded", elapsed_ms=1.0,
        rows=rows,
    )  # fmt: skip


def messages_of(tick, ticks):
    """Yield (key, payload) of one tick in the order of the wire."""
    stamp = tick * 10**9 // HZ
    if tick == 0:
        yield keys.CONFIGURATION, b'{"robot":"home/3"}'
        yield keys.EVENT, encode(Event(stamp_ns=stamp, kind="goal_set", text="searching for hat"))
        yield keys.LEVELS, encode(table_of())
    if tick == 15:
        yield keys.LEVELS, encode(table_of("certain"))
    T_world_base = base_pose(0.02 * tick, 0.5, 0.0, 0.1)
    yield (
        keys.TF,
        encode_transforms(robot_transforms(stamp, T_world_base, ZED.T_base_camera(-0.3))),
    )
    yield keys.CAMERA_INFO, encode_camera(CAMERA, stamp, CAMERA_FRAME)
    yield keys.CONTACT, encode_flag(False)
    rng = np.random.default_rng(tick)
    probabilities = rng.integers(1, 250, (10, 16, 4)).astype(np.uint8)
    heatmap = Heatmap(labels=LABELS, ooi="hat", probabilities=probabilities)
    yield keys.HEATMAP, encode_heatmap(heatmap, stamp, CAMERA_FRAME)
    depth = np.full((40, 64), 2.0, np.float32)
    yield keys.DEPTH, encode_depth(depth, stamp, CAMERA_FRAME)
    color = np.full((40, 64, 3), (tick * 5) % 256, np.uint8)
    yield keys.COLOR, encode_color(color, stamp, CAMERA_FRAME)
    twist = StampedTwist(stamp_ns=stamp, linear_m_s=0.1, yaw_rate_rad_s=0.0)
    yield keys.CMD_TILT, encode_number(-0.3)
    yield keys.CMD_VEL, encode_twist(twist)
    cloud = cloud_of(40 * (tick + 1), stamp)
    yield keys.MAP_VOXELS, encode_voxels(rows_of(cloud, slice(-43, None)))
    if tick % 10 == 9:
        yield keys.MAP_KEYFRAME, encode_voxels(dataclasses.replace(cloud, stamp_ns=stamp + 1))
    yield keys.PLAN_TREE, encode_tree(tree_of(5 + tick), stamp)
    path = np.array([[0.02 * tick, 0.5, 0.0], [1.0, 0.5, 0.0]])
    yield keys.PLAN_PATH, encode_path(StampedPath(stamp_ns=stamp, points_world=path))
    hat = FoundObject(
        label="hat", probability=0.8, center_world=(1.0, 0.5, 0.1), size_m=(0.3, 0.3, 0.2)
    )
    yield keys.DETECTIONS, encode_found_objects([hat] if tick > 10 else [], stamp)
    over = tick == ticks - 1
    if over:
        yield keys.EVENT, encode(Event(stamp_ns=stamp, kind="found", text="found the hat"))
    yield keys.STATUS, encode(status_of(tick, "found" if over else "active"))


def all_messages(seconds=6.0):
    """Return [(time_ns, key, payload)] of a whole session."""
    ticks = round(seconds * HZ)
    return [
        (START_NS + tick * 10**9 // HZ + n * 1000, key, payload)
        for tick in range(ticks)
        for n, (key, payload) in enumerate(messages_of(tick, ticks))
    ]


def alignment_at(tick, position_map, yaw_rad=0.0):
    """Return (time_ns, key, payload) of an alignment a little after the pose of a tick."""
    aligned = MapAlignment(position_map=position_map, yaw_rad=yaw_rad)
    return START_NS + tick * 10**9 // HZ + 500, keys.MAP_ALIGNMENT, encode(aligned)


def write_session(root, seconds=6.0, *, end=True, more=()):
    """Write a session, with more messages if need be; return it."""
    session = Session(root, "home/3", RecordingLimits(min_free_gb=0.0), START_NS)
    for time_ns, key, payload in sorted([*all_messages(seconds), *more], key=lambda one: one[0]):
        session.add(key, payload, time_ns, (time_ns - START_NS) * 1e-9)
    if end:
        session.close()
    return session


def write_bag(path, messages):
    """Write an MCAP file of another program, of (topic, key, time_ns, payload); return its path."""
    channels = {}
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        for topic, key, time_ns, payload in messages:
            if topic not in channels:
                schema = writer.register_schema(keys.ROS_TYPES[key], "ros2msg", b"")
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channels[topic], time_ns, payload, time_ns)
        writer.finish()
    return path


def with_two_odometries():
    """Return the messages of a camera with two odometries and without tf, for `write_bag`."""
    camera = [
        (f"/{key}", key, time_ns, payload)
        for time_ns, key, payload in all_messages()
        if key in (keys.COLOR, keys.DEPTH, keys.CAMERA_INFO)
    ]
    poses = [
        (f"/{source}/odom", keys.ODOM, time_ns, odometry(time_ns - START_NS, x, 0.0, 0.0))
        for topic, _, time_ns, _ in camera
        if topic == f"/{keys.COLOR}"
        for source, x in (("visual", 1.0), ("wheels", 2.0))
    ]
    return [*camera, *poses]


@pytest.fixture
def made_up():
    """The session, as functions."""
    return SimpleNamespace(
        all_messages=all_messages,
        write_session=write_session,
        alignment_at=alignment_at,
        messages_of=messages_of,
        status_of=status_of,
        cloud_of=cloud_of,
        tree_of=tree_of,
        START_NS=START_NS,
        HZ=HZ,
    )


@pytest.fixture
def session_folder(tmp_path):
    """Folder of a whole session of six seconds."""
    return write_session(tmp_path).writer.folder
