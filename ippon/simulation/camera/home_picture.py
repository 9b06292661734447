"""A picture of a home from above, with its ceiling cut away."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import open3d
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from scipy import ndimage

from ippon.simulation.scene import Instance, Scene
from ippon.vocabulary import in_words

_o3d: Any = open3d
"""Untyped, because open3d's stubs reject the arrays that it accepts."""

_ndimage: Any = ndimage

_BACKGROUND = (250, 250, 248)
_WALL_COLOR = (64, 66, 70)
_INK = (38, 40, 44)
_SKY = (86, 180, 233)
_CUT_M = 2.4
_WALL_CUT_M = 2.0
_MARGIN_M = 0.6
_FOOTER_PX = 34
_MAX_PIXELS = 40_000_000
_UNLABELLED = (
    "wall",
    "floor",
    "ceiling",
    "door",
    "window",
    "curtain",
    "lighting",
    "picture",
    "cushion",
)
"""Categories that are drawn without a name."""
_SOLID = ("wall", "column")
_CUT_LOW = ("wall", "window", "door", "beam", "curtain")
_FINE = 2
"""Rays per pixel along each axis."""


@dataclass(frozen=True, slots=True)
class _View:
    """Mapping from metres to pixels."""

    left: float
    top: float
    scale: float

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Return the pixel (u, v) of a point on the floor."""
        return (x - self.left) * self.scale, (self.top - y) * self.scale


def picture_from_above(
    scene: Scene,
    *,
    pixels_per_metre: float,
    trail: NDArray[np.float64] | None = None,
    marks: Mapping[str, Sequence[float]] | None = None,
) -> NDArray[np.uint8]:
    """Draw a home from above, walls cut at 2 m, with names, scale bar and start pose.

    Args:
        scene: The home.
        pixels_per_metre: Scale of the picture; 60 shows small objects.
        trail: (N, 2+) positions of a robot in metres, in order.
        marks: Names of points to mark, each with its x and y in metres.

    Returns:
        (H, W, 3) uint8 RGB; x runs right, y runs up.

    Raises:
        ValueError: The scale is not positive, or the picture would exceed 40 million pixels.
    """
    low, high = _bounds(scene)
    size = (high - low) * pixels_per_metre
    if not pixels_per_metre > 0.0 or size[0] * size[1] > _MAX_PIXELS:
        raise ValueError(
            f"{pixels_per_metre} pixels per metre gives no usable picture of a home of "
            f"{high[0] - low[0]:.0f} by {high[1] - low[1]:.0f} m; try 20 to 100"
        )
    view = _View(float(low[0]), float(high[1]), pixels_per_metre)
    width, height = max(int(size[0]), 1), max(int(size[1]), 1)
    page = np.full((height + _FOOTER_PX, width, 3), _BACKGROUND, np.uint8)
    page[:height] = _shaded(scene, view, width, height).astype(np.uint8)
    image = Image.fromarray(page)
    draw = ImageDraw.Draw(image, "RGBA")
    _draw_names(draw, scene, view)
    if trail is not None and len(trail) > 0:
        _draw_trail(draw, np.asarray(trail, np.float64), view)
    for name, point in (marks or {}).items():
        _draw_mark(draw, name, view.pixel(float(point[0]), float(point[1])))
    if scene.start_poses:
        start = scene.start_poses[0]
        _draw_arrow(draw, view.pixel(start.x, start.y), start.yaw, 0.3 * pixels_per_metre)
    _draw_footer(draw, scene, view, (width, height))
    return np.asarray(image)


def _bounds(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the corners of the picture's area: walls and floors, else all instances."""
    shell = [i for i in scene.instances if i.category in ("wall", "floor")] or scene.instances
    low = np.min([i.aabb_min[:2] for i in shell], axis=0) - _MARGIN_M
    high = np.max([i.aabb_max[:2] for i in shell], axis=0) + _MARGIN_M
    return low, high


