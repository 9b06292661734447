"""Saving, loading, and files that are not what they should be."""

import tracemalloc

import numpy as np
import pytest
import zstandard

from ippon.errors import MapFileError
from ippon.mapping import map_file
from ippon.mapping.config import MapConfig
from ippon.mapping.map_file import decode, encode
from ippon.mapping.objects.surface_changes import SurfaceTracker
from ippon.mapping.voxel_map import VoxelMap
from ippon.observation import Heatmap

LABELS = ("wall", "floor", "chair")


def frames(tools, count, start=0):
    world = tools.World.room()
    world.boxes.append((2.5, 2.5, 0.0, 3.1, 3.1, 0.5))
    rng = np.random.default_rng(start)
    for n in range(start, start + count):
        p = rng.integers(0, 256, (15, 20, 4), dtype=np.uint8)
        heatmap = Heatmap(labels=LABELS, ooi="hat", probabilities=p)
        pose = tools.look(1.0 + 0.01 * n, 1.0, 1.2, 2.4 * n, -0.3)
        yield world.frame(pose, stamp_ns=n * 10**9, heatmap=lambda _, h=heatmap: h)


@pytest.fixture
def voxel_map(tools):
    voxel_map = VoxelMap(MapConfig(), LABELS)
    voxel_map.set_ooi("hat", highest_m=1.5, lowest_m=0.1, small_m=0.2)
    voxel_map.set_levels(np.array([0, 2, 3], np.uint8), np.array([0.0, 0.1, 0.4, 0.8], "f4"))
    voxel_map.suppress_ooi(np.array([2.8, 2.8, 0.3]), 0.3)
    for frame in frames(tools, 20):
        voxel_map.integrate(frame)
    return voxel_map


@pytest.mark.slow
def test_a_loaded_map_goes_on_as_the_saved_one(tools, voxel_map, tmp_path):
    path = tmp_path / "home.map"
    voxel_map.save(path)
    loaded = VoxelMap.load(path)
    assert (loaded.labels, loaded.ooi, loaded.revision) == (LABELS, "hat", voxel_map.revision)
    assert loaded.config == voxel_map.config
    for frame in frames(tools, 12, start=20):
        voxel_map.integrate(frame)
        loaded.integrate(frame)
    for name in ("state", "ooi", "level", "distance"):
        mine, theirs = (tools.dense(m.arrays(), name)[0] for m in (voxel_map, loaded))
        boxes = [m.arrays().origin_block * 8 for m in (voxel_map, loaded)]
        low = np.maximum(*boxes)
        high = np.minimum(boxes[0] + mine.shape, boxes[1] + theirs.shape)
        cut = [
            layer[tuple(slice(a, b) for a, b in zip(low - box, high - box, strict=True))]
            for layer, box in ((mine, boxes[0]), (theirs, boxes[1]))
        ]
        assert np.array_equal(*cut), name
    assert loaded.best_ooi() == voxel_map.best_ooi()
    assert loaded.explored_m2() == voxel_map.explored_m2()
    a, b = (SurfaceTracker(m).keyframe() for m in (voxel_map, loaded))
    order_a, order_b = (np.lexsort(d.index.T) for d in (a, b))
    for name in ("index", "color", "ooi", "proximity", "level", "label", "confidence"):
        assert np.array_equal(getattr(a, name)[order_a], getattr(b, name)[order_b]), name


def test_an_empty_map_is_saved_and_loaded(tmp_path):
    VoxelMap(MapConfig(), LABELS).save(tmp_path / "empty.map")
    assert VoxelMap.load(tmp_path / "empty.map").bounds() is None


def test_a_map_within_the_memory_limit_is_read_whatever_its_size(voxel_map, tmp_path, monkeypatch):
    monkeypatch.setattr(map_file, "MOST_BYTES", 1000)
    voxel_map.save(tmp_path / "large.map")
    with pytest.raises(MapFileError, match=r"bytes; at most 1000 are read"):
        VoxelMap.load(tmp_path / "large.map")
    assert VoxelMap.load(tmp_path / "large.map", MapConfig()).bounds() is not None


