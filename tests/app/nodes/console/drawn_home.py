"""A small furnished home, and what a robot and a navigator would say of it."""

import dataclasses
import itertools
import math
import time

import numpy as np

from app.messages.images import encode_color
from app.messages.memory import RememberedThing, Room, RoomsReply
from app.messages.scene import VoxelCloud
from app.messages.status import (
    FindReport,
    GoalStatus,
    LevelRow,
    LevelTable,
    Status,
    StreamStatus,
    Timings,
)
from ippon.geometry import base_pose
from ippon.guidance.levels import Level
from ippon.planning.plan import NodeKind, TreeView
from ippon.robot import ZED

VOXEL_M = 0.1
LABELS = ("wall", "floor", "sofa", "table", "bed", "plant")
LEVELS = {
    "wall": "far",
    "floor": "far",
    "sofa": "certain",
    "table": "near",
    "bed": "average",
    "plant": "average",
}
COLORS = {
    "wall": (214, 208, 196),
    "floor": (164, 124, 84),
    "sofa": (74, 104, 150),
    "table": (120, 82, 52),
    "bed": (196, 190, 205),
    "plant": (66, 120, 62),
}


def _box(lo, hi):
    """Surface voxels of a box given in voxels."""
    grid = np.stack(
        np.meshgrid(*[np.arange(a, b) for a, b in zip(lo, hi, strict=True)], indexing="ij"), -1
    ).reshape(-1, 3)
    edge = (grid == np.array(lo)) | (grid == np.array(hi) - 1)
    return grid[edge.any(axis=1)]


def home_voxels():
    """Return (N, 3) indices and (N,) labels of an 8 m by 6 m flat with a dividing wall."""
    parts = [
        ("floor", np.array(list(itertools.product(range(80), range(60), [-1])))),
        ("wall", _box((0, -1, 0), (80, 0, 26))),
        ("wall", _box((0, 60, 0), (80, 61, 26))),
        ("wall", _box((-1, 0, 0), (0, 60, 26))),
        ("wall", _box((80, 0, 0), (81, 60, 26))),
        ("wall", _box((40, 0, 0), (41, 22, 26))),
        ("wall", _box((40, 34, 0), (41, 60, 26))),
        ("sofa", _box((8, 50, 0), (30, 58, 4))),
        ("sofa", _box((8, 56, 4), (30, 58, 8))),
        ("table", _box((14, 36, 3), (26, 44, 5))),
        ("bed", _box((56, 40, 0), (76, 58, 5))),
        ("plant", _box((72, 4, 0), (76, 8, 12))),
        ("table", _box((50, 2, 0), (60, 10, 8))),
    ]
    indices = np.concatenate([voxels for _, voxels in parts])
    labels = np.concatenate(
        [np.full(len(voxels), LABELS.index(name), np.uint8) for name, voxels in parts]
    )
    return indices, labels


def cloud_of(indices, labels, stamp_ns, *, hat=False):
    """Pack voxels as the navigator does."""
    n = len(indices)
    names = np.array(LABELS)[labels]
    rng = np.random.default_rng(1)
    color = np.array([COLORS[name] for name in LABELS], np.int16)[labels]
    color = np.clip(color + rng.integers(-8, 9, (n, 1)), 0, 255).astype(np.uint8)
    level = np.array([Level.parse(LEVELS[name]) for name in LABELS], np.uint8)[labels]
    centers = ((indices + 0.5) * VOXEL_M).astype(np.float32)
    distance = np.linalg.norm(centers - np.array([2.4, 5.2, 0.6]), axis=1)
    ooi = np.where(names == "sofa", 60, 4).astype(np.uint8)
    if hat:
        ooi = np.maximum(ooi, (254 * np.exp(-((distance / 0.35) ** 2))).astype(np.uint8))
    return VoxelCloud(
        stamp_ns=stamp_ns,
        centers_world=centers,
        color=color,
        ooi=ooi,
        proximity=(level * 60).astype(np.uint8),
        level=level,
        label=labels,
        confidence=np.full(n, 200, np.uint8),
        removed=np.zeros(n, bool),
    )


def tree_of(rng, count=60):
    """Grow a random tree over the flat."""
    positions = [(2.0, 2.0, 0.0)]
    parents = [-1]
    while len(positions) < count:
        p = np.array([rng.uniform(0.5, 7.5), rng.uniform(0.5, 5.5), 0.0])
        distance = [math.dist(p, q) for q in positions]
        near = int(np.argmin(distance))
        if 0.3 < distance[near] < 1.2:
            positions.append(tuple(p.tolist()))
            parents.append(near)
    n = len(positions)
    points = np.array(positions, np.float32)
    gains = (40 * np.exp(-np.linalg.norm(points[:, :2] - [2.4, 5.2], axis=1))).astype(np.float32)
    kinds = np.full(n, NodeKind.EXPLORING, np.uint8)
    kinds[gains < 0.6] = NodeKind.MINIMAL
    kinds[np.argsort(gains)[-3:]] = NodeKind.TERMINATING
    return TreeView(
        positions_world=points,
        parents=np.array(parents, np.int32),
        yaws_rad=rng.uniform(-3, 3, n).astype(np.float32),
        tilts_rad=np.zeros(n, np.float32),
        gains=gains,
        terminations=np.zeros(n, np.float32),
        path_costs_s=np.linspace(0, 20, n).astype(np.float32),
        levels=np.zeros(n, np.uint8),
        kinds=kinds,
    )


