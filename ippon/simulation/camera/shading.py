"""Colours of a rendered scene: face colours and textures under a fixed light."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.compiling import njit
from ippon.geometry import Float64Array
from ippon.simulation.camera.raster import Float32Array, Int32Array
from ippon.simulation.scene import Scene

UInt8Array = NDArray[np.uint8]

_LIGHT = np.array([0.42, 0.27, 0.87])
"""Direction towards the light; length about 1."""
_AMBIENT, _DIRECT, _HEADLIGHT = 0.58, 0.32, 0.16
_BACKGROUND = np.array([208, 218, 228], dtype=np.uint8)
_SMALLEST_MIP = 4


class SurfaceColors(NamedTuple):
    """Colours and textures as kernel arguments, one row per face unless stated."""

    normals: Float32Array
    """(F, 3) unit normals, 0 for faces without area."""
    albedo: UInt8Array
    """(F, 3)."""
    texture: Int32Array
    """(F,) row of `mips`, -1 for plain colour."""
    uv_rows: Float32Array
    """(F, 2, 4) rows that map a world point (x, y, z, 1) to texture coordinates; (0, 2, 4) without
    textures."""
    texels_per_m: Float32Array
    """(F,) texels of the full-size image per metre of surface."""
    mips: Int32Array
    """(T, L, 3) offset in `texels`, height and width of each level; height 0 beyond the last
    level."""
    texels: UInt8Array
    """(N, 3) all levels of all textures."""

    @classmethod
    def of(
        cls, scene: Scene, order: NDArray[np.int64], vertices: Float32Array, faces: Int32Array
    ) -> "SurfaceColors":
        """Return the colours of a scene whose faces were put into `order`."""
        corners = vertices[faces].astype(np.float64)
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        double_area = np.maximum(np.linalg.norm(cross, axis=1), 1e-12)
        normals = cross / double_area[:, None]
        texture = np.full(len(faces), -1, dtype=np.int32)
        uv_rows = np.zeros((0, 2, 4), dtype=np.float32)
        texels_per_m = np.zeros(len(faces), dtype=np.float32)
        if scene.textures and scene.face_texture is not None and scene.face_uvs is not None:
            texture = scene.face_texture[order].astype(np.int32)
            uvs = scene.face_uvs[order].astype(np.float64)
            uv_rows = _uv_rows(corners, normals, double_area, uvs)
            texels_per_m = _texel_density(scene, texture, uvs, double_area)
        mips, texels = _mip_maps(scene.textures)
        return cls(
            normals=normals.astype(np.float32),
            albedo=np.ascontiguousarray(scene.face_colors[order]),
            texture=texture,
            uv_rows=uv_rows,
            texels_per_m=texels_per_m,
            mips=mips,
            texels=texels,
        )


def _uv_rows(
    corners: Float64Array, normals: Float64Array, double_area: Float64Array, uvs: Float64Array
) -> Float32Array:
    """Return the affine maps from world points to texture coordinates, one per face."""
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    # Dual basis of the edges: dual_i . edge_j = (i == j).
    dual1 = np.cross(edge2, normals) / double_area[:, None]
    dual2 = np.cross(normals, edge1) / double_area[:, None]
    du1, du2 = uvs[:, 1] - uvs[:, 0], uvs[:, 2] - uvs[:, 0]
    linear = du1[:, :, None] * dual1[:, None, :] + du2[:, :, None] * dual2[:, None, :]
    # Whole repeats are subtracted, so that float32 resolves fractions of a texel.
    constant = uvs[:, 0] - np.einsum("fij,fj->fi", linear, corners[:, 0])
    constant -= np.floor(constant)
    return np.concatenate([linear, constant[:, :, None]], axis=2).astype(np.float32)


def _texel_density(
    scene: Scene, texture: Int32Array, uvs: Float64Array, double_area: Float64Array
) -> Float32Array:
    sizes = np.array([image.shape[0] * image.shape[1] for image in scene.textures], dtype=float)
    side1, side2 = uvs[:, 1] - uvs[:, 0], uvs[:, 2] - uvs[:, 0]
    uv_area = np.abs(side1[:, 0] * side2[:, 1] - side1[:, 1] * side2[:, 0])
    texels = uv_area * sizes[np.maximum(texture, 0)]
    return np.sqrt(texels / double_area).astype(np.float32)


def _mip_maps(textures: tuple[UInt8Array, ...]) -> tuple[Int32Array, UInt8Array]:
    """Return mip levels of each image, so that distant surfaces do not flicker."""
    pyramids = [_pyramid(image) for image in textures]
    depth = max((len(p) for p in pyramids), default=1)
    mips = np.zeros((len(textures), depth, 3), dtype=np.int32)
    offset = 0
    for t, levels in enumerate(pyramids):
        for k, level in enumerate(levels):
            mips[t, k] = (offset, level.shape[0], level.shape[1])
            offset += level.shape[0] * level.shape[1]
    rows = [level.reshape(-1, 3) for levels in pyramids for level in levels]
    return mips, np.concatenate(rows) if rows else np.zeros((1, 3), dtype=np.uint8)


def _pyramid(image: UInt8Array) -> list[UInt8Array]:
    levels = [np.ascontiguousarray(image[..., :3])]
    while min(levels[-1].shape[:2]) >= 2 * _SMALLEST_MIP:
        fine = levels[-1]
        h, w = fine.shape[0] // 2, fine.shape[1] // 2
        cells = fine[: 2 * h, : 2 * w].reshape(h, 2, w, 2, 3)
        levels.append(np.round(cells.mean(axis=(1, 3))).astype(np.uint8))
    return levels


def shade(
    colors: SurfaceColors,
    camera: PinholeCamera,
    T_world_camera: Float64Array,
    inverse_depth: Float32Array,
    face_index: Int32Array,
    face_instance: Int32Array,
    max_depth_m: float,
    color: UInt8Array,
    depth: Float32Array,
    instance: Int32Array,
) -> None:
    """Turn a z-buffer into images.

    Args:
        colors: Surface colours in the order of the faces.
        camera: Camera of the z-buffer.
        T_world_camera: (4, 4) pose of the camera.
        inverse_depth: (H, W) 1 / metres, 0 for none.
        face_index: (H, W) face, -1 for none.
        face_instance: (F,) instance of each face.
        max_depth_m: Depth beyond this is written as 0.
        color: (H, W, 3) RGB, overwritten.
        depth: (H, W) metres, overwritten.
        instance: (H, W), overwritten.
    """
    intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
    _shade_kernel(
        colors,
        intrinsics,
        np.ascontiguousarray(T_world_camera),
        inverse_depth,
        face_index,
        face_instance,
        max_depth_m,
        _LIGHT,
        _BACKGROUND,
        color,
        depth,
        instance,
    )


@njit(allocates=True, cache=True, nogil=True)
def _shade_kernel(
    colors: SurfaceColors,
    intrinsics: Float64Array,
    pose: Float64Array,
    inverse_depth: Float32Array,
    face_index: Int32Array,
    face_instance: Int32Array,
    max_depth: float,
    light: Float64Array,
    background: UInt8Array,
    color: UInt8Array,
    depth: Float32Array,
    instance: Int32Array,
) -> None:
    height, width = face_index.shape
    fx, fy, cx, cy = intrinsics[0], intrinsics[1], intrinsics[2], intrinsics[3]
    rgb = np.empty(3, dtype=np.float64)
    for v in range(height):
        y = (v - cy) / fy
        for u in range(width):
            f = face_index[v, u]
            if f < 0:
                depth[v, u] = 0.0
                instance[v, u] = -1
                for k in range(3):
                    color[v, u, k] = background[k]
                continue
            z = 1.0 / inverse_depth[v, u]
            depth[v, u] = z if z <= max_depth else 0.0
            instance[v, u] = face_instance[f]
            x = (u - cx) / fx
            dx = pose[0, 0] * x + pose[0, 1] * y + pose[0, 2]
            dy = pose[1, 0] * x + pose[1, 1] * y + pose[1, 2]
            dz = pose[2, 0] * x + pose[2, 1] * y + pose[2, 2]
            nx, ny, nz = colors.normals[f, 0], colors.normals[f, 1], colors.normals[f, 2]
            facing = nx * dx + ny * dy + nz * dz
            toward_light = nx * light[0] + ny * light[1] + nz * light[2]
            if facing > 0.0:  # The back is in view: its normal is the opposite one.
                toward_light = -toward_light
            headlight = abs(facing) / math.sqrt(dx * dx + dy * dy + dz * dz)
            lit = _AMBIENT + _DIRECT * (0.5 + 0.5 * toward_light) + _HEADLIGHT * headlight
            if colors.texture[f] >= 0:
                px, py, pz = pose[0, 3] + z * dx, pose[1, 3] + z * dy, pose[2, 3] + z * dz
                _texel_kernel(colors, f, px, py, pz, z / fx, rgb)
            else:
                for k in range(3):
                    rgb[k] = colors.albedo[f, k]
            for k in range(3):
                color[v, u, k] = np.uint8(min(lit * rgb[k], 255.0))


# Inlined; otherwise all arrays of `colors` would be passed for every pixel.
@njit(cache=True, nogil=True, inline="always")
def _texel_kernel(
    colors: SurfaceColors,
    f: int,
    px: float,
    py: float,
    pz: float,
    pixel_m: float,
    rgb: Float64Array,
) -> None:
    """Sample a face's texture at a world point, bilinearly in the matching mip level."""
    rows, mips = colors.uv_rows, colors.mips
    s = rows[f, 0, 0] * px + rows[f, 0, 1] * py + rows[f, 0, 2] * pz + rows[f, 0, 3]
    t = rows[f, 1, 0] * px + rows[f, 1, 1] * py + rows[f, 1, 2] * pz + rows[f, 1, 3]
    texture = colors.texture[f]
    level = 0
    texels = colors.texels_per_m[f] * pixel_m
    while texels > 1.5 and level + 1 < mips.shape[1] and mips[texture, level + 1, 1] > 0:
        texels *= 0.5
        level += 1
    offset, h, w = mips[texture, level, 0], mips[texture, level, 1], mips[texture, level, 2]
    # Row 0 is the top of the image, v points up; the image repeats. Now both are >= 0.5.
    column = (s - math.floor(s)) * w + 0.5
    row = (math.ceil(t) - t) * h + 0.5
    c1, r1 = np.int32(column), np.int32(row)
    fc, fr = np.int32((column - c1) * 256.0), np.int32((row - r1) * 256.0)
    c0 = c1 - 1 if c1 > 0 else w - 1
    r0 = r1 - 1 if r1 > 0 else h - 1
    if c1 >= w:
        c1 = np.int32(0)
    if r1 >= h:
        r1 = np.int32(0)
    c0, r0 = min(c0, w - 1), min(r0, h - 1)
    # Unsigned: no check for negative indices.
    i00, i01 = np.uint64(offset + r0 * w + c0), np.uint64(offset + r0 * w + c1)
    i10, i11 = np.uint64(offset + r1 * w + c0), np.uint64(offset + r1 * w + c1)
    w11 = fr * fc
    w10, w01 = (fr << 8) - w11, (fc << 8) - w11
    w00 = 65536 - w11 - w10 - w01
    image = colors.texels
    for k in range(3):
        rgb[k] = (
            w00 * image[i00, k] + w01 * image[i01, k] + w10 * image[i10, k] + w11 * image[i11, k]
        ) * (1.0 / 65536.0)
