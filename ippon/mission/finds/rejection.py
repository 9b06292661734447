"""Excludes finds from the search.

The operator rejects finds; images and sizes contradict candidates; where several are wanted, those
that were found are counted. Candidates that continue an excluded find are excluded with it.
"""

from ippon.frame import Frame
from ippon.mapping.goal_layers.goal_layers import GoalLayer
from ippon.mapping.objects.ooi_suppression import SuppressedRegion
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.finds.find_geometry import (
    ExclusionSphere,
    exclusion_of_itself,
    exclusion_sphere,
    gap_m,
    looked_at,
)
from ippon.mission.search import Search, SetAside
from ippon.mission.snapshot import Find


def evidence_of(search: Search, voxel_map: VoxelMap) -> VoxelMap | GoalLayer:
    """Return the map's evidence for the goal of a search: its only one, or one of several."""
    return voxel_map if search.layer is None else search.layer


def reject_find(
    search: Search, voxel_map: VoxelMap, frame: Frame | None, find: Find | None
) -> None:
    """Exclude a find, so that the search can continue; after its end, with the others counted.

    Args:
        search: The search.
        voxel_map: The map, whose evidence for the object is removed there.
        frame: The last frame, None before the first.
        find: One of the search's finds; None for a search that ended without one.
    """
    if find in search.counted:
        search.counted.remove(find)
    if search.over:
        last = search.drop_find()
        if last is not None and last != find:
            count_known(search, voxel_map, last)
    if find is not None:
        reject_known(search, voxel_map, find)
    elif frame is not None:
        # The voxels of the find have disappeared: it was at the centre of the image.
        evidence_of(search, voxel_map).suppress_ooi(
            looked_at(frame), search.exclusion.image_radius_m
        )


def count_find(search: Search, voxel_map: VoxelMap) -> None:
    """Count the find that ended a search, and exclude it so that the search continues.

    Args:
        search: A search that wants more.
        voxel_map: The map, whose evidence for the object is removed there.
    """
    find = search.drop_find()
    if find is not None:
        count_known(search, voxel_map, find)


def count_known(search: Search, voxel_map: VoxelMap, find: Find) -> None:
    """Count a find of a search that wants more, and exclude it."""
    search.counted.append(search.numbered(find))
    exclude_only(search, voxel_map, find)


def reject_known(search: Search, voxel_map: VoxelMap, find: Find) -> None:
    """Exclude a find that the operator rejected, and keep it in mind."""
    search.refused.append(search.numbered(find))
    _exclude(search, voxel_map, exclusion_sphere(search.exclusion, find))


def exclude_only(search: Search, voxel_map: VoxelMap, find: Find) -> None:
    """Exclude a find for the rest of a search, no further than itself: one may stand beside it."""
    _exclude(search, voxel_map, exclusion_of_itself(find, voxel_map.config.voxel_size_m))


def is_clear_of(voxel_map: VoxelMap, find: Find, kept: Find) -> bool:
    """Return whether `exclude_only` of a find leaves another one as it is."""
    region = exclusion_of_itself(find, voxel_map.config.voxel_size_m)
    return gap_m(region.centre_world, kept) > region.radius_m + region.margin_m


def set_aside(search: Search, voxel_map: VoxelMap, find: Find) -> None:
    """Set a candidate aside that images or its size contradict; exclude it the second time."""
    search.arrived_steps = 0
    region = exclusion_sphere(search.exclusion, find)
    if search.is_reconsidered(find):
        _exclude(search, voxel_map, region)
        return
    share = search.image_check.share(find) or 0.0
    before = _suppress(search, voxel_map, region)
    too_large = search.is_too_large(find)
    search.set_aside.append(
        SetAside(region=region, share=share, too_large=too_large, excluded=before)
    )


def readmit_most_likely(search: Search, voxel_map: VoxelMap) -> bool:
    """Readmit the candidate among those set aside that looked most like the object.

    Candidates that were too large come last: they end a search only if they become smaller.

    Returns:
        Whether there was one.
    """
    best = max(search.set_aside, key=lambda one: (not one.too_large, one.share), default=None)
    if best is None:
        return False
    search.set_aside.remove(best)
    search.reconsidered.append(best.region)
    search.empty_steps = search.idle_steps = 0
    for part in reversed(best.excluded):
        evidence_of(search, voxel_map).restore_ooi(part)
    return True


def update_candidates(search: Search, voxel_map: VoxelMap, frame: Frame) -> None:
    """Find the candidates in the map, and exclude those that continue an excluded find.

    Args:
        search: The search whose candidates are updated.
        voxel_map: The map, with the frame in it.
        frame: Gives pose and camera for the candidates' boxes.
    """
    search.update_candidates(voxel_map.arrays(), frame)
    for region, entry in search.take_continuations():
        before = _suppress(search, voxel_map, region)
        if entry is not None:
            entry.excluded.extend(before)


def _exclude(search: Search, voxel_map: VoxelMap, region: ExclusionSphere) -> None:
    """Exclude a region for the rest of a search."""
    search.rejected.append(region)
    _suppress(search, voxel_map, region)


def _suppress(
    search: Search, voxel_map: VoxelMap, region: ExclusionSphere
) -> list[SuppressedRegion]:
    """Remove the map's evidence from a region; returns what was there."""
    evidence = evidence_of(search, voxel_map)
    return [evidence.suppress_ooi(centre, radius_m) for centre, radius_m in region.balls]
