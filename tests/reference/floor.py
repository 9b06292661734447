"""Slow twins of the floor grid and of the distance over it."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np


def touched_cells(triangle, x0, y0, cell, z_low, z_high, shape, samples=400):
    """Cells under densely sampled points of a triangle between two heights."""
    a, b, c = triangle
    touched = np.zeros(shape, bool)
    for u in np.linspace(0.0, 1.0, samples):
        v = np.linspace(0.0, 1.0 - u, samples)[:, None]
        points = a + u * (b - a) + v * (c - a)
        points = points[(points[:, 2] > z_low) & (points[:, 2] < z_high)]
        i = np.floor((points[:, 0] - x0) / cell).astype(int)
        j = np.floor((points[:, 1] - y0) / cell).astype(int)
        inside = (i >= 0) & (j >= 0) & (i < shape[0]) & (j < shape[1])
        touched[i[inside], j[inside]] = True
    return touched


def is_straight(free, a, b):
    """Whether the segment between two cell centres stays on free cells, in exact fractions.

    Through a corner of four cells it passes unless both cells beside it are taken.
    """
    (i0, j0), (i1, j1) = (int(a[0]), int(a[1])), (int(b[0]), int(b[1]))
    crossings = {}
    for axis, (p, q) in enumerate(((i0, i1), (j0, j1))):
        for k in range(min(p, q), max(p, q)):
            crossings.setdefault(Fraction(2 * (k - p) + 1, 2 * (q - p)), set()).add(axis)
    times = [Fraction(0), *sorted(crossings), Fraction(1)]
    for s, t in pairwise(times):
        middle = (s + t) / 2
        u, v = i0 + middle * (i1 - i0), j0 + middle * (j1 - j0)
        if not free[math.floor(u + Fraction(1, 2)), math.floor(v + Fraction(1, 2))]:
            return False
    for t, axes in crossings.items():
        if len(axes) == 2:
            u, v = i0 + t * (i1 - i0), j0 + t * (j1 - j0)
            low_i, low_j = math.floor(u), math.floor(v)
            ahead = (i1 > i0) == (j1 > j0)
            beside = [(low_i + 1, low_j), (low_i, low_j + 1)]
            if not ahead:
                beside = [(low_i, low_j), (low_i + 1, low_j + 1)]
            if not any(free[c] for c in beside):
                return False
    return True


def exact_distances(free, sources):
    """Shortest ways, in cells, on the graph of all cells that see one another (Dijkstra)."""
    cells = [tuple(c) for c in np.argwhere(free)]
    distance = dict.fromkeys(cells, math.inf)
    for s in sources:
        distance[tuple(s)] = 0.0
    open_cells = set(cells)
    while open_cells:
        here = min(open_cells, key=lambda c: distance[c])
        open_cells.remove(here)
        if math.isinf(distance[here]):
            break
        for other in open_cells:
            d = distance[here] + math.hypot(other[0] - here[0], other[1] - here[1])
            if d < distance[other] and is_straight(free, here, other):
                distance[other] = d
    return distance
