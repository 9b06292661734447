"""What Foxglove is served: the topics of a recording, with JSON as JSON and the whole map."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Final

import msgspec
import numpy as np

from app.messages import keys, status
from app.messages.body import BodyConfiguration
from app.messages.depth.depth_images import decode_depth, encode_depth_raw
from app.messages.driving import PaintedRegions
from app.messages.keys import WORLD_FRAME
from app.messages.motion import StampedTransform, decode_transforms, encode_transforms
from app.messages.recording import RecordingStatus
from app.messages.scene import VoxelCloud, encode_voxels
from app.recording.channels import MARKERS_KEY, MARKERS_TYPE
from app.view.floor_height import layer_below
from app.view.model.attribute_colors import AttributeColor, attribute_colors
from app.view.model.scene_model import SceneModel
from ippon.geometry import Float64Array

CLOUDS: Final[dict[str, AttributeColor]] = {
    "map/colors": "camera",
    "map/probability": "ooi",
    "map/proximity": "proximity",
}
"""Keys of the whole map, in the colours of the console."""
BODY_KEY: Final = "robot/body"
LOG_KEY: Final = "log"

FORWARDED: Final = (
    keys.COLOR, keys.CAMERA_INFO, keys.TF, keys.TF_STATIC, keys.PLAN_PATH, keys.PLAN_TREE,
    keys.DETECTIONS,
)  # fmt: skip
"""ROS messages that are passed on as received."""
JSON_TYPES: Final[dict[str, type[msgspec.Struct]]] = {
    keys.STATUS: status.Status,
    keys.EVENT: status.Event,
    keys.LEVELS: status.LevelTable,
    keys.FAR_EVIDENCE: status.FarEvidenceCells,
    keys.PAINTED: PaintedRegions,
    keys.CONFIGURATION: BodyConfiguration,
    keys.RECORDING: RecordingStatus,
}
"""JSON messages that are passed on as received."""
ROS_TYPES: Final[dict[str, str]] = {
    **{key: keys.ROS_TYPES[key] for key in (*FORWARDED, keys.DEPTH_RAW)},
    **dict.fromkeys(CLOUDS, keys.ROS_TYPES[keys.MAP_KEYFRAME]),
    MARKERS_KEY: MARKERS_TYPE,
    BODY_KEY: MARKERS_TYPE,
}
"""ROS type of each served topic that has one."""
KEPT: Final = frozenset(
    {
        keys.CAMERA_INFO, keys.TF_STATIC, keys.PLAN_PATH, keys.PLAN_TREE, keys.DETECTIONS,
        *JSON_TYPES, BODY_KEY,
    }
) - {keys.EVENT}  # fmt: skip
"""Topics whose last message a client gets that subscribes later."""


def whole_maps(
    scene: SceneModel, shown: Iterable[str], ceiling_m: float, stamp_ns: int
) -> dict[str, bytes]:
    """Write the surface voxels below a ceiling, for some of `CLOUDS`; none before a status."""
    voxel_m = scene.voxel_size_m
    if voxel_m is None:
        return {}
    indices, attributes = scene.voxels.all_voxels()
    low = indices[:, 2] < layer_below(ceiling_m, scene.floor_z_m, voxel_m)
    indices, attributes = indices[low], attributes[low]
    cloud = VoxelCloud(
        stamp_ns=stamp_ns,
        centers_world=((indices + 0.5) * voxel_m).astype(np.float32),
        color=attributes[:, :3],
        ooi=attributes[:, 3],
        proximity=attributes[:, 4],
        level=attributes[:, 5],
        label=attributes[:, 6],
        confidence=attributes[:, 7],
        removed=np.zeros(len(indices), np.bool_),
    )
    colored = {
        key: attribute_colors(indices, attributes, voxel_m, CLOUDS[key], scene.floor_z_m)
        for key in shown
    }
    return {key: encode_voxels(replace(cloud, color=color)) for key, color in colored.items()}


def depth_image(payload: bytes) -> bytes:
    """Return compressed depth as an Image, which Foxglove can show.

    Raises:
        MessageError: It cannot be decoded.
    """
    image = decode_depth(payload)
    return encode_depth_raw(image.depth, image.stamp_ns, image.frame_id)


def aligned_transforms(payload: bytes, T_map_world: Float64Array) -> bytes:
    """Return transforms with those from the world frame moved into the frame of the map.

    Raises:
        MessageError: They cannot be decoded.
    """
    return encode_transforms(
        StampedTransform(
            stamp_ns=link.stamp_ns,
            parent=link.parent,
            child=link.child,
            T_parent_child=T_map_world @ link.T_parent_child,
        )
        if link.parent == WORLD_FRAME
        else link
        for link in decode_transforms(payload)
    )
