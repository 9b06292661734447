"""The world of a dataset is turned upright by the gravity that it states."""

import json

import numpy as np
import pytest
from PIL import Image

from app.datasets.dataset import DatasetError, open_dataset
from app.datasets.floor_alignment import align_to_floor
from ippon.camera import PinholeCamera
from ippon.geometry import make_transform
from ippon.simulation.camera.renderer import SceneRenderer
from tests.boxes import boxes_scene
from tests.ippon.tracking.conftest import ROOM, held_pose

CAMERA = PinholeCamera.from_horizontal_fov(160, 120, 1.2)
Z_DOWN = make_transform(np.diag([1.0, -1.0, -1.0]), (0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Six views of a room with a floor and walls, 24 degrees apart."""
    folder = tmp_path_factory.mktemp("recording")
    renderer = SceneRenderer(boxes_scene(ROOM))
    for k in range(6):
        image = renderer.render(CAMERA, held_pose(6 * k))
        Image.fromarray(image.color).save(folder / f"{k}.png")
        Image.fromarray((1000.0 * image.depth).astype(np.uint16)).save(folder / f"{k}.depth.png")
    return folder


@pytest.fixture
def dataset_in(recording):
    def read(T_file_world, gravity_world):
        entries = [
            {
                "color": f"{k}.png",
                "depth": f"{k}.depth.png",
                "camera_to_world": (T_file_world @ held_pose(6 * k)).tolist(),
            }
            for k in range(6)
        ]
        content = {
            "name": "held", "width": 160, "height": 120, "depth_unit_m": 0.001, "rate_hz": 10.0,
            "intrinsics": {"fx": CAMERA.fx, "fy": CAMERA.fy, "cx": CAMERA.cx, "cy": CAMERA.cy},
            "gravity_world": gravity_world, "frames": entries,
        }  # fmt: skip
        (recording / "sequence.json").write_text(json.dumps(content))
        return open_dataset(recording)

    return read


@pytest.mark.parametrize(
    ("T_file_world", "gravity_world"), [(np.eye(4), [0, 0, -1]), (Z_DOWN, [0, 0, 9.81])]
)
def test_a_world_whose_z_axis_points_down_is_turned_upright(
    dataset_in, T_file_world, gravity_world
):
    dataset = dataset_in(T_file_world, gravity_world)
    T_map_camera = align_to_floor(dataset) @ dataset.frames[0].T_world_camera
    assert T_map_camera[2, 3] == pytest.approx(held_pose(0)[2, 3], abs=0.05)
    assert T_map_camera[:3, :3] == pytest.approx(
        np.diag([1.0, -1.0, -1.0]) @ Z_DOWN[:3, :3] @ held_pose(0)[:3, :3]
    )


@pytest.mark.parametrize(
    ("T_file_world", "gravity_world"), [(np.eye(4), [0, 0, 1]), (Z_DOWN, [0, 0, -1])]
)
@pytest.mark.parametrize("floor_m", [None, 0.0])
def test_gravity_that_points_up_is_refused(dataset_in, T_file_world, gravity_world, floor_m):
    dataset = dataset_in(T_file_world, gravity_world)
    with pytest.raises(DatasetError, match=r"held: its floor faces down .* gravity_world is the"):
        align_to_floor(dataset, floor_m)


@pytest.mark.parametrize("gravity", [[0, 0, 0], [0, 0], [0.0, float("nan"), -1.0], "down"])
def test_gravity_without_a_direction_is_refused(dataset_in, gravity):
    with pytest.raises(DatasetError, match=r"gravity_world of sequence\.json is .* takes three"):
        dataset_in(np.eye(4), gravity)
