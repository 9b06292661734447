"""Map changes, viewpoint tree and found objects of the navigator, as ROS 2 messages."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.messages.cdr import MessageError, decode, encode, header, make, stamp_ns_of
from app.messages.keys import WORLD_FRAME
from app.messages.motion import check_positions
from ippon.planning.plan import TreeView

MAX_VOXELS: Final = 5_000_000
MAX_NODES: Final = 100_000
MAX_DETECTIONS: Final = 1000
_CLOUD: Final = "sensor_msgs/msg/PointCloud2"
_TREE: Final = "ippon_msgs/msg/ViewpointTree"
_DETECTIONS: Final = "vision_msgs/msg/Detection3DArray"
_FLOAT32: Final = 7
_UINT8: Final = 2

VOXEL_DTYPE: Final = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("rgb", "<u4"),
        ("ooi", "u1"),
        ("proximity", "u1"),
        ("level", "u1"),
        ("label", "u1"),
        ("confidence", "u1"),
        ("state", "u1"),
        ("padding", "u1", (2,)),
    ]
)
"""One voxel of `map/voxels`, 24 bytes; `rgb` is 0x00RRGGBB, declared float32 as in PCL."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VoxelCloud:
    """Surface voxels, one row each; values are absolute, so later messages replace earlier ones."""

    stamp_ns: int
    centers_world: NDArray[np.float32]
    """(M, 3) metres; the voxel's index is floor(center / voxel_size)."""
    color: NDArray[np.uint8]
    """(M, 3) RGB."""
    ooi: NDArray[np.uint8]
    """(M,) probability of the object of interest in units of 1/254, 255 where not mapped."""
    proximity: NDArray[np.uint8]
    """(M,) l(v) in units of 1/254, 255 where unlabelled."""
    level: NDArray[np.uint8]
    """(M,) `Level` of the most probable label, 255 where unlabelled."""
    label: NDArray[np.uint8]
    """(M,) row of the most probable common label, 255 for none."""
    confidence: NDArray[np.uint8]
    """(M,) probability of that label in units of 1/254."""
    removed: NDArray[np.bool_]
    """(M,) the voxel is no longer surface; its other values are undefined."""

    def indices(self, voxel_size_m: float) -> NDArray[np.int32]:
        """Return (M, 3) voxel indices."""
        return np.floor(self.centers_world / np.float32(voxel_size_m)).astype(np.int32)


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundObject:
    """A found object as a box in the world."""

    label: str
    probability: float
    center_world: tuple[float, float, float]
    size_m: tuple[float, float, float]


def encode_voxels(cloud: VoxelCloud, frame_id: str = WORLD_FRAME) -> bytes:
    """Write voxels as a PointCloud2 of `VOXEL_DTYPE`."""
    rows = np.zeros(len(cloud.centers_world), dtype=VOXEL_DTYPE)
    for axis, name in enumerate("xyz"):
        rows[name] = cloud.centers_world[:, axis]
    r, g, b = (cloud.color[:, i].astype(np.uint32) for i in range(3))
    rows["rgb"] = (r << 16) | (g << 8) | b
    for name in ("ooi", "proximity", "level", "label", "confidence"):
        rows[name] = getattr(cloud, name)
    rows["state"] = ~cloud.removed
    return encode(
        _CLOUD,
        header=header(cloud.stamp_ns, frame_id),
        height=1,
        width=len(rows),
        fields=_voxel_fields(),
        is_bigendian=False,
        point_step=VOXEL_DTYPE.itemsize,
        row_step=VOXEL_DTYPE.itemsize * len(rows),
        data=rows.view(np.uint8).reshape(-1),
        is_dense=True,
    )


def decode_voxels(payload: bytes) -> VoxelCloud:
    """Read a PointCloud2 of `VOXEL_DTYPE`.

    Raises:
        MessageError: Not such a message, of another layout, or with inconsistent sizes.
    """
    message = decode(payload, _CLOUD, max_bytes=MAX_VOXELS * VOXEL_DTYPE.itemsize + 4096)
    count = message.width * message.height
    layout = [(f.name, f.offset, f.datatype, f.count) for f in message.fields[:64]]
    expected = [(f.name, f.offset, f.datatype, f.count) for f in _voxel_fields()]
    if layout != expected or message.is_bigendian or message.point_step != VOXEL_DTYPE.itemsize:
        raise MessageError(
            f"a voxel cloud has points of {VOXEL_DTYPE.itemsize} bytes with the fields "
            f"{', '.join(f[0] for f in expected)}; got {message.point_step} bytes with "
            f"{', '.join(f[0][:20] for f in layout[:12])}"
        )
    if message.data.size != count * VOXEL_DTYPE.itemsize:
        raise MessageError(f"{count} voxels do not fit {message.data.size} bytes")
    rows = message.data.view(VOXEL_DTYPE)
    centers = np.stack([rows["x"], rows["y"], rows["z"]], axis=1)
    check_positions(centers, "voxel cloud")
    rgb = rows["rgb"]
    color = np.stack([rgb >> 16 & 255, rgb >> 8 & 255, rgb & 255], axis=1).astype(np.uint8)
    return VoxelCloud(
        stamp_ns=stamp_ns_of(message.header),
        centers_world=centers,
        color=color,
        ooi=rows["ooi"],
        proximity=rows["proximity"],
        level=rows["level"],
        label=rows["label"],
        confidence=rows["confidence"],
        removed=rows["state"] == 0,
    )


