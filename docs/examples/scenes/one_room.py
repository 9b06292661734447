"""A source of scenes for `ippon demo --home studio:6`: one room, as wide as you say."""

import numpy as np

from ippon.errors import SceneError
from ippon.simulation.scene import Instance, Scene, StartPose

CORNERS = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)])
FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7], [0, 5, 1], [0, 4, 5],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


def load(text: str) -> Scene:
    """Return a room of TEXT metres width, with a table and a plant on it."""
    try:
        width = float(text or "5")
    except ValueError as error:
        raise SceneError(f"studio:WIDTH takes metres; got {text!r}") from error
    boxes = [
        ("floor", (-0.1, -0.1, -0.1), (width + 0.1, 4.1, 0.0)),
        ("wall", (-0.1, -0.1, 0.0), (0.0, 4.1, 2.5)),
        ("wall", (width, -0.1, 0.0), (width + 0.1, 4.1, 2.5)),
        ("wall", (0.0, -0.1, 0.0), (width, 0.0, 2.5)),
        ("wall", (0.0, 4.0, 0.0), (width, 4.1, 2.5)),
        ("table", (width - 1.5, 2.8, 0.0), (width - 0.5, 3.6, 0.7)),
        ("plant", (width - 1.2, 3.0, 0.7), (width - 0.9, 3.3, 1.1)),
    ]
    vertices = np.concatenate([np.where(CORNERS, high, low) for _, low, high in boxes])
    owner = np.repeat(np.arange(len(boxes)), len(FACES))
    return Scene(
        name=f"studio {width:g} m",
        source="ippon-example-scenes",
        instances=tuple(
            Instance(node=f"{name}.{k}", category=name, label=name, aabb_min=low, aabb_max=high)
            for k, (name, low, high) in enumerate(boxes)
        ),
        start_poses=(StartPose(x=1.0, y=1.0, z=0.0, yaw=0.0),),
        rooms=(),
        vertices=vertices.astype(np.float32),
        faces=(np.tile(FACES, (len(boxes), 1)) + 8 * owner[:, None]).astype(np.int32),
        face_instance=owner.astype(np.int32),
        face_colors=(60 + 25 * owner[:, None] * np.array([1, 1, 1])).astype(np.uint8),
    )
