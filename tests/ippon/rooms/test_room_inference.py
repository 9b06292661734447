"""Two rooms and a door between them, told apart by what stands in them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ippon.guidance.levels import Level
from ippon.mapping.arrays import FREE, NOT_MAPPED, MapArrays
from ippon.mapping.config import MapConfig
from ippon.mapping.objects.surface_voxels import NO_LABEL
from ippon.mapping.voxel_map import VoxelMap
from ippon.rooms.room_inference import (
    NO_ROOM,
    RoomConfig,
    infer_rooms,
    rate_types,
    room_evidence,
    room_shares,
)
from ippon.vocabulary import MATTERPORT_40

VOXEL_M = 0.1
LAYER = 15
"""Of voxels 1.5 m above the floor."""
SIZE = 96
"""Voxels along the longer side of the home: two rooms of 4.6 m by 4.6 m."""


def home(left=(), right=(), count=300, confidence=254):
    """A map of two rooms side by side, with a door of 0.9 m, and voxels of labels in each."""
    grid = np.zeros((SIZE, 48), dtype=bool)
    grid[1:47, 1:47] = grid[49:95, 1:47] = True
    grid[47:49, 20:29] = True
    blocks = [(x, y) for x in range(SIZE // 8) for y in range(6)]
    coord = np.array([(x, y, LAYER // 8) for x, y in blocks], np.int64)
    state = np.zeros((len(blocks), 8, 8, 8), np.uint8)
    for row, (x, y) in enumerate(blocks):
        state[row, :, :, LAYER % 8] = FREE * grid[8 * x : 8 * x + 8, 8 * y : 8 * y + 8]
    voxels, labels = [0], [NO_LABEL]
    for names, low in ((left, 4), (right, 52)):
        for n, name in enumerate(names):
            for k in range(count):
                x, y, z = low + k % 20, 4 + 8 * n + k // 20 % 5, k // 100
                row = blocks.index((x // 8, y // 8))
                voxels.append(row * 512 + (x % 8) * 64 + (y % 8) * 8 + z)
                labels.append(MATTERPORT_40.index(name))
    level = np.full((len(blocks), 512), NOT_MAPPED, np.uint8)
    level.reshape(-1)[voxels[1:]] = Level.AVERAGE
    shown = {
        "voxel_size": VOXEL_M,
        "origin_block": np.array([0, 0, LAYER // 8]),
        "directory": np.arange(len(blocks), dtype=np.int32).reshape(SIZE // 8, 6, 1),
        "state": state.reshape(-1, 512),
        "slab": np.arange(len(blocks), dtype=np.int32),
        "level": level,
        "revision": np.zeros(len(blocks), np.int64),
    }
    arrays = MapArrays(**{name: shown.get(name) for name in MapArrays._fields})
    return SimpleNamespace(
        labels=MATTERPORT_40,
        revision=7,
        config=SimpleNamespace(voxel_size_m=VOXEL_M),
        block_coords=coord,
        surface=SimpleNamespace(
            tally=np.array([len(voxels), 0]),
            voxel=np.array(voxels, np.int32),
            label=np.array(labels, np.uint8),
            confidence=np.full(len(voxels), confidence, np.uint8),
        ),
        arrays=lambda: arrays,
    )


def infer(voxel_map):
    return infer_rooms(room_evidence(voxel_map, RoomConfig()), RoomConfig())


def types_of(rooms):
    room = rooms.at(np.array([[2.0, 2.0], [7.0, 2.0], [50.0, 2.0]]))
    return [rooms.types[n] if n != NO_ROOM else None for n in room]


def test_rooms_get_the_type_of_their_objects():
    rooms = infer(home(["sink", "toilet"], ["sink", "counter"]))
    assert types_of(rooms) == ["bathroom", "kitchen", None]


@pytest.mark.parametrize(
    ("left", "change"),
    [
        (["sink"], {}),
        (["wall", "floor", "objects"], {}),
        (["toilet"], {"count": 20}),
        (["toilet"], {"confidence": 60}),
        ([], {}),
    ],
)
def test_too_few_informative_objects_give_no_type(left, change):
    assert types_of(infer(home(left, **change)))[0] is None


@pytest.mark.parametrize(("voxel_m", "enough"), [(0.05, 800), (0.1, 200), (0.2, 50)])
def test_the_same_surface_tells_as_much_at_each_voxel_size(voxel_m, enough):
    seen = room_evidence(home(["sink", "toilet"]), RoomConfig())
    scale = voxel_m / VOXEL_M
    config = RoomConfig(door_width_m=scale * RoomConfig().door_width_m)

    def first_type(voxels):
        pick = np.resize(np.arange(600).reshape(2, 300).T, voxels)  # Sink and toilet in turn.
        xy, cell_m = scale * seen.positions_xy[pick], scale * seen.cell_m
        label = seen.label[pick]
        rooms = infer_rooms(replace(seen, cell_m=cell_m, positions_xy=xy, label=label), config)
        room = int(rooms.at(scale * np.array([[2.0, 2.0]]))[0])
        return rooms.types[room] if room != NO_ROOM else None

    assert first_type(enough * 2) == "bathroom"
    assert first_type(enough * 9 // 10) is None


@pytest.mark.parametrize("floor_z_m", [3.0, -2.4])
def test_what_stands_on_another_floor_tells_nothing_of_a_room(floor_z_m):
    """Surface lies 0.8 to 1.1 m above the floor at 0."""
    below = home(["sink", "toilet"], ["sink", "counter"])
    evidence = room_evidence(below, RoomConfig(), floor_z_m)
    assert len(evidence.label) == 0
    assert len(room_evidence(below, RoomConfig()).label) == 1200


def test_an_empty_map_has_no_rooms():
    empty = VoxelMap(MapConfig(memory_limit_mb=64.0), MATTERPORT_40)
    assert types_of(infer(empty)) == [None, None, None]


def test_a_map_that_ends_below_the_open_height_has_no_rooms():
    low = home()
    low.arrays().directory[:] = -1
    assert types_of(infer(low)) == [None, None, None]


def test_probabilities_of_types_sum_to_one():
    _, shares = room_shares(MATTERPORT_40)
    seen = np.random.default_rng(0).integers(0, 500, (5, 40)).astype(np.float64)
    probability, kinds = rate_types(seen, shares, RoomConfig())
    assert np.allclose(probability.sum(axis=1), 1.0)
    assert (kinds > 1.0).all()


def test_the_room_at_a_place_has_a_name_in_words():
    rooms = infer(home(["sofa", "fireplace"], ["sink", "counter"]))
    assert [rooms.name_at(xy) for xy in ((2.0, 2.0), (7.0, 2.0), (50.0, 2.0))] == [
        "living room",
        "kitchen",
        "",
    ]


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"min_share": 0.3}, r"min_share must lie in \[0.5, 1\]"),
        ({"reach_m": 0.0}, "reach_m must"),
        ({"odd_share": 0.0}, "odd_share must"),
    ],
)
def test_values_out_of_range_are_rejected(change, text):
    with pytest.raises(ValueError, match=text):
        RoomConfig(**change)


def test_evidence_is_a_copy_that_later_changes_of_the_map_do_not_affect():
    voxel_map = home(["sink", "toilet"], ["sink", "counter"])
    evidence = room_evidence(voxel_map, RoomConfig())
    before = types_of(infer_rooms(evidence, RoomConfig()))
    voxel_map.arrays().state[:] = 0
    voxel_map.surface.label[:] = NO_LABEL
    assert types_of(infer_rooms(evidence, RoomConfig())) == before
    assert types_of(infer(voxel_map)) == [None, None, None]
