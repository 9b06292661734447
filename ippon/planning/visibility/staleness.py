"""Which viewpoints must be evaluated again."""

import math

from ippon.compiling import njit


@njit(cache=True, nogil=True)
def stale_kernel(nodes, xy, evaluated, reach, changed, origin, range_voxels, out):
    """Mark viewpoints that were never evaluated, or that saw a block column which changed since.

    Args:
        nodes: (N,) viewpoints.
        xy: (capacity, 2) positions in voxels.
        evaluated: (capacity,) step of the last evaluation, -1 for never.
        reach: (capacity, Y) voxels that a viewpoint sees at most, by heading column.
        changed: (X, Y) step in which a block column last changed.
        origin: (3,) voxel at the corner of `changed`.
        range_voxels: Range of the camera.
        out: (N,) bool, set where stale.
    """
    columns = reach.shape[1]
    blocks = int(range_voxels) // 8 + 1
    for n in range(nodes.shape[0]):
        node = nodes[n]
        since = evaluated[node]
        if since < 0:
            out[n] = True
            continue
        x, y = xy[node, 0] - origin[0], xy[node, 1] - origin[1]
        bx, by = int(x) >> 3, int(y) >> 3
        for a in range(max(0, bx - blocks), min(changed.shape[0], bx + blocks + 1)):
            if out[n]:
                break
            for b in range(max(0, by - blocks), min(changed.shape[1], by + blocks + 1)):
                if changed[a, b] <= since:
                    continue
                dx, dy = a * 8 + 4 - x, b * 8 + 4 - y
                distance = math.hypot(dx, dy)
                yaw = math.atan2(dy, dx) % (2.0 * math.pi)
                seen = reach[node, int(yaw / (2.0 * math.pi) * columns) % columns]
                # A block column counts as visible when its near edge is.
                if distance - 6.0 <= seen:
                    out[n] = True
                    break