def encode_tree(tree: TreeView, stamp_ns: int, frame_id: str = WORLD_FRAME) -> bytes:
    """Write the viewpoint tree."""
    return encode(
        _TREE,
        header=header(stamp_ns, frame_id),
        positions=np.ascontiguousarray(tree.positions_world, np.float32).reshape(-1),
        parents=np.ascontiguousarray(tree.parents, np.int32),
        yaws=np.ascontiguousarray(tree.yaws_rad, np.float32),
        tilts=np.ascontiguousarray(tree.tilts_rad, np.float32),
        gains=np.ascontiguousarray(tree.gains, np.float32),
        terminations=np.ascontiguousarray(tree.terminations, np.float32),
        path_costs=np.ascontiguousarray(tree.path_costs_s, np.float32),
        levels=np.ascontiguousarray(tree.levels, np.uint8),
        kinds=np.ascontiguousarray(tree.kinds, np.uint8),
    )


def decode_tree(payload: bytes) -> tuple[int, TreeView]:
    """Read a viewpoint tree and its stamp in nanoseconds.

    Raises:
        MessageError: Not such a message, arrays of different lengths, or a parent out of range.
    """
    message = decode(payload, _TREE, max_bytes=64 * MAX_NODES)
    n = len(message.parents)
    names = ("yaws", "tilts", "gains", "terminations", "path_costs", "levels", "kinds")
    wrong = [name for name in names if len(getattr(message, name)) != n]
    if len(message.positions) != 3 * n:
        wrong.append("positions")
    if wrong or n > MAX_NODES:
        raise MessageError(f"a tree of {n} nodes (at most {MAX_NODES}) with other {wrong}")
    if n and not (message.parents.min() >= -1 and message.parents.max() < n):
        raise MessageError(f"a tree of {n} nodes has parents out of range")
    positions = message.positions.reshape(-1, 3)
    check_positions(positions, "viewpoint tree")
    return stamp_ns_of(message.header), TreeView(
        positions_world=positions,
        parents=message.parents,
        yaws_rad=message.yaws,
        tilts_rad=message.tilts,
        gains=message.gains,
        terminations=message.terminations,
        path_costs_s=message.path_costs,
        levels=message.levels,
        kinds=message.kinds,
    )


def encode_found_objects(
    detections: Iterable[FoundObject], stamp_ns: int, frame_id: str = WORLD_FRAME
) -> bytes:
    """Write a Detection3DArray."""
    top = header(stamp_ns, frame_id)
    return encode(
        _DETECTIONS, header=top, detections=[_detection_message(d, top) for d in detections]
    )


def decode_found_objects(payload: bytes) -> tuple[int, tuple[FoundObject, ...]]:
    """Read a Detection3DArray and its stamp in nanoseconds.

    Raises:
        MessageError: Not such a message, too many, or numbers that are not finite.
    """
    message = decode(payload, _DETECTIONS, max_bytes=2**20)
    if len(message.detections) > MAX_DETECTIONS:
        raise MessageError(f"{len(message.detections)} detections; at most {MAX_DETECTIONS}")
    return stamp_ns_of(message.header), tuple(_read_detection(d) for d in message.detections)


def _voxel_fields() -> list[Any]:
    names = [str(name) for name in VOXEL_DTYPE.names or () if name != "padding"]
    layout: Any = VOXEL_DTYPE.fields
    return [
        make(
            "sensor_msgs/msg/PointField",
            name=name,
            offset=layout[name][1],
            datatype=_FLOAT32 if layout[name][0].itemsize == 4 else _UINT8,
            count=1,
        )
        for name in names
    ]


def _detection_message(detection: FoundObject, top: Any) -> Any:
    position = make(
        "geometry_msgs/msg/Point", **dict(zip("xyz", detection.center_world, strict=True))
    )
    pose = make(
        "geometry_msgs/msg/Pose",
        position=position,
        orientation=make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
    )
    result = make(
        "vision_msgs/msg/ObjectHypothesisWithPose",
        hypothesis=make(
            "vision_msgs/msg/ObjectHypothesis",
            class_id=detection.label,
            score=float(detection.probability),
        ),
        pose=make(
            "geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=np.zeros(36, np.float64)
        ),
    )
    size = make("geometry_msgs/msg/Vector3", **dict(zip("xyz", detection.size_m, strict=True)))
    return make(
        "vision_msgs/msg/Detection3D",
        header=top,
        results=[result],
        bbox=make("vision_msgs/msg/BoundingBox3D", center=pose, size=size),
        id=detection.label,
    )


def _read_detection(message: Any) -> FoundObject:
    center, size = message.bbox.center.position, message.bbox.size
    numbers = (center.x, center.y, center.z, size.x, size.y, size.z)
    check_positions(np.array(numbers), "detection")
    if len(message.results) != 1:
        raise MessageError(f"a detection has one result; got {len(message.results)}")
    hypothesis = message.results[0].hypothesis
    if not math.isfinite(hypothesis.score):
        raise MessageError("the score of a detection is not finite")
    return FoundObject(
        label=hypothesis.class_id,
        probability=hypothesis.score,
        center_world=(center.x, center.y, center.z),
        size_m=(size.x, size.y, size.z),
    )
