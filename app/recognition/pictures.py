"""Pictures for the page of a recording: parts of images, and the place from above."""

import base64
import io
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from app.recognition.find_evidence import Sighting
from ippon.mapping.arrays import BLOCK_EDGE
from ippon.mapping.voxel_map import VoxelMap

CROP_PX: Final = 265
"""Longer side of a crop on the page."""
_LEAST_PX: Final = 120
"""Minimum side of a crop in image pixels, so that it shows the surroundings."""
_MARGIN: Final = 0.6
"""Margin on each side, as a share of the box's longer side."""
_BOX: Final = (230, 159, 0)
_CENTRE: Final = (86, 180, 233)
_CEILING_M: Final = 1.9
"""Height above which surface is omitted from the plan."""
_PLAN_PX: Final = 900


def crop(color: NDArray[np.uint8], sighting: Sighting) -> str:
    """Return a part of an image as a data URI, with the network's box and the find's centre.

    Args:
        color: (H, W, 3) RGB image of the sighting.
        sighting: The sighting to show.
    """
    h, w = color.shape[:2]
    u, v = sighting.pixel
    box = sighting.instance.box_px if sighting.instance else (u, v, u, v)
    left, top, right, bottom = box
    side = max(right - left, bottom - top, 1.0)
    half = max(0.5 * side + _MARGIN * side, 0.5 * _LEAST_PX)
    middle_u, middle_v = 0.5 * (left + right), 0.5 * (top + bottom)
    window = (
        max(0, int(middle_u - half)),
        max(0, int(middle_v - half)),
        min(w, int(middle_u + half) + 1),
        min(h, int(middle_v + half) + 1),
    )
    part = Image.fromarray(color).crop(window)
    scale = CROP_PX / max(part.size)
    part = part.resize((round(part.width * scale), round(part.height * scale)))
    draw = ImageDraw.Draw(part)
    if sighting.instance is not None:
        corners = [(x - window[k % 2]) * scale for k, x in enumerate(box)]
        draw.rectangle(corners, outline=_BOX, width=2)
    x, y = (u - window[0]) * scale, (v - window[1]) * scale
    draw.ellipse((x - 4, y - 4, x + 4, y + 4), outline=_CENTRE, width=2)
    return data_uri(part)


def plan(
    voxel_map: VoxelMap, marks: Sequence[tuple[str, tuple[float, float, float]]]
) -> str | None:
    """Return the map from above as a data URI, with numbered marks; None for an empty map.

    Args:
        voxel_map: Map whose highest surface up to 1.9 m above its floor is shown in its colour.
        marks: Texts and positions in the map's world, metres.
    """
    surface, size = voxel_map.surface, voxel_map.config.voxel_size_m
    rows = np.flatnonzero((surface.voxel >= 0) & (surface.color_count > 0))
    rows = rows[rows > 0]
    block, k = surface.voxel[rows] // 512, surface.voxel[rows] % 512
    inner = np.stack([k >> 6, (k >> 3) & 7, k & 7], axis=1)
    voxels = voxel_map.block_coords[block].astype(np.int64) * BLOCK_EDGE + inner
    low = voxels[:, 2] * size < voxel_map.floor_z_m + _CEILING_M
    voxels, rows = voxels[low], rows[low]
    if len(voxels) == 0:
        return None
    order = np.argsort(voxels[:, 2], kind="stable")
    voxels, rows = voxels[order], rows[order]
    corner = voxels[:, :2].min(axis=0)
    width, height = (voxels[:, :2].max(axis=0) - corner + 1).tolist()
    picture = np.full((height, width, 3), 22, np.uint8)
    picture[height - 1 - (voxels[:, 1] - corner[1]), voxels[:, 0] - corner[0]] = surface.color[rows]
    scale = max(1, _PLAN_PX // max(width, height))
    image = Image.fromarray(picture).resize(
        (width * scale, height * scale), Image.Resampling.NEAREST
    )
    draw = ImageDraw.Draw(image)
    for text, position in marks:
        x = (position[0] / size - corner[0]) * scale
        y = (height - (position[1] / size - corner[1])) * scale
        half = max(9.0, 4.0 + 0.5 * draw.textlength(text))
        draw.rounded_rectangle(
            (x - half, y - 9, x + half, y + 9), radius=9, fill=_BOX, outline=(0, 0, 0)
        )
        draw.text((x, y), text, fill=(0, 0, 0), anchor="mm")
    return data_uri(image)


def data_uri(image: Image.Image) -> str:
    """Return an image as a JPEG data URI."""
    out = io.BytesIO()
    image.convert("RGB").save(out, "JPEG", quality=82)
    return "data:image/jpeg;base64," + base64.b64encode(out.getvalue()).decode()
