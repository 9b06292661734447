import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.view.model import voxel_store
from app.view.model.voxel_store import MAX_INDEX, VoxelStore, VoxelUpdate

Row = tuple[tuple[int, int, int], int, bool]


def _update(rows):
    return VoxelUpdate(
        indices=np.array([r[0] for r in rows], np.int64).reshape(-1, 3),
        attributes=np.array([[r[1]] * 8 for r in rows], np.uint8).reshape(-1, 8),
        surface=np.array([r[2] for r in rows], bool),
    )


def _box(low, high):
    grid = np.stack(
        np.meshgrid(*(np.arange(a, b) for a, b in zip(low, high, strict=True)), indexing="ij"),
        axis=-1,
    ).reshape(-1, 3)
    n = len(grid)
    return VoxelUpdate(
        indices=grid.astype(np.int64),
        attributes=np.full((n, 8), 7, np.uint8),
        surface=np.ones(n, bool),
    )


def _as_dict(store):
    indices, attributes = store.all_voxels()
    return {tuple(i): int(a[0]) for i, a in zip(indices.tolist(), attributes.tolist(), strict=True)}


index = st.tuples(*[st.integers(-20, 20)] * 3)
updates = st.lists(
    st.lists(st.tuples(index, st.integers(0, 255), st.booleans()), max_size=30), max_size=6
)


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(updates)
def test_holds_what_a_dictionary_would(batches):
    store, twin = VoxelStore(), {}
    for batch in batches:
        store.apply(_update(batch))
        for where, value, surface in batch:
            if surface:
                twin[where] = value
            else:
                twin.pop(where, None)
    assert _as_dict(store) == twin
    assert store.count == len(twin)
    asked = [where for batch in batches for where, *_ in batch] + [(500, 0, 0)]
    held = store.holds(np.array(asked, np.int64))
    assert held.tolist() == [where in twin for where in asked]


def test_only_touched_columns_are_dirty():
    store = VoxelStore()
    store.apply(_update([((0, 0, 0), 1, True), ((17, 0, 30), 1, True), ((-1, -17, 0), 1, True)]))
    columns, revision = store.changed_since(0)
    assert set(columns) == {(0, 0), (1, 0), (-1, -2)}
    assert store.changed_since(revision) == ((), revision)
    store.apply(_update([((17, 3, 2), 1, True)]))
    assert store.changed_since(revision) == (((1, 0),), revision + 1)
    assert len(store.changed_since(0)[0]) == 3, "another picture has its own revision"


def test_a_column_is_local_in_x_and_y_and_absolute_in_z():
    store = VoxelStore()
    store.apply(_update([((-3, 17, -2), 5, True), ((-3, 17, 25), 6, True)]))
    column = store.column((-1, 1))
    assert column.local.tolist() == [[13, 1, -2], [13, 1, 25]]
    assert column.attributes[:, 0].tolist() == [5, 6]


def test_a_cut_leaves_out_what_is_above_and_its_shadow():
    store = VoxelStore()
    store.apply(_box((0, 0, 0), (1, 1, 10)))
    whole, cut = store.column((0, 0)), store.column((0, 0), below=4)
    assert len(whole.local) == 10
    assert cut.local[:, 2].tolist() == [0, 1, 2, 3]
    assert whole.openness[3] == 0
    assert cut.openness[3] == 255


def test_openness_tells_sides_corners_and_open_floor_apart_across_columns():
    store = VoxelStore()
    store.apply(_box((0, 0, 0), (48, 48, 1)))
    store.apply(_box((16, 16, 1), (17, 17, 5)))
    floor = {tuple(p): int(o) for p, o in _openness(store, (0, 0))}
    tower = {tuple(p): int(o) for p, o in _openness(store, (1, 1))}
    assert floor[0, 0, 0] == 255
    assert tower[0, 0, 0] == 0
    assert tower[0, 0, 4] == 255
    assert 0 < floor[15, 15, 0] < 255, "the tower stands in the neighbouring column"


def test_openness_does_not_end_at_a_block():
    across, within = VoxelStore(), VoxelStore()
    across.apply(_box((0, 0, 0), (30, 30, 1)))
    across.apply(_box((8, 8, 1), (9, 9, 5)))
    within.apply(_box((0, 0, 0), (30, 30, 1)))
    within.apply(_box((4, 4, 1), (5, 5, 5)))
    shaded = [
        {(i - at, j - at, k): int(o) for (i, j, k), o in _openness(store, (0, 0)) if o < 255}
        for store, at in ((across, 8), (within, 4))
    ]
    assert shaded[0] == shaded[1]
    assert len(shaded[0]) == 9 + 4 - 1


def _openness(store, column):
    voxels = store.column(column)
    return zip(voxels.local.tolist(), voxels.openness.tolist(), strict=True)


def test_clear_empties_and_marks_every_column():
    store = VoxelStore()
    store.apply(_box((0, 0, 0), (17, 1, 1)))
    _, revision = store.changed_since(0)
    store.clear()
    assert store.count == 0
    assert set(store.changed_since(revision)[0]) == {(0, 0), (1, 0)}
    assert len(store.column((0, 0)).local) == 0
    assert store.columns == ()


def test_maps_that_are_cleared_take_no_block_of_the_next_one(monkeypatch):
    monkeypatch.setattr(voxel_store, "MAX_BLOCKS", 10)
    store = VoxelStore()
    for home in range(5):
        store.clear()
        assert store.refused == 0
        store.apply(_update([((8 * n, 800 * home, 0), 1, True) for n in range(11)]))
        assert (store.count, store.refused) == (10, 1)
        assert store.holds(np.array([[0, 800 * home, 0], [0, 800 * (home - 1), 0]])).tolist() == [
            True,
            False,
        ]


def test_voxels_too_far_out_are_refused_and_counted():
    store = VoxelStore()
    store.apply(_update([((MAX_INDEX, 0, 0), 1, True), ((0, 0, 0), 1, True)]))
    assert (store.count, store.refused) == (1, 1)


def test_a_flood_of_blocks_is_bounded(monkeypatch):
    monkeypatch.setattr(voxel_store, "MAX_BLOCKS", 10)
    store = VoxelStore()
    store.apply(_update([((8 * n, 0, 0), 1, True) for n in range(25)]))
    store.apply(_update([((8 * n, 1, 0), 2, True) for n in range(25)]))
    assert (store.count, store.refused) == (20, 30)


def test_contradicting_shapes_are_refused():
    with pytest.raises(ValueError, match=r"2 voxels need indices \(2, 3\)"):
        VoxelUpdate(
            indices=np.zeros((3, 3), np.int64),
            attributes=np.zeros((2, 8), np.uint8),
            surface=np.ones(2, bool),
        )
