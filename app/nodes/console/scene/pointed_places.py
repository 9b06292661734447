"""What a page points at in the scene: a remembered thing, or the surface under the pointer."""

from collections.abc import Iterable

import numpy as np

from app.nodes.console.scene.browser_views import BrowserView
from app.nodes.console.scene.clicks import Ray
from app.nodes.console.scene.scene_requests import Hover, Look
from app.view.floor_height import layer_below
from app.view.model.drag_region import view_ray
from app.view.model.picking import SurfaceLookup, first_voxel
from app.view.model.scene_model import SceneModel
from app.view.model.voxel_store import LABEL
from app.view.words import Words


def ray_onto(look: Look, voxel_size_m: float) -> Ray:
    """Return a ray from just above a thing down onto it: nothing else is before it."""
    x, y, z = look.centre_world
    top = z + 0.5 * look.size_m[2] + 0.5 * voxel_size_m
    return np.array([x, y, top]), np.array([0.0, 0.0, -1.0])


def name_under(model: SceneModel, views: Iterable[BrowserView], hover: Hover, say: Words) -> str:
    """Return the most probable kind of the surface under a pointer.

    Args:
        model: Has the map.
        views: Those of the browser; only one that shows all kinds of things is answered.
        hover: The point of the view.
        say: The words.

    Returns:
        The name of the label; empty for none.
    """
    size, table = model.voxel_size_m, model.proximity
    shown = (v for v in views if v.options.mode == "thing" and v.options.thing is None)
    view = next(shown, None)
    if view is None or size is None or table is None:
        return ""
    ceiling = view.options.ceiling_m
    below = None if ceiling is None else layer_below(ceiling, model.floor_z_m, size)
    lookup = SurfaceLookup(model.voxels, below)
    origin, direction = view_ray(view.client.camera, hover.u, hover.v)
    hit = first_voxel(origin, direction, size, lookup)
    attributes = None if hit is None else lookup.attributes(hit[0])
    if attributes is None or int(attributes[LABEL]) >= len(table.rows):
        return ""
    return say.name(table.rows[int(attributes[LABEL])].label)
