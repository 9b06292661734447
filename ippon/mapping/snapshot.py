"""Conversion of the map to plain arrays without gaps, and back."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ippon.errors import MapFileError
from ippon.mapping.arrays import BLOCK_VOLUME
from ippon.mapping.blocks import N_LAYER_FREE, N_ROWS, N_SLABS, BlockDirectory, Pools
from ippon.mapping.objects.surface_voxels import ENERGY_MAX, N_USED, SurfaceVoxels

BLOCK_LAYERS: Final = (
    "tsdf", "weight", "evidence", "state", "squared_distance", "slab", "coord", "revision",
    "appearance", "seen", "settled", "best_ooi", "occupied", "layer_free",
)  # fmt: skip
SLAB_LAYERS: Final = ("slot", "ooi", "level")
SURFACE_LAYERS: Final = (
    "energy", "log_norm", "log_odds", "color", "color_count", "label", "confidence", "proximity",
)  # fmt: skip

Arrays = dict[str, NDArray[Any]]


def capture(pools: Pools, surface: SurfaceVoxels, labels: int) -> Arrays:
    """Copy all rows in use, renumbered without gaps."""
    n, m = int(pools.tally[N_ROWS]), int(surface.tally[N_USED])
    blocks = np.flatnonzero(pools.used[:n])
    rows = np.flatnonzero(surface.voxel[:m] >= 0)
    renumbered = np.zeros(m, np.int32)
    renumbered[rows] = np.arange(1, len(rows) + 1)
    arrays: Arrays = {name: getattr(pools, name)[blocks] for name in BLOCK_LAYERS}
    own = np.flatnonzero(arrays["slab"])
    arrays |= {name: getattr(pools, name)[arrays["slab"][own]] for name in SLAB_LAYERS}
    arrays["slab"][own] = np.arange(1, len(own) + 1)
    arrays["slot"] = renumbered[arrays["slot"]]
    arrays |= {f"surface_{name}": getattr(surface, name)[rows] for name in SURFACE_LAYERS}
    arrays["surface_energy"] = arrays["surface_energy"][:, :labels]
    return arrays


def restore(
    arrays: Arrays, pools: Pools, surface: SurfaceVoxels, directory: BlockDirectory
) -> None:
    """Fill a new map with captured arrays.

    Raises:
        MapFileError: The arrays contradict each other or do not fit.
    """
    n, m = _check(arrays, pools, surface)
    if n == 0:
        return
    coord = arrays["coord"]
    low, high = coord.min(axis=0), coord.max(axis=0) + 1
    if not directory.fits(low, high):
        raise MapFileError(
            "the saved map reaches farther than mission.map.directory_max_cells holds"
        )
    directory.cover(low, high)
    for name in BLOCK_LAYERS:
        getattr(pools, name)[:n] = arrays[name]
    pools.used[:n] = 1
    pools.tally[N_ROWS] = n
    pools.tally[N_LAYER_FREE] = int(pools.layer_free[:n].sum())
    at = coord - directory.origin
    directory.rows[at[:, 0], at[:, 1], at[:, 2]] = np.arange(n, dtype=np.int32)
    labels = arrays["surface_energy"].shape[1]
    surface.energy[1 : m + 1, :labels] = arrays["surface_energy"]
    surface.energy[1 : m + 1, labels:] = ENERGY_MAX
    for name in SURFACE_LAYERS[1:]:
        getattr(surface, name)[1 : m + 1] = arrays[f"surface_{name}"]
    surface.tally[N_USED] = m + 1
    slot = arrays["slot"]
    for name in SLAB_LAYERS:
        getattr(pools, name)[1 : len(slot) + 1] = arrays[name]
    pools.tally[N_SLABS] = len(slot) + 1
    block = np.flatnonzero(arrays["slab"])[np.argsort(arrays["slab"][arrays["slab"] > 0])]
    slab, voxel = np.nonzero(slot)
    surface.voxel[slot[slab, voxel]] = (block[slab] * BLOCK_VOLUME + voxel).astype(np.int32)


def _check(arrays: Arrays, pools: Pools, surface: SurfaceVoxels) -> tuple[int, int]:
    """Return numbers of blocks and of surface rows."""
    missing = [k for k in (*BLOCK_LAYERS, *SLAB_LAYERS) if k not in arrays]
    missing += [k for k in SURFACE_LAYERS if f"surface_{k}" not in arrays]
    if missing:
        raise MapFileError(f"the saved map lacks {', '.join(missing)}")
    n, m, slabs = len(arrays["coord"]), len(arrays["surface_energy"]), len(arrays["slot"])
    for name in (*BLOCK_LAYERS, *SLAB_LAYERS):
        pool, saved = getattr(pools, name), arrays[name]
        rows = slabs if name in SLAB_LAYERS else n
        if saved.shape != (rows, *pool.shape[1:]) or saved.dtype != pool.dtype:
            raise MapFileError(f"the saved map's {name} is {saved.shape} {saved.dtype}")
    for name in SURFACE_LAYERS:
        pool, saved = getattr(surface, name), arrays[f"surface_{name}"]
        width = saved.shape[1:] if name == "energy" else pool.shape[1:]
        if saved.shape != (m, *width) or saved.dtype != pool.dtype:
            raise MapFileError(f"the saved map's surface {name} is {saved.shape} {saved.dtype}")
    if n > len(pools.used) or m + 1 > len(surface.voxel):
        raise MapFileError(
            f"the saved map has {n} blocks and {m} surface voxels, this one is bounded to "
            f"{len(pools.used)} and {len(surface.voxel) - 1}; raise mission.map.memory_limit_mb"
        )
    used = arrays["slot"][arrays["slot"] != 0]
    own = arrays["slab"][arrays["slab"] != 0]
    if n and (
        not np.array_equal(np.sort(own), np.arange(1, slabs + 1))
        or used.size != m
        or not np.array_equal(np.sort(used), np.arange(1, m + 1))
        or len(np.unique(arrays["coord"], axis=0)) != n
        or int(arrays["state"].max()) > 2
    ):
        raise MapFileError("the saved map contradicts itself")
    return n, m
