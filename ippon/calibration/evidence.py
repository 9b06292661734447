"""Scores of images at surface voxels whose true label is known."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from ippon.calibration.known_objects import KnownObjects
from ippon.compiling import njit
from ippon.frame import Frame
from ippon.geometry import Float64Array, transform_points
from ippon.mapping.objects.places import place_of
from ippon.observation import Heatmap
from ippon.observation_model import NOTHING_SAID

CORE_SHARE: Final = 0.3
"""Surface within this share of an object's size from its centre belongs to the object."""
_LEAST_CORE_M: Final = 0.08
"""Accuracy of the known centres, metres."""
_AROUND_M: Final = 0.3
"""Surface beyond an object's half size plus this does not belong to the object, metres."""
_PLACES: Final = 64
_HALF_BITS: Final = 20
"""Voxel coordinates are packed to 21 bits each: 50 km at 5 cm."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Evidence:
    """Heatmap values of one label over a recording."""

    label: str
    values: Any
    """(G, 256) CSR float32: for each place of each voxel, the share of its images with each heatmap
    value."""
    place: NDArray[np.uint8]
    """(G,) place of each row of `values`; see `ippon.mapping.objects.places.place_of`."""
    images: NDArray[np.int64]
    """(G,) number of images from that place."""
    first: NDArray[np.int64]
    """(V,) first row of `values` of each voxel."""
    of_object: NDArray[np.int64]
    """(V,) number of the known object of the voxel, -1 for none."""
    objects: int
    """Number of known objects of the label that were in view."""


_ALL: Final = slice(None)


class EvidenceCollector:
    """Collects the heatmap values of surface voxels as the map's filter reads them.

    Args:
        labels: Labels with known objects, or known to be absent.
        voxel_size_m: Edge of a voxel.
        range_m: Range within which surface is used.

    Raises:
        ValueError: The edge is not positive and finite.
    """

    def __init__(self, labels: Sequence[str], voxel_size_m: float, range_m: float) -> None:
        if not 0.0 < voxel_size_m < np.inf:
            raise ValueError(f"voxel_size_m must be positive; got {voxel_size_m}")
        self.labels = tuple(labels)
        self._size = voxel_size_m
        self._range = range_m
        self._keys: list[NDArray[np.int64]] = []
        self._places: list[NDArray[np.uint8]] = []
        self._values: list[NDArray[np.uint8]] = []
        self._grouped: tuple[tuple[int | None, ...], _Groups] | None = None

    def add(self, frame: Frame, heatmap: Heatmap) -> None:
        """Add a frame; labels that the heatmap lacks are skipped.

        Args:
            frame: Depth and pose.
            heatmap: Of kind `scores`, from `heatmap_of_instances` with this depth.
        """
        h, w, _ = heatmap.probabilities.shape
        rows, columns = frame.depth.shape
        v = ((2 * np.arange(h) + 1) * rows) // (2 * h)
        u = ((2 * np.arange(w) + 1) * columns) // (2 * w)
        depth = frame.depth[np.ix_(v, u)]
        at_v, at_u = np.nonzero(np.isfinite(depth) & (depth > 0.0) & (depth <= self._range))
        z, c = depth[at_v, at_u].astype(np.float64), frame.camera
        rays = np.stack([(u[at_u] - c.cx) / c.fx, (v[at_v] - c.cy) / c.fy, np.ones(len(z))], 1)
        points = transform_points(frame.T_world_camera, rays * z[:, None])
        voxels = np.floor(points / self._size).astype(np.int64)
        keys, one = np.unique(_pack(voxels), return_index=True)
        away = frame.T_world_camera[:3, 3] - (voxels[one] + 0.5) * self._size
        asked = [*heatmap.labels, *([heatmap.ooi] if heatmap.ooi not in heatmap.labels else [])]
        values = np.full((len(one), len(self.labels)), NOTHING_SAID, np.uint8)
        for k, label in enumerate(self.labels):
            if label in asked:
                channel = asked.index(label)
                values[:, k] = heatmap.probabilities[at_v[one], at_u[one], channel]
        self._keys.append(keys)
        self._places.append(_places_of(away))
        self._values.append(values)

    @property
    def frames(self) -> int:
        """Number of frames added."""
        return len(self._keys)

    def evidence(
        self, known: KnownObjects, T_map_world: Float64Array, frames: slice = _ALL
    ) -> list[Evidence]:
        """Return the evidence of each label that was in view.

        Args:
            known: Known objects, in the recording's own world.
            T_map_world: (4, 4) from there to the frames' world.
            frames: Frames to use.
        """
        if not self._keys[frames]:
            return []
        groups = self._groups(frames)
        found: list[Evidence] = []
        for k, label in enumerate(self.labels):
            of_object, objects = _objects_at(groups.centres, known, label, T_map_world)
            used = (of_object >= 0) | ((of_object == _NO_OBJECT) & known.is_complete(label))
            if not used.any():
                continue
            rows = used[groups.owner]
            seen = rows[groups.of_image]
            row_of = (np.cumsum(rows) - 1)[groups.of_image[seen]]
            shares = (1.0 / groups.images).astype(np.float32)[groups.of_image[seen]]
            found.append(
                Evidence(
                    label=label,
                    values=csr_matrix(
                        (shares, (row_of, groups.values[seen, k])),
                        shape=(np.count_nonzero(rows), 256),
                        dtype=np.float32,
                    ),
                    place=groups.place[rows],
                    images=groups.images[rows],
                    first=np.flatnonzero(np.diff(groups.owner[rows], prepend=-1)),
                    of_object=of_object[used],
                    objects=objects,
                )
            )
        return found

    def _groups(self, frames: slice) -> "_Groups":
        """Return the images of some frames by voxel and place; those of the last call are kept."""
        asked = frames.start, frames.stop, frames.step, self.frames
        if self._grouped is None or self._grouped[0] != asked:
            keys, places = np.concatenate(self._keys[frames]), np.concatenate(self._places[frames])
            values = np.concatenate(self._values[frames])
            self._grouped = asked, _grouped(keys, places, values, self._size)
        return self._grouped[1]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Groups:
    """Images of voxels by voxel and place."""

    values: NDArray[np.uint8]
    """(N, labels) heatmap values of each image of a voxel."""
    of_image: NDArray[np.int64]
    """(N,) group of each of them."""
    place: NDArray[np.uint8]
    """(G,) place of each group."""
    images: NDArray[np.int64]
    """(G,) number of its images."""
    owner: NDArray[np.int64]
    """(G,) its voxel."""
    centres: Float64Array
    """(V, 3) centres of the voxels."""


def _grouped(
    keys: NDArray[np.int64], places: NDArray[np.uint8], values: NDArray[np.uint8], size_m: float
) -> _Groups:
    order = np.argsort(keys, kind="stable")
    order = order[_taught(keys[order], places[order])]
    voxels, voxel_of = np.unique(keys[order], return_inverse=True)
    groups, of_image = np.unique(voxel_of * _PLACES + places[order], return_inverse=True)
    return _Groups(
        values=values[order],
        of_image=of_image,
        place=(groups % _PLACES).astype(np.uint8),
        images=np.bincount(of_image),
        owner=groups // _PLACES,
        centres=(_unpack(voxels).astype(np.float64) + 0.5) * size_m,
    )


_NO_OBJECT: Final = -1
_NEITHER: Final = -2


def _objects_at(
    centres: Float64Array, known: KnownObjects, label: str, T_map_world: Float64Array
) -> tuple[NDArray[np.int64], int]:
    """Return (V,) the known object of each voxel, and the number of objects with a voxel."""
    of_object = np.full(len(centres), _NO_OBJECT, np.int64)
    cores: list[NDArray[np.bool_]] = []
    for one in (*known.objects, *known.unclear):
        if one.label != label:
            continue
        at = transform_points(T_map_world, np.array([one.centre_world]))[0]
        away = np.linalg.norm(centres - at, axis=1)
        of_object[away <= 0.5 * one.about_m + _AROUND_M] = _NEITHER
        if one in known.objects:
            cores.append(away <= max(CORE_SHARE * one.about_m, _LEAST_CORE_M))
    for n, core in enumerate(cores):
        of_object[core] = n
    # Objects that were not seen, or whose place another one has, are none.
    seen = np.unique(of_object[of_object >= 0])
    of_object[of_object >= 0] = np.searchsorted(seen, of_object[of_object >= 0])
    return of_object, len(seen)


def _taught(keys: NDArray[np.int64], places: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return which images of voxels count: those from a place after it was left do not.

    Args:
        keys: (N,) voxels, sorted, the images of each in temporal order.
        places: (N,) place of each image.
    """
    opens = np.ones(len(keys), np.bool_)
    opens[1:] = (np.diff(keys) != 0) | (np.diff(places.astype(np.int16)) != 0)
    visit = np.cumsum(opens)
    order = np.lexsort((visit, places, keys))
    k, p, n = keys[order], places[order], visit[order]
    begins = np.ones(len(k), np.bool_)
    begins[1:] = (np.diff(k) != 0) | (np.diff(p.astype(np.int16)) != 0)
    first = n[np.flatnonzero(begins)][np.cumsum(begins) - 1]
    counts = np.empty(len(keys), np.bool_)
    counts[order] = n == first
    return counts


def _pack(voxels: NDArray[np.int64]) -> NDArray[np.int64]:
    x, y, z = (voxels + (1 << _HALF_BITS)).T
    return (x << (2 * _HALF_BITS + 2)) | (y << (_HALF_BITS + 1)) | z


def _unpack(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    mask = (1 << (_HALF_BITS + 1)) - 1
    columns = (keys >> (2 * _HALF_BITS + 2), (keys >> (_HALF_BITS + 1)) & mask, keys & mask)
    return np.stack(columns, axis=1) - (1 << _HALF_BITS)


@njit(allocates=True, cache=True)
def _places_of(away):
    out = np.empty(len(away), np.uint8)
    for n in range(len(away)):
        out[n] = place_of(away[n, 0], away[n, 1], away[n, 2])
    return out
