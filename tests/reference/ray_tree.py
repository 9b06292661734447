"""Rays against every triangle, one plane and three half-planes each."""

import numpy as np


def is_hit(corners, origins, ways):
    """Tell for each ray whether a triangle lies between its ends."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    out = np.zeros(len(origins), bool)
    for r, (origin, way) in enumerate(zip(origins, ways, strict=True)):
        steepness = normal @ way
        meets = steepness != 0.0
        t = ((a - origin) * normal).sum(axis=1) / np.where(meets, steepness, 1.0)
        point = origin + t[:, None] * way
        inside = meets & (t >= 0.0) & (t <= 1.0)
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= (np.cross(q - p, point - p) * normal).sum(axis=1) >= 0.0
        out[r] = inside.any()
    return out
