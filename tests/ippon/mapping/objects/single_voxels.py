"""A map of single surface voxels, each of which one pixel of an image shows."""

from dataclasses import dataclass, field

import numpy as np

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.mapping.blocks import N_ROWS, BlockDirectory, Pools, make_pools
from ippon.mapping.config import MapConfig
from ippon.mapping.integration import FrameIntegrator
from ippon.mapping.objects.object_layers import ObjectLayers
from ippon.mapping.objects.surface_voxels import NORM_STEPS, STEPS_PER_NAT
from ippon.observation import Heatmap, HeatmapKind
from ippon.observation_model import ObservationModel, ObservationModels, ScoreTable

LABELS = ("wall", "door", "picture", "table")
OOI = "hat"
TABLE = ScoreTable(scores=(0.1, 0.4, 0.9), nats=(-1.0, 1.0, 6.0), not_recognised=-0.5)
MODELS = ObservationModels(
    [ObservationModel(source="x", kind="scores", provenance="test", table=TABLE)]
)
BLOCKS = ((2, -1, 1), (3, -1, 1))
EDGE_M = 0.1


def voxel(x: int, y: int, z: int, block: int = 0) -> int:
    """Return the number of a voxel: 512 times its block's, and its own in the block."""
    return block << 9 | x << 6 | y << 3 | z


def centre_of(k: int) -> np.ndarray:
    """Return the centre of a voxel, world frame, metres."""
    inside = np.array([k >> 6 & 7, k >> 3 & 7, k & 7])
    return (np.array(BLOCKS[k >> 9]) * 8 + inside + 0.5) * EDGE_M


@dataclass
class SingleVoxels:
    """The map; `show` gives each voxel one pixel."""

    kind: HeatmapKind = "scores"
    config: MapConfig = field(default_factory=lambda: MapConfig(memory_limit_mb=64.0))
    labels: tuple[str, ...] = LABELS
    ooi: str | None = OOI
    revision: int = 0

    def __post_init__(self) -> None:
        self.pools: Pools = make_pools(self.config.max_blocks)
        self.pools.coord[: len(BLOCKS)], self.pools.tally[N_ROWS] = BLOCKS, len(BLOCKS)
        self.layers = ObjectLayers(self.config, self.labels, self.pools, MODELS)
        self.layers.ooi = self.ooi
        directory = BlockDirectory(self.config.directory_max_cells)
        self._integrator = FrameIntegrator(self.config, self.pools, directory)

    def show(
        self,
        voxels: dict[int, list[int]],
        *,
        labels: tuple[str, ...] | None = None,
        ooi: str | None = OOI,
        depth_m: float = 1.0,
        camera_at: tuple[float, float, float] = (0.0, -0.4, 1.0),
        color: tuple[int, int, int] = (0, 0, 0),
        has_heatmap: bool = True,
    ) -> int:
        """Show each voxel the values of a pixel; return how many voxels the heatmap updated."""
        self.revision += 1
        n = len(voxels)
        values = np.array([list(voxels.values())], np.uint8)
        heatmap = Heatmap(
            labels=self.labels if labels is None else labels,
            ooi=ooi,
            probabilities=values,
            kind=self.kind,
            source="x",
        )
        frame = Frame(
            stamp_ns=self.revision,
            color=np.tile(np.array(color, np.uint8), (1, n, 1)),
            depth=np.full((1, n), depth_m, np.float32),
            camera=PinholeCamera.from_horizontal_fov(n, 1, 1.0),
            T_world_camera=make_transform(R_BASE_CAMERA_LEVEL, camera_at),
            T_world_base=np.eye(4),
            tilt_rad=0.0,
            heatmap=heatmap if has_heatmap else None,
        )
        entries = np.array([(k >> 9, k & 511, sample) for sample, k in enumerate(voxels)], np.int32)
        depth = np.pad(frame.depth, 1)
        return self._integrator.fuse(frame, depth, (1, 1), entries, n, self.layers, self.revision)

    def slot(self, k: int) -> int:
        """Return a voxel's row in the surface arrays, 0 for none."""
        return int(self.pools.slot[self.pools.slab[k >> 9], k & 511])

    def energy(self, k: int) -> np.ndarray:
        """Return -log q of a voxel in steps, up to a constant."""
        return self.layers.surface.energy[self.slot(k), : len(self.labels)].astype(np.int64)

    def q(self, k: int) -> np.ndarray:
        """Return the posterior of the common labels."""
        q = np.exp(-self.energy(k) / STEPS_PER_NAT)
        return q / q.sum()

    def log_odds(self, k: int) -> float:
        """Return L of a voxel."""
        return float(self.layers.surface.log_odds[self.slot(k)])

    def log_norm(self, k: int) -> float:
        """Return the stored log of the sum of the labels' exp(-energy)."""
        return float(self.layers.surface.log_norm[self.slot(k)]) / NORM_STEPS