def test_a_map_that_an_earlier_version_filled_to_its_limit_is_read(voxel_map, tmp_path):
    """More is counted for a block now, so that the limit holds fewer."""
    full = MapConfig(memory_limit_mb=2.0, max_range_m=0.5)
    voxel_map.config, voxel_map._limit_mb = full, full.memory_limit_mb
    voxel_map.save(tmp_path / "full.map")
    for config in (None, full, MapConfig()):
        loaded = VoxelMap.load(tmp_path / "full.map", config)
        assert loaded.bounds() is not None
        assert loaded.config.max_blocks > full.max_blocks
        loaded.save(tmp_path / "again.map")
        again = VoxelMap.load(tmp_path / "again.map", config)
        assert again.config == loaded.config, "whenever it starts"


@pytest.mark.slow
def test_another_configuration_must_fit(voxel_map, tmp_path):
    path = tmp_path / "home.map"
    voxel_map.save(path)
    assert VoxelMap.load(path, MapConfig(max_range_m=4.0)).config.max_range_m == 4.0
    with pytest.raises(MapFileError, match=r"made with voxel_size_m 0\.1; asked for 0\.05"):
        VoxelMap.load(path, MapConfig(voxel_size_m=0.05))
    with pytest.raises(MapFileError, match=r"raise mission\.map\.memory_limit_mb"):
        VoxelMap.load(path, MapConfig(memory_limit_mb=2.0, max_range_m=0.5))


@pytest.mark.slow
def test_damaged_files_are_refused_with_a_reason(voxel_map, tmp_path):
    path = tmp_path / "home.map"
    voxel_map.save(path)
    good = path.read_bytes()
    for content, reason in (
        (b"", "not a map file"),
        (b"PNG" + good, "not a map file"),
        (good[:-1], "checksum"),
        (good[: len(good) // 2], "checksum"),
        (good[:8] + b"\x09" + good[9:], "version 9"),
        (good[:5000] + bytes([good[5000] ^ 1]) + good[5001:], "checksum"),
    ):
        path.write_bytes(content)
        with pytest.raises(MapFileError, match=reason):
            VoxelMap.load(path)


def test_a_valid_checksum_is_not_trusted_blindly(tmp_path):
    header = {"config": {}, "labels": ["wall"]}
    for arrays, reason in (
        ({}, "not a usable map"),
        ({"coord": np.zeros((1, 3), np.int64)}, "not a usable map"),
    ):
        path = tmp_path / "odd.map"
        path.write_bytes(encode(header, arrays))
        with pytest.raises(MapFileError, match=reason):
            VoxelMap.load(path)
    huge = encode({}, {"a": np.zeros(1 << 16, np.uint8)})
    with pytest.raises(MapFileError, match="at most 1000"):
        decode(huge, max_bytes=1000)


def with_digest(header, packed):
    content = map_file._PREFIX.pack(map_file.MAGIC, map_file.VERSION, len(header)) + header + packed
    return content + map_file._digest(content)


def test_a_file_that_states_little_and_holds_much_is_not_unpacked():
    """A frame that states its own size is not limited by the size that is passed to the library."""
    header = b'{"arrays": [{"name": "a", "dtype": "|u1", "shape": [10]}]}'
    bomb = zstandard.ZstdCompressor().compress(bytes(300_000_000))
    tracemalloc.start()
    try:
        with pytest.raises(MapFileError, match="states 300000000 bytes; it holds 10"):
            decode(with_digest(header, bomb))
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()


def test_a_header_nested_too_deeply_is_none():
    with pytest.raises(MapFileError, match="no readable header"):
        decode(with_digest(b'{"arrays":' + b"[" * 100_000, b""))


def test_arrays_survive():
    arrays = {"a": np.arange(6, dtype=np.int16).reshape(2, 3), "b": np.zeros((0, 4), np.float32)}
    header, back = decode(encode({"x": [1, 2]}, arrays))
    assert header == {"x": [1, 2]}
    assert all(
        np.array_equal(arrays[k], back[k]) and arrays[k].dtype == back[k].dtype for k in arrays
    )
