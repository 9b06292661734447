"""Small scenes of boxes, whose truth is known, and the shared homes where the checkout has them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.simulation.scene import Instance, Scene, StartPose
from tests.locations import SHARED

_QUADS = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)
_FACES = np.concatenate([_QUADS[:, [0, 1, 2]], _QUADS[:, [0, 2, 3]]])

Box = tuple[str, str, tuple[float, float, float], tuple[float, float, float]]


def _make(boxes: list[Box], start: StartPose | None = None, **extra: object) -> Scene:
    """Make a scene of boxes `(category, label, low corner, high corner)`."""
    vertices, faces, owners, instances = [], [], [], []
    for k, (category, label, low, high) in enumerate(boxes):
        pick = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)], dtype=bool)
        vertices.append(np.where(pick, high, low))
        faces.append(_FACES + 8 * k)
        owners.append(np.full(len(_FACES), k))
        instances.append(
            Instance(
                node=f"{category}.{k}", category=category, label=label, aabb_min=low, aabb_max=high
            )
        )
    count = len(boxes) * len(_FACES)
    colors = np.random.default_rng(0).integers(40, 220, (len(boxes), 3))
    fields = {
        "name": "boxes",
        "source": "test",
        "instances": tuple(instances),
        "start_poses": (start or StartPose(x=1.0, y=1.0, z=0.0, yaw=0.0),),
        "rooms": (),
        "vertices": np.concatenate(vertices).astype(np.float32),
        "faces": np.concatenate(faces).astype(np.int32),
        "face_instance": np.concatenate(owners).astype(np.int32),
        "face_colors": np.repeat(colors, len(_FACES), axis=0).astype(np.uint8),
    }
    assert count == len(fields["faces"])
    return Scene(**(fields | extra))


def _room(width: float = 5.0, depth: float = 4.0, height: float = 2.5) -> list[Box]:
    """Return an empty room on z = 0, its inner corner at the origin."""
    w, d, h, t = width, depth, height, 0.1
    return [
        ("floor", "floor", (-t, -t, -t), (w + t, d + t, 0.0)),
        ("ceiling", "ceiling", (-t, -t, h), (w + t, d + t, h + t)),
        ("wall", "wall", (-t, -t, 0.0), (0.0, d + t, h)),
        ("wall", "wall", (w, -t, 0.0), (w + t, d + t, h)),
        ("wall", "wall", (0.0, -t, 0.0), (w, 0.0, h)),
        ("wall", "wall", (0.0, d, 0.0), (w, d + t, h)),
    ]


@pytest.fixture
def make_scene() -> Callable[..., Scene]:
    return _make


@pytest.fixture
def room_boxes() -> Callable[..., list[Box]]:
    return _room


def furnished_scene() -> Scene:
    """Return a room with a table, a hat on it, and a chair."""
    return _make(
        [
            *_room(),
            ("table", "coffee table", (2.6, 1.2, 0.0), (3.4, 2.2, 0.5)),
            ("clothes", "hat", (2.8, 1.5, 0.5), (3.1, 1.8, 0.65)),
            ("chair", "armchair", (3.8, 2.8, 0.0), (4.5, 3.5, 0.9)),
        ]
    )


@pytest.fixture
def furnished() -> Scene:
    return furnished_scene()


@pytest.fixture
def camera() -> PinholeCamera:
    return PinholeCamera.from_horizontal_fov(160, 100, np.radians(74.0))


@pytest.fixture
def scenes_folder() -> Path:
    folder = SHARED / "scenes"
    if not folder.is_dir():
        pytest.skip("the shared scenes are not beside this checkout")
    return folder
