"""The support of an object, and a true sentence about it."""

import numpy as np

from ippon.simulation.scene import Instance, Scene
from ippon.vocabulary import canonical_label, in_words

_GAP_M = 0.08
"""Largest gap between an object's underside and the surface below it."""
_NOT_NAMED = frozenset({"wall", "ceiling", "beam", "column", "objects", "others", "furniture"})


def support_of(scene: Scene, instance: int) -> Instance | None:
    """Return the instance on which an object stands or lies, None if there is none.

    Seats and beds are lower than the top of their box, so the triangles right below the object are
    compared; the highest counts.

    Args:
        scene: The home.
        instance: Row of `scene.instances`.
    """
    thing = scene.instances[instance]
    low, high = np.array(thing.aabb_min), np.array(thing.aabb_max)
    centre = 0.5 * (low[:2] + high[:2])
    best: tuple[float, Instance] | None = None
    for k, other in enumerate(scene.instances):
        if k == instance or canonical_label(other.category) in _NOT_NAMED:
            continue
        a, b = np.array(other.aabb_min), np.array(other.aabb_max)
        if (centre < a[:2]).any() or (centre > b[:2]).any() or a[2] > low[2] + 0.5 * _GAP_M:
            continue
        top = _surface_below(scene, k, centre, float(low[2]) + 0.5 * _GAP_M)
        if low[2] - top <= _GAP_M and (best is None or top > best[0]):
            best = (top, other)
    return None if best is None else best[1]


def context_sentence(scene: Scene, instance: int) -> str | None:
    """Return a true sentence about the support of an object; None if there is none.

    For an object on the floor the sentence names the room.
    """
    support = support_of(scene, instance)
    if support is None:
        return None
    category = canonical_label(support.category)
    if category == "floor":
        room = scene.instances[instance].room
        return (
            None if room is None else f"It is on the floor in the {in_words(room.split('.')[0])}."
        )
    named = canonical_label(support.label) if category == "appliances" else category
    return f"I left it on the {in_words(named)}."


def room_sentence(scene: Scene, instance: int) -> str | None:
    """Return a true sentence about the room of an object; None if the home does not know it."""
    room = scene.instances[instance].room
    return None if room is None else f"It is in the {in_words(room.split('.')[0])}."


def _surface_below(scene: Scene, instance: int, point: np.ndarray, z_max: float) -> float:
    """Return the height of an object's highest triangle at a point up to z_max, -inf for none."""
    triangles = scene.vertices[scene.faces[scene.face_instance == instance]].astype(np.float64)
    a, b, c = (triangles[:, k, :2] - point for k in range(3))
    # Signs of the areas that the point spans with each edge: equal if it lies inside.
    s = np.stack([_cross(a, b), _cross(b, c), _cross(c, a)])
    area = s.sum(axis=0)
    inside = ((s >= -1e-12).all(axis=0) | (s <= 1e-12).all(axis=0)) & (np.abs(area) > 1e-9)
    if not inside.any():
        return -np.inf
    weights = s[:, inside] / area[inside]
    z = triangles[inside, :, 2]
    heights = weights[1] * z[:, 0] + weights[2] * z[:, 1] + weights[0] * z[:, 2]
    below = heights[heights <= z_max]
    return float(below.max()) if len(below) else -np.inf


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
