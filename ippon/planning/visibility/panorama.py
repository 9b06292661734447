"""The panorama of a viewpoint: visible voxels summed by direction (Sec. Node Evaluation)."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.compiling import njit
from ippon.mapping.arrays import FREE, NOT_MAPPED, UNKNOWN, MapArrays
from ippon.planning.visibility.rays import cast_rays_kernel
from ippon.planning.visibility.view_table import ViewTable
from ippon.planning.voxel_lookup import block_row, voxel_column


class ViewField(NamedTuple):
    """The layers that count as dense arrays: state, and the number of images of each voxel.

    The field is so wide that no view from a mapped place reaches beyond it; its layers are those of
    the table.
    """

    origin: NDArray[np.int64]
    """(3,) voxel index of element (0, 0, 0)."""
    state: NDArray[np.uint8]
    """(X, Y, Z) `UNKNOWN`, `FREE` or `OCCUPIED`."""
    unknown_views: NDArray[np.uint8]
    """(X, Y, Z) images after which the voxel was still unknown."""
    surface_views: NDArray[np.uint8]
    """(X, Y, Z) images of the voxel as a surface."""


class ViewRules(NamedTuple):
    """What a visible voxel counts, in the terms of eqs. (3) and (4)."""

    unknown_occupied: float
    """p_occ of an unknown voxel."""
    unknown_depth: float
    """Voxels of unknown space that a ray crosses before it ends."""
    unknown_views: float
    """Images after which an unknown voxel has no gain: it is glass or a dark hole."""
    surface_views: float
    """Images after which a surface voxel has no gain."""
    surface_range: float
    """Range in voxels within which a surface has a gain: farther away no object is recognised."""
    ooi_floor: float
    """p(v in O) up to which a voxel counts as background."""
    ooi_threshold: float
    """p_T: above it a voxel is an object voxel."""
    termination_range: float
    """Horizontal reach of N_T in voxels."""
    termination_depth: float
    """Range in voxels beyond `termination_range` in which further object voxels count."""
    termination_depth_factor: float
    """Those count up to this many times the object voxels within reach."""
    termination_depth_columns: int
    """They count in columns up to this far from one with an object voxel within reach."""
    termination_fringe: float
    """Object voxels within reach that may be misclassified: they make none beyond it count."""
    level_range: float
    """Range in voxels within which labelled voxels decide p_img."""
    floor_layers: int = 0
    """Lowest layers of the field in which only object voxels count: an object that lies flat on the
    floor ends a search, but the floor has no gain."""


class Panorama(NamedTuple):
    """Sums per direction, pitch-major, for all orientations of the camera."""

    known: NDArray[np.float32]
    """(P, Y) sum of p(v in O) over visible voxels of V_O."""
    unknown: NDArray[np.float32]
    """(P, Y) sum of p_occ(v) over visible voxels outside V_O; times p_img it is their gain."""
    ooi: NDArray[np.float32]
    """(P, Y) object voxels of N_T."""
    behind: NDArray[np.float32]
    """(P, Y) object voxels a little farther away, in the directions of those."""
    levels: NDArray[np.int32]
    """(Y, 4) nearby labelled voxels by heading and level."""
    labelled: NDArray[np.int32]
    """(M,) rows of the table's offsets, rising, of the voxels that `levels` counts."""
    depth: NDArray[np.float32]
    """(P, Y) length of the ray in voxels; negative where it ended at a surface."""
    termination: float = 0.0
    """T(n), eq. (4): object voxels of N_T, and those of `behind` that count."""

    @property
    def framed(self) -> NDArray[np.float32]:
        """(P, Y) object voxels that an image should show."""
        return self.ooi + self.behind


def cast_panorama(
    arrays: MapArrays,
    table: ViewTable,
    rules: ViewRules,
    field: ViewField,
    camera_voxel: tuple[int, int, int],
) -> Panorama:
    """Sum the visible voxels of one viewpoint in every direction.

    Args:
        arrays: The map.
        table: Directions and offsets.
        rules: What a voxel counts.
        field: States and numbers of images.
        camera_voxel: Voxel that holds the camera.

    Raises:
        ValueError: The view reaches beyond the field.
    """
    if not within_field(table, field, camera_voxel):
        raise ValueError(f"voxel {camera_voxel} lies too close to the rim of the mapped space")
    shape = (table.pitch_bins, table.yaw_bins)
    out = Panorama(
        known=np.zeros(shape, dtype=np.float32),
        unknown=np.zeros(shape, dtype=np.float32),
        ooi=np.zeros(shape, dtype=np.float32),
        behind=np.zeros(shape, dtype=np.float32),
        levels=np.zeros((table.yaw_bins, 4), dtype=np.int32),
        labelled=np.empty(len(table.offset), dtype=np.int32),
        depth=np.empty(shape, dtype=np.float32),
    )
    camera = np.array(camera_voxel, dtype=np.int64)
    count = _panorama_kernel(arrays, table, rules, field, camera, out)
    _drop_other_directions(out.ooi, out.behind, rules.termination_depth_columns)
    reached = float(out.ooi.sum())
    most = rules.termination_depth_factor * max(0.0, reached - rules.termination_fringe)
    return out._replace(
        labelled=out.labelled[:count].copy(),
        termination=reached + min(float(out.behind.sum()), most),
    )


