"""Things in the map: connected surface voxels of one label, kept up to date block by block."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ippon.guidance.knowledge import load_knowledge
from ippon.mapping.arrays import BLOCK_EDGE, OCCUPIED, UNKNOWN
from ippon.mapping.blocks import NO_SLAB
from ippon.mapping.objects.surface_changes import changed_blocks
from ippon.mapping.objects.surface_voxels import NO_LABEL, STEPS_PER_NAT
from ippon.mapping.voxel_map import VoxelMap
from ippon.memory.instance import Sighting, box_of

STRUCTURE: Final = frozenset(
    {"wall", "floor", "ceiling", "column", "beam", "railing", "objects", "others"}
)
"""Labels of the building, and of what has no name: they are no things to remember."""
_MIN_CONFIDENCE: Final = 127
"""Of a voxel's label, in units of 1/254."""
_SHARE_SEEN: Final = 0.08
"""Surface voxels that a thing has at least, as a share of the square of its longest side."""
_LEAST_VOXELS: Final = 2
_MOST_M: Final = 1.0
"""Longest side that counts for that, also of a thing that the table lacks."""
_ALTERNATIVES: Final = 3
_LEAST_SHARE: Final = 0.05
"""Probability from which another label is an alternative."""
_BITS: Final = 21
_OFFSET: Final = 1 << (_BITS - 1)
_HALF: Final = tuple(
    (x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) > (0, 0, 0)
)
"""Half of the 26 neighbours of a voxel: the other half are their opposites."""

Keys = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cluster:
    """Connected voxels of one label."""

    sighting: Sighting | None
    """None while it is too small to be such a thing."""
    keys: Keys
    """(M,) voxels, see `keys_of`, in rising order."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusterChanges:
    """What changed since the last call."""

    replaced: dict[int, Cluster]
    """Clusters that are no more as they were, by number."""
    current: dict[int, Cluster]
    """Clusters in their place, and new ones, by number."""
    seen: frozenset[int]
    """Numbers of the clusters whose blocks the camera saw, changed or not."""


class MapClusters:
    """Follows one map; the cost follows the blocks that changed, not the map's size."""

    def __init__(self, voxel_map: VoxelMap) -> None:
        self._map = voxel_map
        self._revision = -1
        self._clusters: dict[int, Cluster] = {}
        self._at_block: dict[int, set[int]] = {}
        self._next = 1

    def update(self) -> ClusterChanges:
        """Cluster the voxels of the blocks that changed since the last call."""
        changed, seen = changed_blocks(self._map, self._revision)
        coords = self._map.block_coords
        self._revision = self._map.revision
        blocks = keys_of(coords[changed])
        fresh = self._labelled(changed)
        touched = self._touched(blocks) | self._dropped()
        replaced = {number: self._forget(number) for number in sorted(touched)}
        current = self._cluster(fresh, replaced, blocks)
        seen_blocks = keys_of(coords[seen]).tolist()
        numbers = frozenset(k for key in seen_blocks for k in self._at_block.get(key, ()))
        return ClusterChanges(replaced=replaced, current=current, seen=numbers)

    def _labelled(self, rows: NDArray[np.intp]) -> Keys:
        """Return the voxels of blocks that belong to things."""
        arrays, surface = self._map.arrays(), self._map.surface
        rows = rows[arrays.slab[rows] != NO_SLAB]
        slots = self._map.surface_slots[arrays.slab[rows]]
        is_thing = np.zeros(NO_LABEL + 1, np.bool_)
        is_thing[: len(self._map.labels)] = [label not in STRUCTURE for label in self._map.labels]
        keep = (slots != 0) & (arrays.state[rows] == OCCUPIED)
        keep &= is_thing[surface.label[slots]] & (surface.confidence[slots] >= _MIN_CONFIDENCE)
        block, k = np.nonzero(keep)
        inner = np.stack([k >> 6, (k >> 3) & 7, k & 7], axis=1)
        return keys_of(self._map.block_coords[rows[block]] * BLOCK_EDGE + inner)

    def _touched(self, blocks: Keys) -> set[int]:
        """Return the clusters that lie in some blocks, or next to them."""
        if not self._at_block:
            return set()
        around = [0, *(s * _delta(d) for d in _HALF for s in (-1, 1))]
        near = np.unique((blocks[:, None] + np.array(around, np.int64)).ravel())
        return {k for key in near.tolist() for k in self._at_block.get(key, ())}

    def _dropped(self) -> set[int]:
        """Return the clusters in blocks that the map has given up."""
        if not self._at_block:
            return set()
        blocks = np.array(list(self._at_block), np.int64)
        lost = blocks[_rows_of(self._map, indices_of(blocks)) < 0]
        return {k for key in lost.tolist() for k in self._at_block[key]}

    def _forget(self, number: int) -> Cluster:
        cluster = self._clusters.pop(number)
        for key in _blocks_of(cluster.keys).tolist():
            self._at_block[key].discard(number)
            if not self._at_block[key]:
                del self._at_block[key]
        return cluster

    def _cluster(
        self, fresh: Keys, replaced: dict[int, Cluster], blocks: Keys
    ) -> dict[int, Cluster]:
        """Cluster voxels of changed blocks with what is left of the clusters that they touch."""
        kept = [c.keys[~np.isin(_block_of(c.keys), blocks)] for c in replaced.values()]
        keys = np.unique(np.concatenate([fresh, *kept]))
        index = indices_of(keys)
        rows, columns = _rows_of(self._map, index >> 3), _columns_of(index)
        slab, surface = self._map.arrays().slab, self._map.surface
        there = rows >= 0
        slots = np.where(there, self._map.surface_slots[slab[rows], columns], 0)
        keys, slots = keys[slots != 0], slots[slots != 0]
        current: dict[int, Cluster] = {}
        member = _components(keys, surface.label[slots])
        order = np.argsort(member, kind="stable")
        bounds = np.flatnonzero(np.diff(member[order])) + 1
        for part in np.split(order, bounds) if len(order) else ():
            cluster = self._describe(keys[part], slots[part])
            current[self._next] = self._clusters[self._next] = cluster
            for key in _blocks_of(cluster.keys).tolist():
                self._at_block.setdefault(key, set()).add(self._next)
            self._next += 1
        return current

    def _describe(self, keys: Keys, slots: NDArray[np.int32]) -> Cluster:
        """Return a cluster, without a sighting where it has fewer voxels than such a thing."""
        surface, names = self._map.surface, self._map.labels
        size = self._map.config.voxel_size_m
        label = int(surface.label[slots[0]])
        if len(keys) < least_voxels(names[label], size):
            # It may grow: a change beside it clusters it again.
            return Cluster(sighting=None, keys=keys)
        energy = surface.energy[slots, : len(names)].astype(np.float64)
        odds = np.exp(-energy / STEPS_PER_NAT)
        probability = (odds / odds.sum(axis=1, keepdims=True)).mean(axis=0)
        index = indices_of(keys)
        position, extent = box_of(index.min(axis=0) * size, (index.max(axis=0) + 1) * size)
        others = [int(k) for k in np.argsort(-probability, kind="stable") if int(k) != label]
        others = [k for k in others[:_ALTERNATIVES] if probability[k] >= _LEAST_SHARE]
        return Cluster(
            keys=keys,
            sighting=Sighting(
                label=names[label],
                alternatives=tuple((names[k], float(probability[k])) for k in others),
                probability=float(probability[label]),
                position_world=position,
                size_m=extent,
                voxels=len(keys),
            ),
        )