def _shaded(scene: Scene, view: _View, width: int, height: int) -> NDArray[np.float64]:
    """Render by casting rays down, several per pixel, and shading the surfaces that they meet.

    Walls, doors and windows are cut lower than furniture, so that tall cupboards stay whole and
    lintels do not cover doorways.
    """
    low = np.array([i.aabb_min[2] for i in scene.instances])
    hanging = np.array([i.category in ("ceiling", "lighting") for i in scene.instances])
    shell = np.array([i.category in _CUT_LOW for i in scene.instances])
    visible = ~(hanging & (low > 0.5 * _WALL_CUT_M) | (low >= _WALL_CUT_M))
    columns, rows = width * _FINE, height * _FINE
    best = np.full((rows, columns), -np.inf)
    face = np.zeros((rows, columns), np.int64)
    uv = np.zeros((rows, columns, 2), np.float32)
    normals = np.zeros((rows, columns, 3), np.float32)
    for chosen, cut in ((visible & shell, _WALL_CUT_M), (visible & ~shell, _CUT_M)):
        members = np.flatnonzero(chosen[scene.face_instance])
        if len(members) == 0:
            continue
        beams = _beams(view, columns, rows, cut)
        hit = _rays(scene, members).cast_rays(_o3d.core.Tensor(beams))
        z = cut - hit["t_hit"].numpy().astype(np.float64)
        higher = z > best
        best[higher] = z[higher]
        face[higher] = members[hit["primitive_ids"].numpy()[higher].astype(np.int64)]
        uv[higher] = hit["primitive_uvs"].numpy()[higher]
        normals[higher] = hit["primitive_normals"].numpy()[higher]
    seen = np.isfinite(best)
    light = _light(normals, np.where(seen, best, 0.0), view.scale * _FINE)
    colors = _albedo(scene, face, uv) * light[..., None]
    colors = np.where(seen[..., None], colors, _BACKGROUND)
    colors[_wall_cut(scene, view, columns, rows)] = _WALL_COLOR
    return colors.reshape(height, _FINE, width, _FINE, 3).mean(axis=(1, 3)).clip(0, 255)


def _beams(view: _View, columns: int, rows: int, cut: float) -> NDArray[np.float32]:
    """Return (rows, columns, 6) rays straight down from a height."""
    step = 1.0 / (view.scale * _FINE)
    beams = np.zeros((rows, columns, 6), np.float32)
    beams[..., 0] = view.left + (np.arange(columns) + 0.5) * step
    beams[..., 1] = (view.top - (np.arange(rows) + 0.5) * step)[:, None]
    beams[..., 2] = cut
    beams[..., 5] = -1.0
    return beams


def _rays(scene: Scene, rows: NDArray[np.intp]) -> Any:
    """Return a ray-casting scene of some of the home's triangles."""
    rays = _o3d.t.geometry.RaycastingScene(nthreads=1)
    rays.add_triangles(
        _o3d.core.Tensor(np.ascontiguousarray(scene.vertices, np.float32)),
        _o3d.core.Tensor(np.ascontiguousarray(scene.faces[rows], np.uint32)),
    )
    return rays


