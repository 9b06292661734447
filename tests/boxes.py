"""Scenes made of boxes, for tests that must know every distance by hand."""

import numpy as np

from ippon.simulation.scene import Instance, Scene, StartPose

_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7], [0, 5, 1], [0, 4, 5],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


def boxes_scene(boxes, starts=((1.0, 1.0),), name="boxes") -> Scene:
    """Make a scene of (category, label, low corner, high corner)."""
    vertices, instances = [], []
    for k, (category, label, low, high) in enumerate(boxes):
        pick = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], dtype=bool)
        vertices.append(np.where(pick, high, low))
        instances.append(
            Instance(
                node=f"{category}.{k}", category=category, label=label, aabb_min=low, aabb_max=high
            )
        )
    owner = np.repeat(np.arange(len(boxes)), len(_FACES))
    return Scene(
        name=name,
        source="test",
        instances=tuple(instances),
        start_poses=tuple(StartPose(x=x, y=y, z=0.0, yaw=0.0) for x, y in starts),
        rooms=(),
        vertices=np.concatenate(vertices).astype(np.float32),
        faces=(np.tile(_FACES, (len(boxes), 1)) + 8 * owner[:, None]).astype(np.int32),
        face_instance=owner.astype(np.int32),
        face_colors=np.full((len(owner), 3), 128, np.uint8),
    )