def status_of(state="searching", **changes):
    """A plausible status."""
    goal = GoalStatus(goal_id=1, object="hat", context="I left it on the sofa", outcome="active")
    status = {
        "robot": "ippon",
        "version": "0.1.0",
        "stamp_ns": 10_000_000_000,
        "wall_ns": time.time_ns(),
        "state": state,
        "why": "going to the viewpoint by the sofa (certain): gain 41, 6.2 s away",
        "goal": goal,
        "queue": [],
        "history": [],
        "find": None,
        "streams": [StreamStatus(name="camera/color", age_s=0.1, rate_hz=5.0)],
        "timings": Timings(step_ms=92.0, map_ms=38.0, plan_ms=41.0, frame_age_ms=128.0),
        "frames": 50,
        "elapsed_s": 12.4,
        "path_length_m": 4.2,
        "best_ooi": 0.41,
        "explored_m2": 31.0,
        "surface_voxels": 12_000,
        "voxel_size_m": VOXEL_M,
        "map_revision": 50,
    }
    return Status(**(status | changes))


def find_of():
    """The hat on the sofa."""
    return FindReport(
        goal_id=1,
        object="hat",
        position_world=(2.4, 5.2, 0.6),
        size_m=(0.3, 0.3, 0.2),
        probability=0.93,
        voxels=24,
        box_px=(150, 90, 240, 160),
    )


def proximity_of():
    """The levels of the six labels."""
    rows = [
        LevelRow(label=label, level=level, reason=f"a hat and a {label}")
        for label, level in LEVELS.items()
    ]
    return LevelTable(
        goal_id=1,
        object="hat",
        context="I left it on the sofa",
        provider="embedded common sense",
        elapsed_ms=3.0,
        rows=rows,
        prompt="I am a robot, and I am to find an object: hat.\n\nRate every category.",
        reply="sofa: <b>hats</b> are left there. CERTAIN",
    )


def things_of():
    """What the robot remembers of the flat."""
    boxes = {
        "sofa": ((1.9, 5.4, 0.4), (2.2, 0.8, 0.8)),
        "table": ((2.0, 4.0, 0.4), (1.2, 0.8, 0.2)),
        "bed": ((6.6, 4.9, 0.25), (2.0, 1.8, 0.5)),
        "kitchen_counter": ((5.5, 0.6, 0.4), (1.0, 0.8, 0.8)),
        "plant": ((7.4, 0.6, 0.6), (0.4, 0.4, 1.2)),
    }
    return [
        RememberedThing(
            instance_id=number,
            label=label,
            probability=0.9,
            alternatives=[("armchair", 0.05)],
            source="map",
            position_world=position,
            size_m=size,
            room="living room" if position[0] < 4.0 else "bedroom",
            first_seen_ns=1,
            last_seen_ns=time.time_ns(),
            gone_ns=0,
            has_picture=label != "plant",
        )
        for number, (label, (position, size)) in enumerate(boxes.items(), start=1)
    ]


def rooms_of(name=""):
    """The two rooms of the flat; the second has no clear type."""
    return RoomsReply(
        rooms=[
            Room(x_m=2.0, y_m=2.2, area_m2=23.9, kind="living room", name=name),
            Room(x_m=6.0, y_m=2.6, area_m2=23.4, kind="", name=""),
        ]
    )


def camera_image(tick=0, size=(400, 250), stamp_ns=0):
    """A drawn camera picture: a sofa with a hat, encoded as JPEG in a CompressedImage."""
    width, height = size
    image = np.zeros((height, width, 3), np.uint8)
    image[:130] = (206, 200, 188)
    image[130:] = (150, 114, 78)
    image[100:190, 90:330] = (74, 104, 150)
    image[95:150, 160:230] = (120, 30, 40)
    image[:, (tick * 7) % width] = 255
    return encode_color(image, stamp_ns, "camera_color_optical_frame")


def robot_pose(tick):
    """Drive from the door towards the sofa."""
    s = min(tick * 0.02, 1.0)
    x, y = 4.6 - 1.5 * s, 2.6 + 2.0 * s
    T_world_base = base_pose(x, y, 0.0, math.radians(120.0))
    return T_world_base, ZED.T_base_camera(-0.35)


def cloud_rows(cloud, rows):
    """Return some rows of a cloud."""
    arrays = {
        field.name: getattr(cloud, field.name)[rows]
        for field in dataclasses.fields(cloud)
        if field.name != "stamp_ns"
    }
    return dataclasses.replace(cloud, **arrays)
