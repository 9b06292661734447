"""What a view must redraw, voxel by voxel in dictionaries."""

from ippon.mapping.arrays import OCCUPIED
from ippon.mapping.objects.surface_changes import SurfaceThresholds
from ippon.mapping.voxel_map import VoxelMap

Index = tuple[int, int, int]
Looks = tuple[int, ...]
"""Red, green, blue, ooi, proximity, level, label, confidence."""


def looks(voxel_map: VoxelMap) -> dict[Index, Looks]:
    """Return the looks of every surface voxel."""
    pools, rows = voxel_map._pools, voxel_map.surface
    out: dict[Index, Looks] = {}
    for block in range(int(pools.tally[0])):
        if not pools.used[block]:
            continue
        x, y, z = (8 * int(c) for c in pools.coord[block])
        slab = pools.slab[block]
        for k in range(512):
            slot = pools.slot[slab, k]
            if slot == 0 or pools.state[block, k] != OCCUPIED:
                continue
            values = (
                *rows.color[slot], pools.ooi[slab, k], rows.proximity[slot], pools.level[slab, k],
                rows.label[slot], rows.confidence[slot],
            )  # fmt: skip
            out[x + k // 64, y + k // 8 % 8, z + k % 8] = tuple(int(v) for v in values)
    return out


def is_visible_change(before: Looks, now: Looks, least: SurfaceThresholds) -> bool:
    """Tell whether a voxel's looks changed by more than what is too small to be worth sending."""
    limits = (*(least.color,) * 3, *(least.probability,) * 2, 0, 0, least.confidence)
    if any((a == 255) != (b == 255) for a, b in zip(before[3:5], now[3:5], strict=True)):
        return True
    return any(abs(a - b) > limit for a, b, limit in zip(before, now, limits, strict=True))


def delta(
    shown: dict[Index, Looks], voxel_map: VoxelMap, least: SurfaceThresholds
) -> dict[Index, Looks | None]:
    """Return what changed visibly, None for voxels that are surface no more; updates `shown`."""
    now = looks(voxel_map)
    out: dict[Index, Looks | None] = {index: None for index in shown if index not in now}
    out |= {
        index: values
        for index, values in now.items()
        if index not in shown or is_visible_change(shown[index], values, least)
    }
    for index, values in out.items():
        if values is None:
            del shown[index]
        else:
            shown[index] = values
    return out