def _albedo(scene: Scene, face: NDArray[np.int64], uv: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the colour at each ray's surface point, from face or texture."""
    colors = scene.face_colors[face].astype(np.float64)
    if scene.face_texture is None or scene.face_uvs is None:
        return colors
    texture = scene.face_texture[face]
    for k in np.unique(texture[texture >= 0]).tolist():
        where = texture == k
        image = scene.textures[k]
        corners = scene.face_uvs[face[where]].astype(np.float64)
        b, c = uv[where, 0:1], uv[where, 1:2]
        at = corners[:, 0] * (1.0 - b - c) + corners[:, 1] * b + corners[:, 2] * c
        at -= np.floor(at)
        u = np.minimum((at[:, 0] * image.shape[1]).astype(np.int64), image.shape[1] - 1)
        v = np.minimum(((1.0 - at[:, 1]) * image.shape[0]).astype(np.int64), image.shape[0] - 1)
        colors[where] = image[v, u]
    return colors


def _light(
    normals: NDArray[np.float32], z: NDArray[np.float64], pixels_per_metre: float
) -> NDArray[np.float64]:
    """Return brightness: light from the upper left, soft shadows around tall objects."""
    n = normals.astype(np.float64)
    n *= np.where(n[..., 2:] < 0.0, -1.0, 1.0)  # surfaces are double sided
    slant = n @ np.array([-0.42, 0.42, 0.80])
    light = 0.55 + 0.45 * np.clip(slant / 0.8, 0.0, 1.25)
    shadow = np.zeros_like(z)
    for reach_m, strength in ((0.06, 0.5), (0.25, 0.35)):
        above = np.maximum(_ndimage.gaussian_filter(z, reach_m * pixels_per_metre) - z, 0.0)
        shadow += strength * np.minimum(above, 0.6)
    height = 0.93 + 0.07 * np.clip(z, 0.0, _CUT_M) / _CUT_M
    return light * (1.0 - np.minimum(shadow, 0.5)) * height


def _wall_cut(scene: Scene, view: _View, columns: int, rows: int) -> NDArray[np.bool_]:
    """Tell which pixels lie inside a wall or column at the height of the cut."""
    beams = _beams(view, columns, rows, _WALL_CUT_M)
    inside = np.zeros((rows, columns), np.bool_)
    fine = _View(view.left, view.top, view.scale * _FINE)
    for k, instance in enumerate(scene.instances):
        if instance.category not in _SOLID or not (
            instance.aabb_min[2] < _WALL_CUT_M < instance.aabb_max[2]
        ):
            continue
        u0, v0 = fine.pixel(instance.aabb_min[0], instance.aabb_max[1])
        u1, v1 = fine.pixel(instance.aabb_max[0], instance.aabb_min[1])
        window = slice(max(int(v0), 0), int(v1) + 1), slice(max(int(u0), 0), int(u1) + 1)
        rays = _rays(scene, np.flatnonzero(scene.face_instance == k))
        part = np.ascontiguousarray(beams[window])
        # A ray that starts inside a closed solid crosses its surface an odd number of times.
        crossings = rays.count_intersections(_o3d.core.Tensor(part)).numpy()
        inside[window] |= crossings % 2 == 1
    return inside


def _font(size: float) -> Any:
    return ImageFont.load_default(size)


def _draw_names(draw: ImageDraw.ImageDraw, scene: Scene, view: _View) -> None:
    """Write the rooms' names, then those of objects where they do not cover one another."""
    taken: list[tuple[float, float, float, float]] = []
    if scene.start_poses:
        u, v = view.pixel(scene.start_poses[0].x, scene.start_poses[0].y)
        r = 0.35 * view.scale
        taken.append((u - r, v - r, u + r, v + r))
    size = float(np.clip(0.2 * view.scale, 9.0, 20.0))
    objects = sorted(
        (i for i in scene.instances if i.category not in _UNLABELLED), key=_plan_area, reverse=True
    )
    for room in scene.rooms:
        name = room.name.rsplit(".", 1)[0].replace("_", " ").upper()
        x, y = room.polygon.mean(axis=0).tolist()
        _write(draw, name, view.pixel(x, y), size, (60, 64, 72, 255), taken, force=True)
    for instance in objects:
        x = 0.5 * (instance.aabb_min[0] + instance.aabb_max[0])
        y = 0.5 * (instance.aabb_min[1] + instance.aabb_max[1])
        label = in_words(instance.label)
        _write(draw, label, view.pixel(x, y), 0.62 * size, (20, 22, 26, 235), taken)


def _plan_area(instance: Instance) -> float:
    a, b = instance.aabb_min, instance.aabb_max
    return (b[0] - a[0]) * (b[1] - a[1])


def _write(
    draw: ImageDraw.ImageDraw,
    text: str,
    at: tuple[float, float],
    size: float,
    color: tuple[int, int, int, int],
    taken: list[tuple[float, float, float, float]],
    *,
    force: bool = False,
) -> None:
    """Write centred text on a light background, shifted where it would cover other text."""
    font = _font(size)
    left, top, right, bottom = draw.textbbox((0, 0), text, font=font)
    w, h = right - left, bottom - top
    for shift in (0.0, -1.15 * h, 1.15 * h, -2.3 * h, 2.3 * h):
        u, v = at[0] - w / 2, at[1] - h / 2 + shift
        box = (u - 2, v - 2, u + w + 2, v + h + 2)
        free = all(box[2] < t[0] or t[2] < box[0] or box[3] < t[1] or t[3] < box[1] for t in taken)
        if free or force:
            draw.rounded_rectangle(box, radius=3, fill=(255, 255, 255, 150))
            draw.text((u - left, v - top), text, font=font, fill=color)
            taken.append(box)
            return


def _draw_trail(draw: ImageDraw.ImageDraw, trail: NDArray[np.float64], view: _View) -> None:
    points = [view.pixel(float(p[0]), float(p[1])) for p in trail]
    width = max(2, round(0.05 * view.scale))
    if len(points) > 1:
        draw.line(points, fill=(*_SKY, 255), width=width, joint="curve")
    u, v = points[-1]
    r = 0.12 * view.scale
    draw.ellipse((u - r, v - r, u + r, v + r), fill=(*_SKY, 255), outline=_INK)


def _draw_mark(draw: ImageDraw.ImageDraw, name: str, at: tuple[float, float]) -> None:
    u, v = at
    draw.ellipse((u - 6, v - 6, u + 6, v + 6), outline=(0, 158, 115, 255), width=3)
    _write(draw, name, (u, v - 14), 12.0, (0, 110, 80, 255), [], force=True)


def _draw_arrow(
    draw: ImageDraw.ImageDraw, at: tuple[float, float], yaw: float, length: float
) -> None:
    """Draw the start pose as a disc with an arrow."""
    u, v = at
    c, s = math.cos(yaw), -math.sin(yaw)
    draw.ellipse((u - length, v - length, u + length, v + length), fill=(*_SKY, 90))
    corners = ((1.0, 0.0), (-0.55, 0.55), (-0.25, 0.0), (-0.55, -0.55))
    arrow = [(u + length * (c * a - s * b), v + length * (s * a + c * b)) for a, b in corners]
    draw.polygon(arrow, fill=(0, 90, 160, 255))


def _draw_footer(
    draw: ImageDraw.ImageDraw, scene: Scene, view: _View, size: tuple[int, int]
) -> None:
    """Write name, size and a scale bar below the plan."""
    width, height = size
    font = _font(12.0)
    area = sum(_polygon_area(r.polygon) for r in scene.rooms)
    text = f"{scene.name}   {len(scene.instances)} objects"
    if scene.rooms:
        text += f"   {len(scene.rooms)} rooms   {area:.0f} sq m"
    draw.text((10, height + 10), text, font=font, fill=_INK)
    metres = next(m for m in (5, 2, 1, 0.5, 0.0) if m * view.scale < 0.4 * width)
    bar = metres * view.scale
    u1, v = width - 12.0, height + 16.0
    draw.line([(u1 - bar, v), (u1, v)], fill=_INK, width=2)
    for u in (u1 - bar, u1):
        draw.line([(u, v - 4), (u, v + 4)], fill=_INK, width=2)
    draw.text((u1 - bar - 34, height + 9), f"{metres:g} m", font=font, fill=_INK)


def _polygon_area(polygon: NDArray[np.float64]) -> float:
    x, y = polygon[:, 0], polygon[:, 1]
    return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))
