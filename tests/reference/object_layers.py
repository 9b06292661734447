"""Changes of the object of interest and of levels, one surface voxel at a time."""

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.objects.posterior_arithmetic import LOG_ODDS_MAX
from ippon.mapping.objects.surface_voxels import NO_LABEL, STEPS_PER_NAT
from ippon.mapping.voxel_map import VoxelMap


def labelled(voxel_map: VoxelMap) -> list[tuple[int, int, int]]:
    """Return surface row, block and column of every labelled voxel."""
    rows = voxel_map.surface
    return [
        (slot, int(rows.voxel[slot]) // 512, int(rows.voxel[slot]) % 512)
        for slot in range(1, int(rows.tally[0]))
        if rows.voxel[slot] >= 0 and rows.label[slot] != NO_LABEL
    ]


def posterior(voxel_map: VoxelMap, slot: int) -> NDArray[np.float64]:
    """Return q (N,) of a surface row."""
    energy = voxel_map.surface.energy[slot, : len(voxel_map.labels)].astype(np.float64)
    p = np.exp(-energy / STEPS_PER_NAT)
    return p / p.sum()


def log_odds_of_label(voxel_map: VoxelMap, slot: int, label: int) -> float:
    """Return the log-odds that an OOI which is a common label starts from."""
    q = float(posterior(voxel_map, slot)[label])
    return float(np.clip(np.log(q) - np.log(max(1.0 - q, 1e-9)), -LOG_ODDS_MAX, LOG_ODDS_MAX))


def proximity(voxel_map: VoxelMap, slot: int, probabilities: NDArray[np.float32]) -> float:
    """Return l(v) of a surface row for (N,) l(O | C_j)."""
    return float(posterior(voxel_map, slot) @ probabilities)


def center(voxel_map: VoxelMap, block: int, column: int) -> NDArray[np.float64]:
    """Return a voxel's centre, metres."""
    local = np.array([column // 64, column // 8 % 8, column % 8])
    return (voxel_map._pools.coord[block] * 8 + local + 0.5) * voxel_map.config.voxel_size_m
