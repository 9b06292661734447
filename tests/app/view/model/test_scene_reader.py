import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.messages import keys
from app.messages.control import encode
from app.messages.images import encode_camera
from app.messages.motion import StampedPath, encode_path, encode_transforms, robot_transforms
from app.messages.scene import encode_voxels
from app.view.model.scene_model import SceneModel
from app.view.model.scene_reader import SceneReader
from app.view.model.seek_history import SEEK_HISTORY, SeekHistory
from ippon.camera import PinholeCamera
from ippon.geometry import base_pose, make_transform


def test_reads_what_travels(make):
    model = SceneModel()
    reader = SceneReader(model)
    assert reader.feed(keys.STATUS, encode(make.status()))
    assert reader.feed(keys.MAP_VOXELS, encode_voxels(make.cloud([(1, 2, 3)])))
    path = StampedPath(stamp_ns=1, points_world=np.array([[0.0, 0, 0], [1, 2, 0]]))
    assert reader.feed(keys.PLAN_PATH, encode_path(path))
    assert model.voxels.all_voxels()[0].tolist() == [[1, 2, 3]]
    assert model.path_world.tolist() == [[0, 0, 0], [1, 2, 0]]
    assert not reader.rejected


def test_fixed_transforms_outlive_a_restart_of_the_navigator_and_no_recording(make):
    model = SceneModel()
    reader = SceneReader(model)
    camera = PinholeCamera.from_horizontal_fov(64, 40, 1.2)
    late_ns, early_ns = 90_000_000_000, 10_000_000_000
    T_base_camera = make_transform(np.eye(3), (0.1, 0.0, 1.2))

    def robot(stamp_ns, mount=T_base_camera):
        base, fixed = robot_transforms(stamp_ns, base_pose(2.0, 1.0, 0.0, 0.0), mount, "optical")
        return encode_transforms([base]), encode_transforms([fixed])

    reader.feed(keys.CAMERA_INFO, encode_camera(camera, late_ns, "optical"))
    moving, fixed = robot(late_ns)
    reader.feed(keys.TF_STATIC, fixed)
    reader.feed(keys.TF, moving)
    reader.feed(keys.STATUS, encode(make.status(stamp_ns=late_ns)))
    # The next round of a replay: tf_static comes first, then a status of an earlier time.
    reader.feed(keys.STATUS, encode(make.status(stamp_ns=early_ns)))
    reader.feed(keys.TF, robot(early_ns)[0])
    assert model.T_world_camera is not None
    assert model.T_world_camera[:3, 3] == pytest.approx((2.1, 1.0, 1.2))
    # A robot that was built differently and whose clock begins again sends its own.
    reader.feed(keys.TF_STATIC, robot(early_ns, make_transform(np.eye(3), (0.3, 0.0, 0.5)))[1])
    assert model.T_world_camera[:3, 3] == pytest.approx((2.3, 1.0, 0.5))
    reader.feed(SEEK_HISTORY, encode(SeekHistory(statuses=[], events=[])))
    reader.feed(keys.TF, robot(early_ns)[0])
    assert model.T_world_camera is None
    assert not reader.rejected


def test_unknown_topics_are_left_alone():
    reader = SceneReader(SceneModel())
    assert not reader.feed("cmd_vel", b"")
    assert not reader.rejected


ALL_KEYS = SceneReader(SceneModel()).keys


@pytest.mark.parametrize("key", ALL_KEYS)
def test_broken_messages_are_counted_and_change_nothing(key):
    model = SceneModel()
    reader = SceneReader(model)
    broken = (
        b"", b"\x00", b"{}", b"\x00\x01\x00\x00" + b"\xff" * 64, b"[" * 5000,
        b'{"robot": "\xff"}', b'{"unknown": ' + 100_000 * b"[",
    )  # fmt: skip
    for payload in broken:
        assert not reader.feed(key, payload)
    assert reader.rejected[key] == len(broken)
    assert key in (reader.problem or "")
    assert model.take_changes() == frozenset()


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(ALL_KEYS), st.binary(max_size=400))
def test_no_bytes_get_through_as_an_exception(key, payload):
    SceneReader(SceneModel()).feed(key, payload)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 400), st.integers(0, 255))
def test_a_flipped_byte_of_a_map_is_no_exception(position, value):
    cloud = np.array([(n, 0, 0) for n in range(10)])
    payload = bytearray(encode_voxels(_cloud(cloud)))
    payload[position % len(payload)] = value
    model = SceneModel()
    model.voxel_size_m = 0.1
    SceneReader(model).feed(keys.MAP_VOXELS, bytes(payload))


def _cloud(indices):
    from app.messages.scene import VoxelCloud

    n = len(indices)
    zeros = np.zeros(n, np.uint8)
    return VoxelCloud(
        stamp_ns=1,
        centers_world=(indices * 0.1 + 0.05).astype(np.float32),
        color=np.zeros((n, 3), np.uint8),
        ooi=zeros,
        proximity=zeros,
        level=zeros,
        label=zeros,
        confidence=zeros,
        removed=np.zeros(n, bool),
    )
