import dataclasses

import numpy as np
import pytest

from app.messages.cdr import MessageError, decode, encode
from app.messages.scene import (
    VOXEL_DTYPE,
    FoundObject,
    VoxelCloud,
    decode_found_objects,
    decode_tree,
    decode_voxels,
    encode_found_objects,
    encode_tree,
    encode_voxels,
)
from ippon.planning.plan import TreeView


@pytest.fixture
def cloud():
    rng = np.random.default_rng(3)
    n = 50
    index = rng.integers(-200, 200, (n, 3))
    columns = {
        name: rng.integers(0, 256, n, dtype=np.uint8)
        for name in ("ooi", "proximity", "level", "label", "confidence")
    }
    return VoxelCloud(
        stamp_ns=5,
        centers_world=((index + 0.5) * 0.1).astype(np.float32),
        color=rng.integers(0, 256, (n, 3), dtype=np.uint8),
        removed=rng.random(n) < 0.3,
        **columns,
    )


@pytest.fixture
def tree():
    n = 4
    values = {
        name: np.arange(n, dtype=np.float32)
        for name in ("yaws_rad", "tilts_rad", "gains", "terminations", "path_costs_s")
    }
    return TreeView(
        positions_world=np.arange(3 * n, dtype=np.float32).reshape(n, 3),
        parents=np.array([-1, 0, 0, 2], np.int32),
        levels=np.array([0, 1, 2, 3], np.uint8),
        kinds=np.array([0, 1, 2, 0], np.uint8),
        **values,
    )


def assert_same(a, b):
    for field in dataclasses.fields(a):
        np.testing.assert_array_equal(getattr(a, field.name), getattr(b, field.name))


def test_a_voxel_takes_24_bytes():
    assert VOXEL_DTYPE.itemsize == 24


def test_voxels_round_trip(cloud):
    assert_same(decode_voxels(encode_voxels(cloud)), cloud)


@pytest.mark.parametrize("voxel_size_m", [0.025, 0.05, 0.1, 0.07])
def test_voxel_indices_come_back_from_their_centres(cloud, voxel_size_m):
    index = np.random.default_rng(4).integers(-10_000, 10_000, (50, 3))
    centers = ((index + 0.5) * voxel_size_m).astype(np.float32)
    sent = dataclasses.replace(cloud, centers_world=centers)
    back = decode_voxels(encode_voxels(sent))
    np.testing.assert_array_equal(back.indices(voxel_size_m), index)


def test_no_voxels_are_a_message_too(cloud):
    none = VoxelCloud(
        **{
            f.name: v[:0] if isinstance(v := getattr(cloud, f.name), np.ndarray) else v
            for f in dataclasses.fields(cloud)
        }
    )
    assert len(decode_voxels(encode_voxels(none)).ooi) == 0


def changed(payload, typename, **changes):
    message = decode(payload, typename)
    fields = {k: getattr(message, k) for k in message.__dataclass_fields__ if k[0] != "_"}
    return encode(typename, **{**fields, **changes})


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"width": 51}, "51 voxels do not fit 1200 bytes"),
        ({"width": 2**31, "height": 2**31}, "do not fit"),
        ({"point_step": 16}, "got 16 bytes"),
        ({"fields": []}, "points of 24 bytes with the fields x, y, z, rgb, ooi"),
        ({"is_bigendian": True}, "a voxel cloud has points"),
    ],
)
def test_other_point_clouds_are_refused(cloud, changes, text):
    with pytest.raises(MessageError, match=text):
        decode_voxels(changed(encode_voxels(cloud), "sensor_msgs/msg/PointCloud2", **changes))


def test_voxels_that_are_nowhere_are_refused(cloud):
    centers = cloud.centers_world.copy()
    centers[3, 1] = np.nan
    with pytest.raises(MessageError, match="not finite"):
        decode_voxels(encode_voxels(dataclasses.replace(cloud, centers_world=centers)))


def test_tree_round_trip(tree):
    stamp_ns, back = decode_tree(encode_tree(tree, 11))
    assert stamp_ns == 11
    assert_same(back, tree)


def test_a_tree_with_rows_missing_or_foreign_parents_is_refused(tree):
    short = dataclasses.replace(tree, gains=tree.gains[:2])
    with pytest.raises(MessageError, match=r"4 nodes .* other \['gains'\]"):
        decode_tree(encode_tree(short, 0))
    foreign = dataclasses.replace(tree, parents=np.array([-1, 0, 0, 9], np.int32))
    with pytest.raises(MessageError, match="has parents out of range"):
        decode_tree(encode_tree(foreign, 0))


def test_detections_round_trip():
    hat = FoundObject(
        label="hat", probability=0.9, center_world=(1.0, 2.0, 0.5), size_m=(0.3, 0.3, 0.2)
    )
    assert decode_found_objects(encode_found_objects([hat], 13)) == (13, (hat,))
    assert decode_found_objects(encode_found_objects([], 13)) == (13, ())


def test_damaged_bytes_never_do_more_than_a_message_error(survives_damage, cloud, tree):
    hat = FoundObject(
        label="hat", probability=0.9, center_world=(1, 2, 0.5), size_m=(0.3, 0.3, 0.2)
    )
    survives_damage(decode_voxels, encode_voxels(cloud))
    survives_damage(decode_tree, encode_tree(tree, 1))
    survives_damage(decode_found_objects, encode_found_objects([hat], 1))