def least_voxels(label: str, voxel_size_m: float) -> float:
    """Return how many surface voxels a thing shows at least."""
    side = min(load_knowledge().size_m(label), _MOST_M) / voxel_size_m
    return max(_LEAST_VOXELS, _SHARE_SEEN * side**2)


def share_observed(voxel_map: VoxelMap, sighting: Sighting) -> float:
    """Return the share of the voxels of a thing's box that the map knows as free or occupied."""
    size = voxel_map.config.voxel_size_m
    half = 0.5 * np.array(sighting.size_m)
    low = np.floor((np.array(sighting.position_world) - half) / size + 0.5).astype(np.int64)
    high = np.maximum(low + 1, np.floor((sighting.position_world + half) / size + 0.5))
    axes = [np.arange(a, b) for a, b in zip(low, high.astype(np.int64), strict=True)]
    index = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return share_known(voxel_map, index)


def share_known(voxel_map: VoxelMap, index: NDArray[np.int64]) -> float:
    """Return the share of (M, 3) voxels, M > 0, that the map knows as free or occupied."""
    centres = (index + np.float64(0.5)) * np.float64(voxel_map.config.voxel_size_m)
    return float((voxel_map.state_at(centres) != UNKNOWN).mean())


def keys_of(index: NDArray[np.int64]) -> Keys:
    """Pack (M, 3) voxel or block indices into (M,) numbers; neighbours differ by a constant."""
    shifted = index.astype(np.int64) + _OFFSET
    return (shifted[:, 0] << (2 * _BITS)) + (shifted[:, 1] << _BITS) + shifted[:, 2]


def indices_of(keys: Keys) -> NDArray[np.int64]:
    """Return the (M, 3) indices of `keys_of`."""
    mask = (1 << _BITS) - 1
    parts = [keys >> (2 * _BITS), (keys >> _BITS) & mask, keys & mask]
    return np.stack(parts, axis=1) - _OFFSET


def _delta(offset: tuple[int, int, int]) -> int:
    x, y, z = offset
    return (x << (2 * _BITS)) + (y << _BITS) + z


def _block_of(keys: Keys) -> Keys:
    return keys_of(indices_of(keys) >> 3)


def _blocks_of(keys: Keys) -> Keys:
    return np.unique(_block_of(keys))


def _rows_of(voxel_map: VoxelMap, blocks: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return (M,) pool rows of (M, 3) blocks, -1 for none."""
    arrays = voxel_map.arrays()
    at = blocks - arrays.origin_block
    inside = ((at >= 0) & (at < arrays.directory.shape)).all(axis=1)
    rows = np.full(len(blocks), -1, np.int64)
    x, y, z = at[inside].T
    rows[inside] = arrays.directory[x, y, z]
    return rows


def _columns_of(index: NDArray[np.int64]) -> NDArray[np.int64]:
    i, j, k = (index & 7).T
    return (i << 6) | (j << 3) | k


def _components(keys: Keys, labels: NDArray[np.uint8]) -> NDArray[np.int32]:
    """Return (M,) number of the part that each voxel belongs to.

    Args:
        keys: (M,) voxels in rising order.
        labels: (M,) voxels of different labels are never in one part.
    """
    if not len(keys):
        return np.zeros(0, np.int32)
    starts: list[Keys] = []
    ends: list[Keys] = []
    for offset in _HALF:
        at = np.minimum(np.searchsorted(keys, keys + _delta(offset)), len(keys) - 1)
        hit = np.flatnonzero((keys[at] == keys + _delta(offset)) & (labels[at] == labels))
        starts.append(hit)
        ends.append(at[hit])
    start, end = np.concatenate(starts), np.concatenate(ends)
    graph = coo_array((np.ones(len(start), np.int8), (start, end)), (len(keys), len(keys)))
    return connected_components(graph, directed=False)[1]
