"""Noise model of a depth and colour camera."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ippon.camera import PinholeCamera
from ippon.compiling import njit

Float32Array = NDArray[np.float32]
UInt8Array = NDArray[np.uint8]

_TILE = 512
_BLOB_PX = 4.0
_TILE_SEED = 20230711


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseConfig:
    """Errors of the camera; with all values 0 it is exact within its range."""

    depth_m_per_m2: float = 0.002
    """Standard deviation of depth at one metre; it grows with the square of the depth (stereo)."""
    quantum_m: float = 0.001
    """Step of the depth readings, metres; 0 leaves them continuous."""
    edge_hole_probability: float = 0.5
    """Share of pixels without a return beside a depth step; larger loses more outlines."""
    edge_jump: float = 0.06
    """Depth difference to a neighbour, as a share of the depth, that counts as a step or a grazing
    view."""
    dropout: float = 0.004
    """Share of the image in patches without returns."""
    color_sigma: float = 3.0
    """Standard deviation of colour, in units of 1/255."""
    exposure_sigma: float = 0.03
    """Standard deviation of the brightness between frames, as a share."""
    white_balance_sigma: float = 0.03
    """Standard deviation of the gains of red, green and blue between runs, as a share; larger makes
    colours more often look like others."""

    def __post_init__(self) -> None:
        """Reject values that are not sizes or probabilities."""
        values = (
            self.depth_m_per_m2,
            self.quantum_m,
            self.color_sigma,
            self.exposure_sigma,
            self.white_balance_sigma,
        )
        if not all(math.isfinite(v) and v >= 0.0 for v in values):
            raise ValueError(f"noise must be finite and at least 0; got {values}")
        if not (0.0 <= self.edge_hole_probability <= 1.0 and 0.0 <= self.dropout <= 0.5):
            raise ValueError(
                "edge_hole_probability must be in 0..1 and dropout in 0..0.5; got "
                f"{self.edge_hole_probability}, {self.dropout}"
            )
        if not self.edge_jump > 0.0:
            raise ValueError(f"edge_jump must be positive; got {self.edge_jump}")

    @classmethod
    def none(cls) -> "NoiseConfig":
        """Return a camera without errors."""
        return cls(
            depth_m_per_m2=0.0,
            quantum_m=0.0,
            edge_hole_probability=0.0,
            dropout=0.0,
            color_sigma=0.0,
            exposure_sigma=0.0,
            white_balance_sigma=0.0,
        )


class SensorNoise:
    """Adds noise to images of one size.

    Noise is read from fixed tiles at random offsets: two random numbers per tile and frame instead
    of one per pixel. Neighbouring pixels are correlated, as in a stereo camera.
    """

    def __init__(
        self,
        camera: PinholeCamera,
        min_depth_m: float,
        max_depth_m: float,
        config: NoiseConfig,
        seed: int = 0,
    ) -> None:
        self.config = config
        run = np.random.Generator(np.random.PCG64([seed, _TILE_SEED]))
        self._gains = 1.0 + config.white_balance_sigma * run.standard_normal(3)
        self._range_m = (min_depth_m, max_depth_m)
        tiles = np.random.Generator(np.random.PCG64(_TILE_SEED))
        self._white = tiles.standard_normal((_TILE, _TILE), dtype=np.float32)
        self._blobs = _unit(_smooth(self._white[::-1]))
        self._mixed = _unit(self._white + self._blobs[::-1])
        self._hole_level = float(np.quantile(self._blobs, 1.0 - config.dropout))
        self._edge_level = float(np.quantile(self._white, 1.0 - config.edge_hole_probability))
        self._shape = (camera.height, camera.width)

    def corrupt_depth(self, depth: Float32Array, rng: np.random.Generator) -> Float32Array:
        """Return a noisy depth image.

        Args:
            depth: (H, W) float32 true depth in metres along the optical axis, 0 for none.
            rng: Random numbers of this frame.

        Returns:
            (H, W) float32 metres, 0 for no return.
        """
        out = np.empty_like(depth)
        config = self.config
        _depth_kernel(
            depth,
            self._mixed,
            self._blobs,
            self._white,
            rng.integers(0, _TILE, size=6),
            np.array(
                [
                    config.depth_m_per_m2,
                    config.quantum_m,
                    self._edge_level if config.edge_hole_probability > 0.0 else math.inf,
                    config.edge_jump,
                    self._hole_level if config.dropout > 0.0 else math.inf,
                    *self._range_m,
                ]
            ),
            out,
        )
        return out

    def corrupt_color(self, color: UInt8Array, rng: np.random.Generator) -> UInt8Array:
        """Return a noisy (H, W, 3) uint8 colour image."""
        offsets = rng.integers(0, _TILE, size=2)
        gains = self._gains * (1.0 + self.config.exposure_sigma * float(rng.standard_normal()))
        if self.config.color_sigma == 0.0 and (gains == 1.0).all():
            return color
        out = np.empty_like(color)
        _color_kernel(color, self._white, offsets, self.config.color_sigma, gains, out)
        return out


def _smooth(tile: Float32Array) -> Float32Array:
    return np.asarray(ndimage.gaussian_filter(tile, _BLOB_PX, mode="wrap"), dtype=np.float32)


def _unit(tile: Float32Array) -> Float32Array:
    return ((tile - tile.mean()) / tile.std()).astype(np.float32)


@njit(cache=True, nogil=True)
def _depth_kernel(
    depth: Float32Array,
    mixed: Float32Array,
    blobs: Float32Array,
    white: Float32Array,
    offsets: NDArray[np.int64],
    parameters: NDArray[np.float64],
    out: Float32Array,
) -> None:
    height, width = depth.shape
    sigma, quantum, edge_level, edge_jump, hole_level, nearest, farthest = parameters
    mask = mixed.shape[0] - 1
    for v in range(height):
        above, below = max(v - 1, 0), min(v + 1, height - 1)
        noise_row, hole_row = (v + offsets[0]) & mask, (v + offsets[2]) & mask
        edge_row = (v + offsets[4]) & mask
        for u in range(width):
            z = depth[v, u]
            noisy = z + sigma * z * z * mixed[noise_row, (u + offsets[1]) & mask]
            if quantum > 0.0:
                noisy = np.floor(noisy / quantum + 0.5) * quantum
            hole = blobs[hole_row, (u + offsets[3]) & mask] > hole_level
            if z <= 0.0 or hole or not nearest <= noisy <= farthest:
                out[v, u] = 0.0
                continue
            # Steps are rare, high noise is not: testing the step first predicts the branch well.
            left = depth[v, max(u - 1, 0)] - z
            right = depth[v, min(u + 1, width - 1)] - z
            up, down = depth[above, u] - z, depth[below, u] - z
            jump = max(abs(left), abs(right), abs(up), abs(down))
            if jump > edge_jump * z and white[edge_row, (u + offsets[5]) & mask] > edge_level:
                noisy = 0.0
            out[v, u] = noisy


@njit(cache=True, nogil=True)
def _color_kernel(
    color: UInt8Array,
    white: Float32Array,
    offsets: NDArray[np.int64],
    sigma: float,
    gains: NDArray[np.float64],
    out: UInt8Array,
) -> None:
    height, width = color.shape[:2]
    mask = white.shape[0] - 1
    for v in range(height):
        for u in range(width):
            luminance = sigma * white[(v + offsets[0]) & mask, (u + offsets[1]) & mask]
            for k in range(3):
                # After demosaicing, sensor noise is mostly in the brightness.
                chroma = 0.5 * sigma * white[(v + offsets[1]) & mask, (u + 131 * (k + 1)) & mask]
                value = gains[k] * color[v, u, k] + luminance + chroma
                out[v, u, k] = np.uint8(min(max(value, 0.0), 255.0))
