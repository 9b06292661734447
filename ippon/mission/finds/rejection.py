"""What is not the object: what the operator rejects, what the images deny, and the rest of both."""

from ippon.frame import Frame
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.finds.find_geometry import LOOKED_AT_RADIUS_M, ball_round, looked_at
from ippon.mission.search import Doubted, Search
from ippon.mission.snapshot import Find


def reject_last_find(search: Search, voxel_map: VoxelMap, frame: Frame | None) -> None:
    """Go on from the find that a search ended with, and rule it out.

    Args:
        search: Goes on.
        voxel_map: Takes the place for something else.
        frame: The last one, None before any.
    """
    find = search.go_on_from_find()
    if find is not None:
        _rule_out(search, voxel_map, find)
    elif frame is not None:
        # No voxels are left to point at: what the robot looks at is what it took for it.
        voxel_map.suppress_ooi(looked_at(frame), LOOKED_AT_RADIUS_M)


def doubt(search: Search, voxel_map: VoxelMap, find: Find) -> None:
    """Go on from what images or its size deny before a search ends with it.

    It is set aside, for `reconsider`; what was so before is ruled out.
    """
    search.arrived_steps = 0
    if search.is_reconsidered(find):
        _rule_out(search, voxel_map, find)
        return
    ball = ball_round(find)
    share = search.second_look.share(find) or 0.0
    before = voxel_map.suppress_ooi(ball.centre_world, ball.radius_m)
    too_large = search.is_too_large(find)
    search.doubted.append(Doubted(ball=ball, share=share, too_large=too_large, ruled_out=[before]))


def reconsider(search: Search, voxel_map: VoxelMap) -> bool:
    """Take back the doubt of what looked most like the object, for want of anything better.

    What is too large comes last: it is found only if it has turned out smaller.

    Returns:
        Whether anything was doubted.
    """
    best = max(search.doubted, key=lambda one: (not one.too_large, one.share), default=None)
    if best is None:
        return False
    search.doubted.remove(best)
    search.reconsidered.append(best.ball)
    search.empty_steps = search.idle_steps = 0
    for part in reversed(best.ruled_out):
        voxel_map.readmit_ooi(part)
    return True


def look_for_candidates(search: Search, voxel_map: VoxelMap, frame: Frame) -> None:
    """Look again for what may be the object; what continues something ruled out is ruled out, too.

    Args:
        search: Takes note of the candidates.
        voxel_map: With the frame in it.
        frame: Where the robot stands.
    """
    search.update_candidates(voxel_map.arrays(), frame)
    for ball, doubted in search.rests_of_ruled_out():
        before = voxel_map.suppress_ooi(ball.centre_world, ball.radius_m)
        if doubted is not None:
            doubted.ruled_out.append(before)


def _rule_out(search: Search, voxel_map: VoxelMap, find: Find) -> None:
    """Take a find for something else for the rest of a search."""
    ball = ball_round(find)
    search.rejected.append(ball)
    voxel_map.suppress_ooi(ball.centre_world, ball.radius_m)
