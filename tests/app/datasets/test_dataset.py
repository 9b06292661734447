"""Images of a dataset that are not what its description says."""

import json

import numpy as np
import pytest
from PIL import Image

from app.datasets.dataset import DatasetError, open_dataset, read_color, read_depth
from ippon.camera import PinholeCamera
from ippon.geometry import is_rigid, make_transform, rotation_y, rotation_z

CAMERA = PinholeCamera(width=8, height=6, fx=7.0, fy=7.0, cx=3.5, cy=2.5)


def saved(path, values):
    Image.fromarray(values).save(path)
    return path


def test_depth_is_in_metres_and_zero_without_a_reading(tmp_path):
    values = np.full((6, 8), 1500, np.uint16)
    values[0] = 0
    values[1] = 65535
    depth = read_depth(saved(tmp_path / "depth.png", values), 0.001, CAMERA)
    assert (depth[:2] == 0.0).all()
    assert depth[2:] == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("name", "values", "text"),
    [
        ("small.png", np.ones((3, 4), np.uint16), "is an image of 4x3 in the mode I;16"),
        ("colour.png", np.ones((6, 8, 3), np.uint8), "is an image of 8x6 in the mode RGB"),
        ("grey.png", np.ones((6, 8), np.uint8), "is an image of 8x6 in the mode L"),
        ("metres.tiff", np.ones((6, 8), np.float32), "is an image of 8x6 in the mode F"),
    ],
)
def test_what_is_no_depth_of_the_camera_is_refused(tmp_path, name, values, text):
    with pytest.raises(DatasetError) as caught:
        read_depth(saved(tmp_path / name, values), 0.001, CAMERA)
    assert text in str(caught.value)
    assert "takes depth of 8x6, grey of 16 bits" in str(caught.value)


def test_colour_is_scaled_to_depth_and_not_stretched(tmp_path):
    larger = saved(tmp_path / "larger.png", np.full((12, 16, 3), 9, np.uint8))
    assert read_color(larger, CAMERA).shape == (6, 8, 3)
    wide = saved(tmp_path / "wide.png", np.zeros((9, 16, 3), np.uint8))
    with pytest.raises(DatasetError, match=r"wide\.png is an image of 16x9; colour and depth of"):
        read_color(wide, CAMERA)


def test_an_image_with_a_broken_part_is_named(tmp_path):
    noise = np.random.default_rng(1).integers(0, 2**16, (300, 300), np.uint16)
    path = saved(tmp_path / "depth.png", noise)
    before, _, after = path.read_bytes().rpartition(b"IDAT")
    path.write_bytes(before + b"ID\0T" + after)
    with pytest.raises(DatasetError, match=r"cannot read the image .*depth\.png: broken PNG"):
        read_depth(path, 0.001, CAMERA)


def test_of_a_scannet_scene_without_poses_their_folder_is_named(tmp_path):
    for name in ("intrinsic", "pose"):
        (tmp_path / name).mkdir()
    np.savetxt(tmp_path / "intrinsic" / "intrinsic_depth.txt", np.eye(4))
    with pytest.raises(DatasetError, match=r"/pose holds no pose$"):
        open_dataset(tmp_path)


@pytest.mark.parametrize(
    ("marker", "name"),
    [
        ("frame-000000.pose.txt", "frame-000001.pose.txt"),
        ("intrinsic/intrinsic_depth.txt", "pose/1.txt"),
    ],
)
def test_a_pose_that_is_cut_off_is_named(tmp_path, marker, name):
    for one in (marker, name):
        (tmp_path / one).parent.mkdir(exist_ok=True)
        np.savetxt(tmp_path / one, np.eye(4))
    whole = (tmp_path / name).read_text()
    (tmp_path / name).write_text(whole[: 2 * len(whole) // 3])
    with pytest.raises(DatasetError, match=rf"{name} is damaged: "):
        open_dataset(tmp_path)


def test_poses_that_are_rounded_are_made_rotations(tmp_path):
    pose = make_transform(rotation_z(2.2) @ rotation_y(0.5), (1.0, 2.0, 3.0))
    frame = {"color": "0.png", "depth": "1.png", "camera_to_world": pose.round(3).tolist()}
    assert not is_rigid(pose.round(3))
    content = {
        "name": "x", "width": 4, "height": 3, "depth_unit_m": 0.001, "rate_hz": 10.0,
        "intrinsics": {"fx": 4.0, "fy": 4.0, "cx": 2.0, "cy": 1.5},
        "gravity_world": [0, 0, -1], "frames": [frame],
    }  # fmt: skip
    (tmp_path / "sequence.json").write_text(json.dumps(content))
    (read,) = open_dataset(tmp_path).frames
    assert is_rigid(read.T_world_camera, 1e-9)
    np.testing.assert_allclose(read.T_world_camera, pose, atol=0.002)
