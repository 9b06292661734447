"""Viewpoint tree, finds and the robot's body as markers, for viewers without our types."""

from typing import Any, Final

import numpy as np

from app.messages.body import BodyProfile
from app.messages.cdr import encode, header, make
from app.messages.keys import WORLD_FRAME
from app.messages.scene import FoundObject
from app.recording.channels import MARKERS_TYPE
from ippon.planning.plan import TreeView
from ippon.vocabulary import in_words

_LINES: Final = 5
_CUBE: Final = 1
_SPHERE: Final = 2
_TEXT: Final = 9
_ADD: Final = 0
_LIFT_M: Final = 0.1
_WAY: Final = (0.35, 0.5, 0.95)
_FIND: Final = (0.0, 0.62, 0.45)
_ROBOT: Final = (0.34, 0.71, 0.91)
_LIFETIME_S: Final = 3
"""A marker expires after it if the next message has fewer."""
_NAME_M: Final = 0.2


def encode_markers(tree: TreeView | None, finds: tuple[FoundObject, ...], stamp_ns: int) -> bytes:
    """Write the edges of the tree as lines and each find as a box with its name.

    Args:
        tree: The tree; None before the first.
        finds: Finds and candidates.
        stamp_ns: Robot time.
    """
    markers = [] if tree is None else [_edges(tree, stamp_ns)]
    markers += [_box(n, find, stamp_ns) for n, find in enumerate(finds)]
    markers += [_name(n, find, stamp_ns) for n, find in enumerate(finds)]
    return encode(MARKERS_TYPE, markers=markers)


def encode_body(body: BodyProfile, frame_id: str, stamp_ns: int) -> bytes:
    """Write the spheres of a robot's body.

    Args:
        body: The body.
        frame_id: Frame of its base, in which viewers keep it.
        stamp_ns: Robot time.
    """
    markers = [
        _marker(
            "body",
            n,
            _SPHERE,
            stamp_ns,
            at=(sphere.x_m, sphere.y_m, sphere.z_m),
            scale=(2 * sphere.radius_m, 2 * sphere.radius_m, 2 * sphere.radius_m),
            rgb=_ROBOT,
            frame_id=frame_id,
            lifetime_s=0,
        )
        for n, sphere in enumerate(body.spheres)
    ]
    return encode(MARKERS_TYPE, markers=markers)


def _edges(tree: TreeView, stamp_ns: int) -> Any:
    linked = np.flatnonzero(tree.parents >= 0)
    ends = np.stack([linked, tree.parents[linked]], axis=1).reshape(-1)
    points = [_point(*p) for p in (tree.positions_world[ends] + [0.0, 0.0, _LIFT_M]).tolist()]
    return _marker("tree", 0, _LINES, stamp_ns, points=points, scale=(0.02, 0.0, 0.0), rgb=_WAY)


def _box(number: int, find: FoundObject, stamp_ns: int) -> Any:
    return _marker(
        "finds", number, _CUBE, stamp_ns, at=find.center_world, scale=find.size_m, rgb=_FIND
    )


def _name(number: int, find: FoundObject, stamp_ns: int) -> Any:
    x, y, z = find.center_world
    return _marker(
        "names",
        number,
        _TEXT,
        stamp_ns,
        at=(x, y, z + 0.5 * find.size_m[2] + _NAME_M),
        scale=(0.0, 0.0, _NAME_M),
        rgb=_FIND,
        text=f"{in_words(find.label)} {find.probability:.0%}",
    )


def _marker(
    namespace: str,
    number: int,
    kind: int,
    stamp_ns: int,
    *,
    scale: tuple[float, float, float],
    rgb: tuple[float, float, float],
    at: tuple[float, float, float] = (0.0, 0.0, 0.0),
    points: list[Any] | None = None,
    text: str = "",
    frame_id: str = WORLD_FRAME,
    lifetime_s: int = _LIFETIME_S,
) -> Any:
    r, g, b = rgb
    pose = make(
        "geometry_msgs/msg/Pose",
        position=_point(*at),
        orientation=make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
    )
    return make(
        "visualization_msgs/msg/Marker",
        header=header(stamp_ns, frame_id),
        ns=namespace,
        id=number,
        type=kind,
        action=_ADD,
        pose=pose,
        scale=make("geometry_msgs/msg/Vector3", x=scale[0], y=scale[1], z=scale[2]),
        color=make("std_msgs/msg/ColorRGBA", r=r, g=g, b=b, a=0.8),
        lifetime=make("builtin_interfaces/msg/Duration", sec=lifetime_s, nanosec=0),
        frame_locked=frame_id != WORLD_FRAME,
        points=points or [],
        colors=[],
        texture_resource="",
        texture=make(
            "sensor_msgs/msg/CompressedImage",
            header=header(stamp_ns, ""),
            format="",
            data=np.empty(0, np.uint8),
        ),
        uv_coordinates=[],
        text=text,
        mesh_resource="",
        mesh_file=make("visualization_msgs/msg/MeshFile", filename="", data=np.empty(0, np.uint8)),
        mesh_use_embedded_materials=False,
    )


def _point(x: float, y: float, z: float) -> Any:
    return make("geometry_msgs/msg/Point", x=x, y=y, z=z)
