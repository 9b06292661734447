"""Two rooms and a door between them, told apart by what stands in them."""

from types import SimpleNamespace

import numpy as np
import pytest

from ippon.guidance.levels import BY_OPERATOR, LabelLevel, Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.guidance.room_levels import RoomLevels
from ippon.guidance.rooms import NO_ROOM, RoomConfig, infer_rooms, rate_types, room_shares
from ippon.mapping.arrays import FREE, NOT_MAPPED, MapArrays
from ippon.mapping.objects.surface_rows import NO_LABEL
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
        pools=SimpleNamespace(
            tally=np.array([len(blocks), 0, 0]),
            used=np.ones(len(blocks), np.uint8),
            coord=coord,
            state=arrays.state,
        ),
        surface=SimpleNamespace(
            tally=np.array([len(voxels), 0]),
            voxel=np.array(voxels, np.int32),
            label=np.array(labels, np.uint8),
            confidence=np.full(len(voxels), confidence, np.uint8),
        ),
        arrays=lambda: arrays,
    )


def types_of(rooms):
    room = rooms.at(np.array([[2.0, 2.0], [7.0, 2.0], [50.0, 2.0]]))
    return [rooms.types[n] if n != NO_ROOM else None for n in room]


def test_rooms_are_told_apart_by_what_stands_in_them():
    rooms = infer_rooms(home(["sink", "toilet"], ["sink", "counter"]), RoomConfig())
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
def test_what_tells_too_little_gives_no_type(left, change):
    assert types_of(infer_rooms(home(left, **change), RoomConfig()))[0] is None


def test_an_empty_map_has_no_rooms():
    empty = home()
    empty.pools.used[:] = 0
    assert types_of(infer_rooms(empty, RoomConfig())) == [None, None, None]


def test_probabilities_of_types_sum_to_one():
    _, shares = room_shares(MATTERPORT_40)
    seen = np.random.default_rng(0).integers(0, 500, (5, 40)).astype(np.float64)
    probability, kinds = rate_types(seen, shares)
    assert np.allclose(probability.sum(axis=1), 1.0)
    assert (kinds > 1.0).all()


def test_a_sink_counts_by_its_room():
    voxel_map = home(["sink", "toilet"], ["sink", "counter"])
    guidance = EmbeddedPrior().levels("toilet paper", "", MATTERPORT_40)
    levels = RoomLevels(RoomConfig(enabled=True))
    levels.set_guidance(guidance)
    seen = levels.follow(voxel_map, 0, 0.0)
    sink = voxel_map.surface.label == MATTERPORT_40.index("sink")
    at = voxel_map.surface.voxel[sink]
    here, there = seen.level.reshape(-1)[at[:300]], seen.level.reshape(-1)[at[300:]]
    assert set(here.tolist()) <= {Level.NEAR, Level.CERTAIN}
    assert set(there.tolist()) == {Level.FAR}
    # The map itself is as it was; what a room changed counts as changed once.
    assert set(voxel_map.arrays().level.reshape(-1)[at].tolist()) == {Level.AVERAGE}
    again = levels.follow(voxel_map, 10**9, 0.0)
    assert np.array_equal(again.level, seen.level)
    assert [room for room, _ in levels.around((2.0, 2.0), 1.5)] == ["bathroom"]
    assert {room for room, _ in levels.around((4.8, 2.4), 2.0)} == {"bathroom", "kitchen"}
    assert levels.around((60.0, 2.0), 1.0) == ()
    room, here = levels.room_at((7.0, 2.0))
    assert (room, here.rows[MATTERPORT_40.index("sink")].level) == ("kitchen", Level.FAR)
    assert levels.note.startswith("things count by their room, too: near in the bathroom; far in")
    # Another guidance is tried out without a trace.
    bed = EmbeddedPrior().levels("bed", "", MATTERPORT_40)
    supposed = levels.supposing(bed).applied(voxel_map, voxel_map.arrays())
    assert set(supposed.level.reshape(-1)[at].tolist()) == {Level.FAR}
    assert np.array_equal(levels.follow(voxel_map, 10**9, 0.0).level, seen.level)


def test_a_room_takes_back_that_things_are_near_and_no_more():
    levels = RoomLevels(RoomConfig(enabled=True))
    voxel_map = home(["bed", "chest_of_drawers"], ["bathtub", "toilet"])
    levels.set_guidance(EmbeddedPrior().levels("toilet paper", "", MATTERPORT_40))
    levels.follow(voxel_map, 0, 0.0)
    rated = {
        room: {row.label: row.level for row in here.rows}
        for room, here in (levels.room_at((2.0, 2.0)), levels.room_at((7.0, 2.0)))
    }
    # It may hang beside the door of the bathroom.
    assert rated["bedroom"]["picture"] == Level.AVERAGE
    assert rated["bedroom"]["sink"] == Level.FAR
    assert rated["bathroom"]["picture"] == rated["bathroom"]["sink"] == Level.NEAR


def test_without_rooms_the_map_is_left_alone():
    voxel_map = home(["sink", "toilet"], ["sink", "counter"])
    levels = RoomLevels(RoomConfig())
    levels.set_guidance(EmbeddedPrior().levels("toilet", "", MATTERPORT_40))
    assert levels.follow(voxel_map, 0, 0.0).level is voxel_map.arrays().level
    assert (levels.note, levels.around((2.0, 2.0), 1.5)) == ("", ())


def test_what_the_operator_set_counts_in_every_room():
    voxel_map = home(["sink", "toilet"], ["sink", "counter"])
    guidance = EmbeddedPrior().levels("toilet paper", "", MATTERPORT_40)
    edit = LabelLevel(label="sink", level=Level.CERTAIN, reason=BY_OPERATOR)
    levels = RoomLevels(RoomConfig(enabled=True))
    levels.set_guidance(guidance.changed([edit]))
    seen = levels.follow(voxel_map, 0, 0.0)
    sink = voxel_map.surface.label == MATTERPORT_40.index("sink")
    at = voxel_map.surface.voxel[sink]
    assert set(seen.level.reshape(-1)[at].tolist()) == {Level.CERTAIN}


@pytest.mark.parametrize(
    ("change", "text"),
    [({"min_share": 0.3}, r"min_share must lie in \[0.5, 1\]"), ({"every_s": 0.0}, "every_s must")],
)
def test_settings_that_cannot_be_are_refused(change, text):
    with pytest.raises(ValueError, match=text):
        RoomConfig(**change)
