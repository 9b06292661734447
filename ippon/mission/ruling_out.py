"""What is not the object: what the operator rejects, what the images deny, and the rest of both."""

from ippon.frame import Frame
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.finding import LOOKED_AT_RADIUS_M, ball_round, looked_at
from ippon.mission.search import Search
from ippon.mission.snapshot import Find


def rule_out(search: Search, voxel_map: VoxelMap, find: Find) -> None:
    """Take a find for something else for the rest of a search."""
    ball = ball_round(find)
    search.rejected.append(ball)
    voxel_map.suppress_ooi(ball.centre_world, ball.radius_m)


def reject_last_find(search: Search, voxel_map: VoxelMap, frame: Frame | None) -> None:
    """Go on from the find that a search ended with, and rule it out.

    Args:
        search: Goes on.
        voxel_map: Takes the place for something else.
        frame: The last one, None before any.
    """
    find = search.go_on_from_find()
    if find is not None:
        rule_out(search, voxel_map, find)
    elif frame is not None:
        # No voxels are left to point at: what the robot looks at is what it took for it.
        voxel_map.suppress_ooi(looked_at(frame), LOOKED_AT_RADIUS_M)


def doubt(search: Search, voxel_map: VoxelMap, find: Find) -> None:
    """Go on from what the images deny before a search ends with it."""
    search.arrived_steps = 0
    rule_out(search, voxel_map, find)


def look_for_candidates(search: Search, voxel_map: VoxelMap, frame: Frame) -> None:
    """Look again for what may be the object; what continues something ruled out is ruled out, too.

    Args:
        search: Takes note of the candidates.
        voxel_map: With the frame in it.
        frame: Where the robot stands.
    """
    search.update_candidates(voxel_map.arrays(), frame)
    for ball in search.rests_of_rejected():
        voxel_map.suppress_ooi(ball.centre_world, ball.radius_m)
