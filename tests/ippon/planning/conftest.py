"""Maps made from dense volumes, so that tests know every voxel."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from ippon.mapping.arrays import BLOCK_VOLUME, FREE, NOT_MAPPED, OCCUPIED, UNKNOWN, MapArrays


class DenseMap:
    """A volume of whole blocks whose corner is voxel `origin * 8`; boxes are in metres."""

    def __init__(
        self,
        size_m: tuple[float, float, float] = (6.4, 6.4, 2.4),
        origin: tuple[int, int, int] = (0, 0, -1),
        voxel_size: float = 0.1,
    ) -> None:
        self.voxel_size = voxel_size
        self.origin = np.array(origin, dtype=np.int64)
        self.blocks = np.maximum(1, np.ceil(np.array(size_m) / (8 * voxel_size) - 1e-9)).astype(int)
        self.blocks[2] -= origin[2]
        shape = tuple(8 * self.blocks)
        self.state = np.full(shape, UNKNOWN, dtype=np.uint8)
        self.ooi = np.full(shape, NOT_MAPPED, dtype=np.uint8)
        self.level = np.full(shape, NOT_MAPPED, dtype=np.uint8)
        self.missing = np.zeros(tuple(self.blocks), dtype=bool)
        self.revision = 0
        self._last: tuple[NDArray, ...] | None = None
        self._squared_distance: NDArray | None = None
        self._revisions = np.zeros(int(np.prod(self.blocks)), dtype=np.int64)

    def _slices(self, low, high) -> tuple[slice, ...]:
        base = self.origin * 8
        a = np.maximum(np.round(np.array(low) / self.voxel_size).astype(int) - base, 0)
        b = np.round(np.array(high) / self.voxel_size).astype(int) - base
        return tuple(slice(int(p), max(int(p), int(q))) for p, q in zip(a, b, strict=True))

    def fill(self, low, high, state: int, *, ooi: float | None = None, level: int | None = None):
        """Set a box [low, high) in metres; surfaces without labels stay unlabelled."""
        box = self._slices(low, high)
        self.state[box] = state
        self.ooi[box] = NOT_MAPPED if ooi is None else round(ooi * 254)
        self.level[box] = NOT_MAPPED if level is None else level
        return self

    def room(
        self, low, high, *, ooi: float | None = 0.0, level: int | None = 1, height: float = 2.0
    ):
        """Free space over a floor (top at z = 0) inside walls 0.1 m thick that lie outside."""
        (x0, y0), (x1, y1) = low, high
        v = self.voxel_size
        self.fill((x0 - v, y0 - v, -v), (x1 + v, y1 + v, height), OCCUPIED, ooi=ooi, level=level)
        return self.fill((x0, y0, 0.0), (x1, y1, height), FREE)

    def arrays(self) -> MapArrays:
        """The map as the kernels see it; blocks that changed since the last call are newer."""
        grouped = [self._grouped(a) for a in (self.state, self.ooi, self.level)]
        if self._last is not None:
            changed = np.zeros(len(self._revisions), dtype=bool)
            for now, before in zip(grouped, self._last, strict=True):
                changed |= (now != before).any(axis=1)
        else:
            changed = np.ones(len(self._revisions), dtype=bool)
        if changed.any():
            self.revision += 1
            self._revisions[changed] = self.revision
        self._last = tuple(g.copy() for g in grouped)
        if self._squared_distance is None or changed.any():
            self._squared_distance = self._grouped(self._squared().astype(np.uint16))
        directory = np.arange(self.missing.size, dtype=np.int32).reshape(self.missing.shape)
        directory[self.missing] = -1
        return MapArrays(
            voxel_size=self.voxel_size,
            origin_block=self.origin.copy(),
            directory=directory,
            state=grouped[0],
            slab=np.arange(directory.size, dtype=np.int32),
            ooi=grouped[1],
            level=grouped[2],
            squared_distance=self._squared_distance.copy(),
            revision=self._revisions.copy(),
        )

    def _squared(self) -> NDArray:
        occupied = self.state == OCCUPIED
        squared = np.full(self.state.shape, round(1.0 / self.voxel_size) ** 2)
        if occupied.any():
            squared = np.minimum(squared, np.rint(distance_transform_edt(~occupied) ** 2))
        return squared

    def _grouped(self, volume: NDArray) -> NDArray:
        a, b, c = self.blocks
        split = volume.reshape(a, 8, b, 8, c, 8).transpose(0, 2, 4, 1, 3, 5)
        return np.ascontiguousarray(split.reshape(-1, BLOCK_VOLUME))


def _two_rooms(door_m: float = 1.0) -> DenseMap:
    """Rooms of 3 x 4 m side by side, a door in the middle of the wall between them."""
    volume = DenseMap((8.0, 5.6, 2.4))
    volume.room((0.8, 0.8), (3.8, 4.8))
    volume.room((3.9, 0.8), (6.9, 4.8))
    middle = 2.8
    return volume.fill((3.8, middle - door_m / 2, 0.0), (3.9, middle + door_m / 2, 2.0), FREE)


@pytest.fixture
def dense_map() -> type[DenseMap]:
    return DenseMap


@pytest.fixture
def l_shape(dense_map):
    """A corridor 1 m wide along x, then along y; nothing else is known."""
    volume = dense_map((6.4, 6.4, 2.4))
    volume.fill((0.7, 0.7, -0.1), (5.3, 1.9, 2.0), OCCUPIED, ooi=0.0, level=1)
    volume.fill((4.1, 0.7, -0.1), (5.3, 5.3, 2.0), OCCUPIED, ooi=0.0, level=1)
    volume.fill((0.8, 0.8, 0.0), (5.2, 1.8, 2.0), FREE)
    return volume.fill((4.2, 0.8, 0.0), (5.2, 5.2, 2.0), FREE)


@pytest.fixture
def two_rooms() -> Callable[..., DenseMap]:
    return _two_rooms


@pytest.fixture
def corner() -> DenseMap:
    """An L of corridors 1 m wide whose legs are 3.6 m long."""
    volume = DenseMap((6.4, 6.4, 2.4))
    volume.fill((0.7, 0.7, -0.1), (5.3, 1.9, 2.0), OCCUPIED)
    volume.fill((4.1, 0.7, -0.1), (5.3, 5.3, 2.0), OCCUPIED)
    volume.fill((0.8, 0.8, 0.0), (5.2, 1.8, 2.0), FREE)
    return volume.fill((4.2, 0.8, 0.0), (5.2, 5.2, 2.0), FREE)


@pytest.fixture
def speckled() -> Callable[[int], DenseMap]:
    """Maps of random boxes, holes, labels and missing blocks."""

    def make(seed: int) -> DenseMap:
        rng = np.random.default_rng(seed)
        volume = DenseMap((4.8, 4.8, 2.4), origin=(int(rng.integers(-4, 4)), -2, -1))
        corner = volume.origin * 8 * volume.voxel_size
        size = np.array(volume.state.shape) * volume.voxel_size
        volume.fill(corner, corner + size, FREE)
        volume.fill(corner, (corner[0] + size[0], corner[1] + size[1], 0.0), OCCUPIED, ooi=0.0)
        for _ in range(14):
            low = corner + rng.random(3) * size * (1.0, 1.0, 0.8)
            high = low + 0.1 + rng.random(3) * 0.8
            state = int(rng.choice([UNKNOWN, FREE, OCCUPIED]))
            volume.fill(low, np.minimum(high, corner + size), state)
        occupied = volume.state == OCCUPIED
        labelled = occupied & (rng.random(volume.state.shape) < 0.7)
        volume.ooi[labelled] = rng.choice([0, 5, 60, 230, 254], size=int(labelled.sum()))
        volume.level[labelled] = rng.integers(0, 4, size=int(labelled.sum()))
        volume.missing = rng.random(volume.missing.shape) < 0.1
        return volume

    return make
