"""Clusters of voxels that are probably the object."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array, invert_transform, transform_points
from ippon.mission.snapshot import Find
from ippon.planning.selection.voxel_clusters import clusters_of


def cluster_finds(
    centres_world: Float64Array,
    probabilities: NDArray[np.float64],
    voxel_size: float,
    *,
    camera: PinholeCamera,
    T_world_camera: Float64Array,
    is_too_large: Callable[[Find], bool] | None = None,
    sure: float = 1.0,
) -> tuple[Find, ...]:
    """Join voxels that touch (one voxel of gap allowed) into finds, most voxels first.

    A detector's box covers some of the surroundings, and a false detection may adjoin the object.
    A find that is too large is therefore reduced to its clusters of sure voxels, if they are not.

    Args:
        centres_world: (M, 3) metres.
        probabilities: (M,) p(v in O).
        voxel_size: Edge of a voxel, metres.
        camera: Intrinsics of the present colour image.
        T_world_camera: Pose of its camera.
        is_too_large: Returns whether a find is larger than the object; None for any size.
        sure: p(v in O) from which a voxel is sure.
    """
    finds: list[Find] = []
    for member in clusters_of(centres_world, voxel_size):
        find = _find_of(
            centres_world[member], probabilities[member], voxel_size, camera, T_world_camera
        )
        if is_too_large is None or not is_too_large(find):
            finds.append(find)
            continue
        among = member[probabilities[member] >= sure]
        parts = [among[part] for part in clusters_of(centres_world[among], voxel_size)]
        reduced = [
            _find_of(centres_world[part], probabilities[part], voxel_size, camera, T_world_camera)
            for part in parts
        ]
        finds += [part for part in reduced if not is_too_large(part)] or [find]
    return tuple(sorted(finds, key=lambda find: -find.voxels))


def _find_of(
    centres: Float64Array,
    probabilities: NDArray[np.float64],
    voxel_size: float,
    camera: PinholeCamera,
    T_world_camera: Float64Array,
) -> Find:
    low, high = centres.min(axis=0) - 0.5 * voxel_size, centres.max(axis=0) + 0.5 * voxel_size
    centroid = centres.mean(axis=0)
    x, y, z = (float(c) for c in centroid)
    sx, sy, sz = (float(s) for s in high - low)
    return Find(
        position_world=(x, y, z),
        size_m=(sx, sy, sz),
        probability=float(probabilities.mean()),
        voxels=int(centres.shape[0]),
        box_px=project_box(centres, voxel_size, camera, T_world_camera),
    )


def project_box(
    centres_world: Float64Array,
    voxel_size: float,
    camera: PinholeCamera,
    T_world_camera: Float64Array,
) -> tuple[int, int, int, int] | None:
    """Return the pixel box (u0, v0, u1, v1) around voxels; None if none of them is in view."""
    points = transform_points(invert_transform(T_world_camera), centres_world)
    points = points[points[:, 2] > 0.1]
    u, v = camera.project(points)
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    if not inside.any():
        return None
    margin = 0.5 * voxel_size * camera.fx / points[inside, 2]
    u0 = max(0, int((u[inside] - margin).min()))
    v0 = max(0, int((v[inside] - margin).min()))
    u1 = min(camera.width - 1, int((u[inside] + margin).max()))
    v1 = min(camera.height - 1, int((v[inside] + margin).max()))
    return u0, v0, u1, v1
