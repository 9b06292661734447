"""A map of painted voxels, and frames that look at boxes."""

from types import SimpleNamespace

import numpy as np
import pytest

from ippon.mapping.arrays import FREE, NOT_MAPPED, OCCUPIED, UNKNOWN, MapArrays
from ippon.mapping.objects.surface_voxels import ENERGY_MAX
from ippon.memory.instance import Instance
from ippon.vocabulary import MATTERPORT_40

VOXEL_M = 0.1
SIDE = 4
"""Blocks along each axis, from the world's origin."""


class PaintedMap:
    """What memory reads of a map, set voxel by voxel."""

    def __init__(self):
        self.labels = MATTERPORT_40
        self.revision = 0
        self.config = SimpleNamespace(voxel_size_m=VOXEL_M)
        blocks = SIDE**3
        grid = np.arange(blocks).reshape(SIDE, SIDE, SIDE)
        coord = np.stack(np.meshgrid(*[np.arange(SIDE)] * 3, indexing="ij"), -1).reshape(-1, 3)
        self._grid = grid.astype(np.int32)
        rows = blocks * 512 + 1
        self.pools = SimpleNamespace(
            used=np.ones(blocks, np.uint8),
            coord=coord.astype(np.int64),
            state=np.full((blocks, 512), UNKNOWN, np.uint8),
            slab=np.arange(1, blocks + 1, dtype=np.int32),
            slot=np.zeros((blocks + 1, 512), np.int32),
            appearance=np.zeros(blocks, np.int64),
            seen=np.zeros(blocks, np.int64),
        )
        self._pools = self.pools
        self.surface = SimpleNamespace(
            label=np.full(rows, 255, np.uint8),
            confidence=np.zeros(rows, np.uint8),
            energy=np.full((rows, len(MATTERPORT_40)), ENERGY_MAX, np.uint8),
        )

    def paint(self, low, high, label=None, other=None):
        """Make a box of voxels a thing; without a label it is free."""
        self.revision += 1
        for index in np.ndindex(*np.subtract(high, low)):
            voxel = np.add(low, index)
            row = int(self._grid[tuple(voxel >> 3)])
            i, j, k = voxel & 7
            column = (i << 6) | (j << 3) | k
            slot = row * 512 + column + 1
            self.pools.appearance[row] = self.pools.seen[row] = self.revision
            self.pools.state[row, column] = FREE if label is None else OCCUPIED
            self.pools.slot[row + 1, column] = 0 if label is None else slot
            if label is None:
                continue
            self.surface.energy[slot] = ENERGY_MAX
            self.surface.energy[slot, MATTERPORT_40.index(label)] = 0
            if other is not None:
                self.surface.energy[slot, MATTERPORT_40.index(other)] = 24
            self.surface.label[slot] = MATTERPORT_40.index(label)
            self.surface.confidence[slot] = 185 if other else 254

    @property
    def block_coords(self):
        return self.pools.coord

    @property
    def surface_slots(self):
        return self.pools.slot

    def look_at(self, low):
        """Have the camera see a voxel's block without a change."""
        self.revision += 1
        self.pools.seen[self._grid[tuple(np.array(low) >> 3)]] = self.revision

    def drop(self, low):
        """Give up a voxel's block."""
        self.revision += 1
        block = tuple(np.array(low) >> 3)
        self.pools.used[self._grid[block]] = 0
        self._grid[block] = -1

    def arrays(self):
        shown = {
            "voxel_size": VOXEL_M,
            "origin_block": np.zeros(3, np.int64),
            "directory": self._grid,
            "state": self.pools.state,
            "slab": self.pools.slab,
            "level": np.full((SIDE**3 + 1, 512), NOT_MAPPED, np.uint8),
        }
        return MapArrays(**{name: shown.get(name) for name in MapArrays._fields})

    def state_at(self, points):
        voxel = np.floor(points / VOXEL_M).astype(int)
        out = np.full(len(points), UNKNOWN, np.uint8)
        for n, v in enumerate(voxel):
            inside = (v >= 0).all() and (v < 8 * SIDE).all()
            row = self._grid[tuple(v >> 3)] if inside else -1
            if row >= 0:
                i, j, k = v & 7
                out[n] = self.pools.state[row, (i << 6) | (j << 3) | k]
        return out


@pytest.fixture
def painted_map():
    return PaintedMap()


@pytest.fixture
def make_instance():
    def make(instance_id=1, label="chair", at=(1.0, 1.0, 0.5), **fields):
        defaults = {
            "source": "map",
            "probability": 0.9,
            "size_m": (0.4, 0.4, 0.4),
            "voxels": 20,
            "first_seen_ns": 1,
            "last_seen_ns": 1,
        }
        return Instance(
            instance_id=instance_id, label=label, position_world=at, **(defaults | fields)
        )

    return make
