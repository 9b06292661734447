"""Colours of objects by ground truth: which of several mugs is the red one."""

import numpy as np

from ippon.mission.finds.attributes.colour_regions import lab_of, region_of
from ippon.simulation.homes.config import MUG_COLORS
from ippon.simulation.scene import Scene

_LEAST_SHARE = 0.5
"""Share of an object's surface that has its colour."""


def has_colour(scene: Scene, instance: int, colour: str) -> bool:
    """Tell whether most of an object's surface has a colour that people call by a name.

    Args:
        scene: The home.
        instance: Row of `scene.instances`.
        colour: Name of a colour, such as "red".

    Raises:
        ValueError: It is no name of a colour.
    """
    region = region_of(colour)
    if region is None:
        raise ValueError(f"{colour!r} is no name of a colour")
    faces = np.flatnonzero(scene.face_instance == instance)
    corners = scene.vertices[scene.faces[faces]].astype(np.float64)
    sides = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.linalg.norm(np.cross(*sides), axis=1)
    colors = scene.face_colors[faces].copy()
    if scene.face_texture is not None and scene.textures:
        means = np.array([image.reshape(-1, 3).mean(axis=0) for image in scene.textures])
        textured = scene.face_texture[faces] >= 0
        colors[textured] = means[scene.face_texture[faces][textured]].astype(np.uint8)
    inside = region.contains(lab_of(colors)) if len(colors) else np.zeros(0, np.bool_)
    return float(area[inside].sum()) > _LEAST_SHARE * float(area.sum())


def telling_colours(scene: Scene, instances: tuple[int, ...]) -> tuple[str, ...]:
    """Return the colours that some of these objects have and others have not."""
    told: list[str] = []
    for colour in MUG_COLORS:
        having = [has_colour(scene, k, colour) for k in instances]
        if any(having) and not all(having):
            told.append(colour)
    return tuple(told)
