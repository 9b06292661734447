"""The voxel map: geometry, object probabilities and distances to obstacles."""

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ippon.errors import MapFileError
from ippon.frame import Frame
from ippon.mapping import map_file, queries, snapshot
from ippon.mapping.arrays import BLOCK_EDGE, MapArrays
from ippon.mapping.blocks import N_LAYER_FREE, N_ROWS, N_SLABS, BlockDirectory, Pools, make_pools
from ippon.mapping.config import SURFACE_VOXELS_PER_BLOCK, MapConfig
from ippon.mapping.integration import FrameIntegrator, IntegrationReport
from ippon.mapping.objects.object_layers import ObjectLayers
from ippon.mapping.objects.ooi_suppression import SuppressedRegion
from ippon.mapping.objects.surface_voxels import SurfaceVoxels
from ippon.observation_model import ObservationModels


class VoxelMap:
    """Map of everything observed so far, in blocks of 8 x 8 x 8 voxels.

    Integrated evidence decides between occupied and free (`geometry_update`), the signed distance
    locates the surface inside a voxel, a Bayes filter keeps the object probabilities
    (`posterior_arithmetic`), and the distance field is exact up to `MapConfig.distance_max_m`.

    Args:
        config: How observations are fused.
        labels: Names of the common objects.
        models: Observation models of the networks; None for the shipped defaults.

    If the object of interest is one of the common labels, its probability starts from that of the
    label, and every heatmap with that label updates it. Another object of interest is updated only
    by heatmaps that were made for it. The `level` of a voxel is that of its most probable common
    label, even where p(v in O) is high. p(v in C_j), used for labels and for l(v), is conditional
    on the voxel not being the object of interest.
    """

    def __init__(
        self,
        config: MapConfig,
        labels: Sequence[str],
        models: ObservationModels | None = None,
    ) -> None:
        self.config = config
        self._limit_mb = config.memory_limit_mb
        self.revision = 0
        """Grows by one with each change."""
        self._pools: Pools = make_pools(config.max_blocks)
        self.models = models or ObservationModels()
        """What the scores of networks are worth."""
        self._layers = ObjectLayers(config, labels, self._pools, self.models)
        self._directory = BlockDirectory(config.directory_max_cells)
        self._integrator = FrameIntegrator(config, self._pools, self._directory)

    @property
    def labels(self) -> tuple[str, ...]:
        """The common objects, in the order of `SurfaceVoxels.label` and of levels."""
        return self._layers.labels

    @property
    def ooi(self) -> str | None:
        """The object of interest."""
        return self._layers.ooi

    @property
    def block_coords(self) -> NDArray[np.int64]:
        """(B, 3) block index of each row of `arrays`; rows that the directory lacks are void."""
        return self._pools.coord

    @property
    def surface_slots(self) -> NDArray[np.int32]:
        """(S, 512) row of `surface` for each voxel of a slab, 0 for none; see `MapArrays.slab`."""
        return self._pools.slot

    @property
    def surface(self) -> SurfaceVoxels:
        """Rows of the surface voxels; `surface_slots` finds them."""
        return self._layers.surface

    @property
    def floor_z_m(self) -> float:
        """Height of the floor that the robot stood on last, world frame."""
        return self._integrator.floor_z_m

    def integrate(self, frame: Frame) -> IntegrationReport:
        """Fuse one frame.

        Raises:
            FrameRejectedError: The frame is implausible; the map is unchanged.
        """
        report = self._integrator.integrate(frame, self._layers, self.revision + 1)
        self.revision = report.revision
        return report

    def integrate_heatmap(self, frame: Frame) -> int:
        """Fuse the late heatmap of a frame that was integrated without it.

        Depth and colour are not fused again. Voxels that are no longer surface are skipped.

        Args:
            frame: The frame, now with its heatmap.

        Returns:
            Number of surface voxels that the heatmap updated.

        Raises:
            ValueError: The frame has no heatmap.
        """
        if frame.heatmap is None:
            raise ValueError("the frame has no heatmap; use integrate() for frames without one")
        self.revision += 1
        return self._integrator.integrate_heatmap(frame, self._layers, self.revision)

    def set_ooi(
        self,
        ooi: str | None,
        highest_m: float = math.inf,
        *,
        lowest_m: float = -math.inf,
        small_m: float = math.inf,
    ) -> None:
        """Set the object of interest; its probabilities are reset, everything else is kept.

        Args:
            ooi: Canonical label; None for no object of interest. The probabilities of a common
                label are the starting point.
            highest_m: Height above the robot's floor from which nothing is the object.
            lowest_m: Height above the floor up to which nothing is the object, from 20 cm below it.
            small_m: Side of a small object in an image. If that is less than `CLEAR_SHARE` of the
                image, a detector's miss is no evidence.

        Raises:
            ValueError: A height is not a number, they are not in that order, or the side is not
                positive.
        """
        if not highest_m > 0.0:
            raise ValueError(f"highest_m is metres above the floor, more than 0; got {highest_m}")
        if not lowest_m < highest_m:
            raise ValueError(f"lowest_m lies below highest_m; got {lowest_m} and {highest_m}")
        if not small_m > 0.0:
            raise ValueError(f"small_m is metres, more than 0; got {small_m}")
        self.revision += 1
        floor_z_m = self._integrator.floor_z_m
        self._layers.set_ooi(
            ooi, highest_m, floor_z_m, self.revision, lowest_m=lowest_m, small_m=small_m
        )

    def set_models(self, models: ObservationModels) -> None:
        """Set the observation models for images from now on; earlier images are not fused again."""
        self.models = models
        self._layers.set_models(models)

    def set_levels(self, levels: NDArray[np.uint8], probabilities: NDArray[np.float32]) -> None:
        """Set how likely the object of interest is near each common object.

        Args:
            levels: (N,) level of each label, an index of `probabilities`.
            probabilities: (4,) l(O | C) of each level.

        Raises:
            ValueError: Levels or probabilities of another number, or out of range.
        """
        self._layers.set_levels(levels, probabilities, self.revision + 1)
        self.revision += 1

    def add_label(self, label: str) -> None:
        """Add a common object; each known surface voxel gives it the share of its prior."""
        self._layers.add_label(label, self.revision + 1)
        self.revision += 1

    def suppress_ooi(self, centre_world: NDArray[np.float64], radius_m: float) -> SuppressedRegion:
        """Exclude the object of interest from a ball, whatever later images show.

        Args:
            centre_world: (3,) metres.
            radius_m: Radius of the ball.

        Returns:
            The values before, for `restore_ooi`.

        Raises:
            ValueError: The centre is not finite or the radius not positive.
        """
        before = self._layers.suppress_ooi(
            centre_world, radius_m, self._directory, self.revision + 1
        )
        self.revision += 1
        return before

    def restore_ooi(self, ruled_out: SuppressedRegion) -> None:
        """Undo `suppress_ooi`; surface that is still there regains its earlier values.

        An object of interest that is a common label has the probability of the label there.
        """
        floor_z_m = self._integrator.floor_z_m
        self._layers.restore_ooi(ruled_out, self._directory, floor_z_m, self.revision + 1)
        self.revision += 1

    def arrays(self) -> MapArrays:
        """Return views of the map for kernels; they reflect later changes."""
        n, slabs = int(self._pools.tally[N_ROWS]), int(self._pools.tally[N_SLABS])
        return MapArrays(
            voxel_size=self.config.voxel_size_m,
            origin_block=self._directory.origin,
            directory=self._directory.rows,
            state=self._pools.state[:n],
            slab=self._pools.slab[:n],
            ooi=self._pools.ooi[:slabs],
            level=self._pools.level[:slabs],
            squared_distance=self._pools.squared_distance[:n],
            revision=self._pools.revision[:n],
            ooi_clear_m=self._layers.ooi_clear_m,
            ooi_prior_log_odds=self._layers.ooi_prior_log_odds,
        )

    def state_at(self, points_world: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return (N,) uint8 `UNKNOWN`, `FREE` or `OCCUPIED` for (N, 3) points in metres."""
        return queries.state_at(self.arrays(), points_world)

    def distance_at(self, points_world: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return (N,) metres to the nearest obstacle; see `queries.distance_at`."""
        return queries.distance_at(self.arrays(), points_world, self.config.distance_max_m)

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Return the corners, (3,) metres each, of the box of observed blocks; None when empty."""
        n = int(self._pools.tally[N_ROWS])
        coord = self._pools.coord[:n][self._pools.used[:n] == 1]
        if len(coord) == 0:
            return None
        return coord.min(axis=0) * self._block_m, (coord.max(axis=0) + 1) * self._block_m

    def best_ooi(self) -> float:
        """Return the highest p(v in O) of an occupied voxel, 0 when none was observed."""
        n = int(self._pools.tally[N_ROWS])
        return float(self._pools.best_ooi[:n].max()) / 254.0 if n else 0.0

    def explored_m2(self) -> float:
        """Return the area that was seen free at `MapConfig.body_height_m` over the last floor."""
        return float(self._pools.tally[N_LAYER_FREE]) * self.config.voxel_size_m**2

    def save(self, path: Path) -> None:
        """Write the whole map to one file (see `map_file`); raises OSError."""
        map_file.write(path, *self.capture())

    def capture(self) -> tuple[dict[str, Any], map_file.Arrays]:
        """Return copies of the header and arrays that `save` writes; see `map_file.write`."""
        lowest_m, highest_m = self._layers.ooi_lowest_m, self._layers.ooi_highest_m
        small_m = self._layers.ooi_small_m
        header = {
            "config": {**dataclasses.asdict(self.config), "memory_limit_mb": self._limit_mb},
            "labels": list(self.labels),
            "ooi": self.ooi,
            "revision": self.revision,
            "layer": self._integrator.layer,
            "levels": self._layers.levels.tolist(),
            "level_probabilities": [float(p) for p in self._layers.level_probabilities],
            "suppressed": self._layers.suppressed.tolist(),
            # JSON has no infinity.
            "ooi_highest_m": None if math.isinf(highest_m) else highest_m,
            "ooi_lowest_m": None if math.isinf(lowest_m) else lowest_m,
            "ooi_small_m": None if math.isinf(small_m) else small_m,
            "floor_z_m": self._integrator.floor_z_m,
        }
        return header, snapshot.capture(self._pools, self.surface, len(self.labels))

    @classmethod
    def load(cls, path: Path, config: MapConfig | None = None) -> "VoxelMap":
        """Load a saved map.

        Args:
            path: The file.
            config: Replaces the saved configuration; voxel size and cut-off must be the same. Its
                memory limit is raised for a map that filled the same limit in an earlier version.

        Raises:
            MapFileError: The file is damaged, of another version, or not a map; or `config` does
                not fit it.
        """
        # A map within its memory limit can be read again; many labels take more than it counts on.
        limit = 0 if config is None else 4 * int(1e6 * config.memory_limit_mb)
        header, arrays = map_file.read(path, max(map_file.MOST_BYTES, limit))
        try:
            saved = MapConfig(**_known_fusion(header["config"]))
            asked = used = config or saved
            if used.memory_limit_mb >= saved.memory_limit_mb:
                # Earlier versions put more blocks into the same limit.
                rows = -(-(len(arrays["surface_energy"]) + 1) // SURFACE_VOXELS_PER_BLOCK)
                used = used.holding(max(len(arrays["coord"]), rows))
            voxel_map = cls(used, header["labels"])
            voxel_map._limit_mb = asked.memory_limit_mb
            voxel_map._restore(header, arrays)
        except (KeyError, TypeError, ValueError) as error:
            raise MapFileError(f"{path.name} is not a usable map: {error}") from error
        same = ("voxel_size_m", "distance_max_m", "truncation_voxels", "fusion")
        for name in same:
            mine, theirs = getattr(voxel_map.config, name), getattr(saved, name)
            if {mine, theirs} == {"places", "paper"}:
                continue  # Both values keep the same posterior.
            if mine != theirs:
                raise MapFileError(f"{path.name} was made with {name} {theirs}; asked for {mine}")
        return voxel_map

    def _restore(self, header: dict[str, Any], arrays: snapshot.Arrays) -> None:
        if arrays["surface_energy"].shape[1:] != (len(self.labels),):
            raise ValueError("probabilities do not belong to the labels")
        snapshot.restore(arrays, self._pools, self.surface, self._directory)
        layers = self._layers
        layers.ooi = header["ooi"]
        layers.levels = np.array(header["levels"], np.uint8)
        layers.level_probabilities = np.array(header["level_probabilities"], np.float32)
        layers.suppressed = np.array(header["suppressed"], np.float64).reshape(-1, 4)
        if layers.levels.shape != (len(self.labels),) or layers.level_probabilities.shape != (4,):
            raise ValueError("levels do not belong to the labels")
        self.revision = int(header["revision"])
        self._integrator.layer = header["layer"]
        # Maps saved by earlier versions have none of these.
        highest_m = header.get("ooi_highest_m")
        layers.ooi_highest_m = math.inf if highest_m is None else float(highest_m)
        lowest_m = header.get("ooi_lowest_m")
        layers.ooi_lowest_m = -math.inf if lowest_m is None else float(lowest_m)
        small_m = header.get("ooi_small_m")
        layers.ooi_small_m = math.inf if small_m is None else float(small_m)
        self._integrator.floor_z_m = float(header.get("floor_z_m", 0.0))

    @property
    def _block_m(self) -> float:
        return BLOCK_EDGE * self.config.voxel_size_m


def _known_fusion(config: dict[str, Any]) -> dict[str, Any]:
    """Return a saved configuration; earlier versions call the paper's filter "bayes"."""
    return {**config, "fusion": "paper"} if config.get("fusion") == "bayes" else config