def _drop_other_directions(
    ooi: NDArray[np.float32], behind: NDArray[np.float32], columns: int
) -> None:
    """Clear (P, Y) `behind` away from the object voxels within reach: it is another object."""
    if not behind.any():
        return
    ahead = ooi.max(axis=0) > 0.0
    near = np.stack([np.roll(ahead, shift) for shift in range(-columns, columns + 1)])
    behind[:, near.max(axis=0) == 0] = 0.0


def within_field(table: ViewTable, field: ViewField, voxel: tuple[int, int, int]) -> bool:
    """Return whether the field holds every voxel that a camera at `voxel` can see."""
    reach = math.floor(table.range_voxels)
    low = np.array(voxel[:2]) - reach - field.origin[:2]
    return bool((low >= 0).all() and (low + 2 * reach < field.state.shape[:2]).all())


@njit(allocates=True, cache=True, nogil=True, error_model="numpy")
def _panorama_kernel(arrays, table, rules, field, camera, out):
    cx, cy, cz = camera[0], camera[1], camera[2]
    # The field is read as a flat array; `within_field` has excluded negative indices.
    fx, fy, fz = cx - field.origin[0], cy - field.origin[1], cz - field.origin[2]
    along_x, along_y = field.state.shape[1] * field.state.shape[2], field.state.shape[2]
    base = fx * along_x + fy * along_y + fz
    states = field.state.reshape(-1)
    unknown_views, surface_views = field.unknown_views.reshape(-1), field.surface_views.reshape(-1)
    hidden_worth, surface_worth = np.empty(256), np.empty(256)
    for c in range(256):
        hidden_worth[c] = rules.unknown_occupied * max(0.0, 1.0 - c / rules.unknown_views)
        surface_worth[c] = max(0.0, 1.0 - c / rules.surface_views)
    cells = np.empty(table.yaw_bins, dtype=np.int64)
    lengths = np.empty(table.yaw_bins)
    reach2 = rules.termination_range * rules.termination_range
    behind2 = (rules.termination_range + rules.termination_depth) ** 2
    labelled = 0
    for p in range(table.pitch_bins):
        group = table.group[p]
        count = table.yaw_bins // group
        for n in range(count):
            cells[n] = p * table.yaw_bins + n * group + group // 2
        cast_rays_kernel(
            arrays, table, rules.unknown_depth, camera, table.rays, cells[:count], lengths
        )
        for y in range(table.yaw_bins):
            cell = p * table.yaw_bins + y
            depth = lengths[y // group]
            out.depth[p, y] = depth
            # A surface is visible one voxel deep. Free and unknown space ends one voxel before it,
            # so that the unknown inside of a wall seen at a slant does not count.
            solid_end = (1.0 - depth) if depth < 0.0 else depth
            space_end = (-1.0 - depth) if depth < 0.0 else depth
            known, unknown, ooi, behind = 0.0, 0.0, 0.0, 0.0
            for n in range(table.start[cell], table.start[cell + 1]):
                far = table.range[n]
                if far > solid_end:
                    break
                dx, dy, dz = table.offset[n, 0], table.offset[n, 1], table.offset[n, 2]
                at = np.uint64(base + dx * along_x + dy * along_y + dz)
                state = states[at]
                if state == FREE:
                    continue
                if state == UNKNOWN:
                    if far <= space_end:
                        unknown += hidden_worth[unknown_views[at]]
                    continue
                i, j, k = cx + dx, cy + dy, cz + dz
                row = block_row(arrays, i, j, k)
                if row < 0:
                    # The block was evicted from a full map, with its labels.
                    continue
                column = voxel_column(i, j, k)
                fresh = surface_worth[surface_views[at]]
                slab = arrays.slab[row]
                code = arrays.ooi[slab, column]
                recognised = far <= rules.surface_range
                if code == NOT_MAPPED:
                    if recognised:
                        unknown += fresh
                else:
                    posterior = code / 254.0
                    if recognised and posterior > rules.ooi_floor:
                        known += posterior * fresh
                    if posterior > rules.ooi_threshold:
                        away2 = dx * dx + dy * dy
                        if away2 <= reach2:
                            ooi += 1.0
                        elif away2 <= behind2:
                            behind += 1.0
                level = arrays.level[slab, column]
                if level != NOT_MAPPED and far <= rules.level_range:
                    out.levels[y, level] += 1
                    out.labelled[labelled] = n
                    labelled += 1
            out.known[p, y] = known
            out.unknown[p, y] = unknown
            out.ooi[p, y] = ooi
            out.behind[p, y] = behind
    return labelled
