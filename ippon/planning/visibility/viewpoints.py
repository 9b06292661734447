"""What every viewpoint promises, and when that was worked out."""

import copy
import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.guidance.levels import Level
from ippon.mapping.arrays import MapArrays
from ippon.mapping.config import LEVEL_PROBABILITIES
from ippon.mapping.far_evidence.far_evidence import MIN_CHANGE_NAT, FarEvidence
from ippon.planning.surface_scale import surface_scale
from ippon.planning.visibility.orientation import (
    ViewSums,
    choose_view,
    frame_object,
    recount_levels,
    sum_sectors,
    sum_views,
)
from ippon.planning.visibility.panorama import ViewRules, see
from ippon.planning.visibility.rays import cast_ray
from ippon.planning.visibility.region_weights import RegionWeights
from ippon.planning.visibility.staleness import stale_kernel
from ippon.planning.visibility.view_memory import ViewMemory
from ippon.planning.visibility.view_table import (
    Orientations,
    ViewTable,
    build_orientations,
    build_view_table,
    in_frustum,
)
from ippon.robot import RobotProfile

_FRINGE: Final = 5.0
"""Voxels of `REFERENCE_VOXEL_M` beside a thing that may be misread for it: of a chair or a toilet,
which need as few, all that counts is within reach."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewConfig:
    """What a voxel counts, and how finely directions are told apart."""

    unknown_occupied: float = 0.1
    """p_occ of an unknown voxel; more makes exploring worth more against what is known."""
    unknown_depth_m: float = 5.0
    """How far a ray goes through unknown space: as far as the camera measures depth. Less draws the
    robot to corners as much as to rooms that it has not looked into (docs/decisions.md)."""
    unknown_looks: int = 8
    """Looks after which space that stays unknown no longer attracts."""
    surface_looks: int = 40
    """Looks after which a surface no longer attracts, whatever its probability."""
    surface_range_m: float = 3.5
    """Surfaces count within this range, a little less than the map takes the goal's labels from:
    from farther away a look at them tells nothing."""
    ooi_floor: float = 0.05
    """p(v in O) up to which a voxel is background: thousands of wall voxels at one percent
    would otherwise outweigh every unexplored room."""
    band_low_m: float = 0.1
    """Height above the floor from which all voxels count."""
    object_low_m: float = -0.05
    """Height above the floor from which object voxels count: things lie flat on it."""
    band_high_m: float = 2.0
    """Height above the floor up to which they count; more looks for things on the ceiling."""
    termination_range_m: float = 0.95
    """Horizontal reach of N_T: a little less than the metre of the task, so that the robot need
    not stop exactly on the viewpoint."""
    termination_depth_m: float = 0.7
    """How far beyond that more of the object counts with what is within reach: of a bed not enough
    is within a metre before the robot touches it. 0 is the paper's T(n), and drives deeper."""
    level_range_m: float = 5.0
    """Range within which labelled voxels decide p_img: what is in the view tells most of what is
    not yet seen in it (docs/decisions.md)."""
    min_level_voxels: int = 5
    """Voxels below which a level counts as empty; more ignores more misread specks."""
    yaw_bins: int = 160
    """Directions round the horizon; more sees small gaps better and takes longer."""
    heading_stride: int = 4
    """Every so manieth direction is a candidate heading."""
    tilts: int = 7
    """Candidate tilts between the camera's limits."""

    def __post_init__(self) -> None:
        """Reject rasters and probabilities that cannot work."""
        if self.yaw_bins % self.heading_stride or self.yaw_bins < 16 or self.tilts < 2:
            raise ValueError(
                "yaw_bins must be at least 16 and a multiple of heading_stride, tilts at least 2; "
                f"got {self.yaw_bins}, {self.heading_stride}, {self.tilts}"
            )
        if not 0.0 <= self.termination_depth_m < math.inf:
            raise ValueError(
                f"termination_depth_m must be finite and at least 0; got {self.termination_depth_m}"
            )
        if not 0.0 < self.unknown_occupied <= 1.0:
            raise ValueError(f"unknown_occupied must lie in (0, 1]; got {self.unknown_occupied}")


class Viewpoints:
    """One row a node of the roadmap."""

    def __init__(
        self, config: ViewConfig, robot: RobotProfile, capacity: int, ooi_threshold: float
    ) -> None:
        self.config = config
        self._robot = robot
        self._ooi_threshold = ooi_threshold
        self._memory: ViewMemory | None = None
        headings = config.yaw_bins // config.heading_stride
        self.evaluated = np.full(capacity, -1, dtype=np.int64)
        """Step of the last evaluation, -1 for never."""
        self.gain = np.zeros(capacity, dtype=np.float32)
        self.potential = np.zeros(capacity, dtype=np.float32)
        """Gain if p_img were average: what decides whether a place is worth anything."""
        self.termination = np.zeros(capacity, dtype=np.float32)
        self.yaw = np.zeros(capacity)
        self.tilt = np.zeros(capacity)
        self.level = np.full(capacity, int(Level.AVERAGE), dtype=np.uint8)
        self.by_heading = np.zeros((capacity, headings), dtype=np.float32)
        self._reach = np.zeros((capacity, config.yaw_bins), dtype=np.float32)
        self._framing = np.full((capacity, 2), np.nan)
        self._at = np.zeros((capacity, 2))
        self._regions: RegionWeights | None = None
        self._unweighted = np.ones(headings, dtype=np.float32)
        self._far_evidence: FarEvidence | None = None
        self._far_evidence_revision = 0
        self.far_evidence_nat = np.zeros((capacity, headings), dtype=np.float32)
        """(capacity, A) nat, log-likelihood ratio of the object ahead, from far evidence."""
        self.cued = np.zeros((capacity, headings), dtype=np.bool_)
        """Headings that look at what images show to be certainly near the object."""
        self._voxel_m = 0.0
        self._sums: dict[int, ViewSums] = {}
        self._labelled: dict[int, NDArray[np.int32]] = {}
        self._table: ViewTable | None = None
        self._orientations: Orientations | None = None
        self._rules: ViewRules | None = None
        self._layers = (0, 0)
        self._camera_layer = 0
        self._probabilities = np.array(LEVEL_PROBABILITIES, dtype=np.float32)

    @property
    def memory(self) -> ViewMemory:
        """What the camera has looked at; raises before the first `follow`."""
        assert self._memory is not None, "follow() comes first"
        return self._memory

    @property
    def headings(self) -> Float64Array:
        """(A,) candidate headings, radians."""
        assert self._orientations is not None, "follow() comes first"
        return self._orientations.yaws

    def follow(
        self,
        arrays: MapArrays,
        floor_z_m: float,
        T_world_base: Float64Array,
        tilt_rad: float,
        standing_at: Float64Array | None = None,
    ) -> None:
        """Take over the map's changes and the image that was taken from here.

        Args:
            arrays: The map, with that image in it.
            floor_z_m: Height of the floor.
            T_world_base: Where the robot stands.
            tilt_rad: Its camera's tilt.
            standing_at: (2,) position of the viewpoint that the robot has come to, None for none.
                A step aside may show other things; what the robot leaves unseen from there counts
                as looked at all the same.
        """
        if self._memory is None:
            self._memory = ViewMemory(self._robot.max_depth_m / arrays.voxel_size)
        self._prepare(arrays, floor_z_m)
        assert self._table is not None, "_prepare() sets it"
        assert self._rules is not None, "_prepare() sets it"
        self.memory.follow(arrays, self._layers, self._rules)
        self._update_far_evidence()
        T_world_camera = T_world_base @ self._robot.T_base_camera(tilt_rad)
        ahead = T_world_camera[:3, 2]
        shown = in_frustum(
            self._table.rays,
            self._robot,
            math.atan2(T_world_base[1, 0], T_world_base[0, 0]),
            math.asin(max(-1.0, min(1.0, float(ahead[2])))),
            # The rim of the image may be cut off by its registration.
            0.97,
        )
        stood = [T_world_camera[:2, 3]] + ([] if standing_at is None else [standing_at])
        voxels = [self._camera_voxel(arrays.voxel_size, float(p[0]), float(p[1])) for p in stood]
        for voxel in dict.fromkeys(voxels):
            self.memory.record(arrays, self._table, self._rules, voxel, shown)

    def evaluate(self, node: int, xy: Float64Array, arrays: MapArrays) -> None:
        """Cast the panorama of a node at `xy` (2,) and choose its orientation."""
        table, orientations, rules = self._table, self._orientations, self._rules
        assert table is not None, "follow() comes first"
        assert orientations is not None, "follow() comes first"
        assert rules is not None, "follow() comes first"
        camera = self._camera_voxel(arrays.voxel_size, float(xy[0]), float(xy[1]))
        panorama = see(arrays, table, rules, self.memory.field, camera)
        sums = sum_views(panorama, orientations, self._half_fov_columns(table))
        self._sums[node] = sums
        self._labelled[node] = panorama.labelled
        self._reach[node] = np.abs(panorama.depth).max(axis=0)
        self.termination[node] = panorama.termination
        yaw, tilt = self._framing[node]
        before = None if math.isnan(yaw) else (float(yaw), float(tilt))
        framing = frame_object(sums, panorama, orientations, table.bin_rad, table.pitch_low, before)
        self._framing[node] = framing if framing is not None else (math.nan, math.nan)
        self.evaluated[node] = self.memory.step
        self._at[node], self._voxel_m = xy, arrays.voxel_size
        far_evidence_nat, cued = self._far_evidence_from(np.array([node]))
        self.far_evidence_nat[node], self.cued[node] = far_evidence_nat[0], cued[0]
        self._choose(node)

    def set_probabilities(self, probabilities: NDArray[np.float32]) -> None:
        """Weigh every viewpoint anew by other level probabilities; casts no ray."""
        self._probabilities = np.asarray(probabilities, dtype=np.float32)
        for node in self._sums:
            self._choose(node)

    def set_regions(self, regions: RegionWeights | None) -> None:
        """Weigh what every viewpoint looks at by what the operator painted; casts no ray."""
        self._regions = regions
        for node in self._sums:
            self._choose(node)

    def set_far_evidence(self, far_evidence: FarEvidence | None) -> None:
        """Follow what images show beyond the map's range; None for nothing."""
        self._far_evidence, self._far_evidence_revision = far_evidence, 0
        self.far_evidence_nat[:] = 0.0
        self.cued[:] = False
        for node in self._sums:
            self._choose(node)

    def copy(self) -> "Viewpoints":
        """Return viewpoints to try something out on; what was seen is shared, estimates are not."""
        twin = copy.copy(self)
        for name in ("gain", "potential", "termination", "yaw", "tilt", "level", "by_heading"):
            setattr(twin, name, getattr(self, name).copy())
        twin._sums = dict(self._sums)  # noqa: SLF001
        return twin

    def recount(self, arrays: MapArrays) -> None:
        """Count the levels of the map anew at every viewpoint; casts no ray."""
        table, orientations = self._table, self._orientations
        if table is None or orientations is None:
            return
        for node, sums in self._sums.items():
            x, y = self._at[node]
            camera = self._camera_voxel(arrays.voxel_size, float(x), float(y))
            levels = recount_levels(arrays, table, camera, self._labelled[node])
            self._sums[node] = sums._replace(
                levels=sum_sectors(levels, orientations, self._half_fov_columns(table))
            )
            self._choose(node)

    def forget(self, node: int) -> None:
        """Drop a node's row."""
        self.evaluated[node] = -1
        self.gain[node] = self.potential[node] = self.termination[node] = 0.0
        self.by_heading[node] = 0.0
        self._framing[node] = math.nan
        self._sums.pop(node, None)
        self._labelled.pop(node, None)

    def stale(
        self, nodes: NDArray[np.int64], xy: Float64Array, voxel_size: float
    ) -> NDArray[np.bool_]:
        """Tell which nodes were never evaluated, or saw space that has changed since.

        Args:
            nodes: (N,) rows.
            xy: (capacity, 2) positions of all nodes.
            voxel_size: Edge of a voxel in metres.
        """
        out = np.zeros(len(nodes), dtype=np.bool_)
        assert self._table is not None
        stale_kernel(
            nodes,
            xy / voxel_size,
            self.evaluated,
            self._reach,
            self.memory.changed,
            self.memory.field.origin,
            self._table.range_voxels,
            out,
        )
        return out

    def frames_object(self, node: int) -> tuple[float, float]:
        """Return yaw and tilt that show the most object voxels, or the exploring ones."""
        yaw, tilt = self._framing[node]
        if math.isnan(yaw):
            return float(self.yaw[node]), float(self.tilt[node])
        return float(yaw), float(tilt)

    def far_evidence_at(self, node: int) -> tuple[float, bool]:
        """Return what images say of what a viewpoint looks at: nat, and whether it is a cue."""
        assert self._orientations is not None, "follow() comes first"
        heading = int(np.argmin(np.abs(self._orientations.yaws - self.yaw[node])))
        return float(self.far_evidence_nat[node, heading]), bool(self.cued[node, heading])

    def eye_z_m(self, arrays: MapArrays) -> float:
        """Height of the camera in the world, metres."""
        return (self._camera_layer + 0.5) * arrays.voxel_size

    def sees(self, xy: Float64Array, point_world: Float64Array, arrays: MapArrays) -> bool:
        """Tell whether nothing known stands between a viewpoint (2,) and an occupied voxel (3,)."""
        assert self._table is not None, "follow() comes first"
        assert self._rules is not None, "follow() comes first"
        camera = self._camera_voxel(arrays.voxel_size, float(xy[0]), float(xy[1]))
        offset = np.floor(point_world / arrays.voxel_size) - np.array(camera)
        far = float(np.linalg.norm(offset))
        if far < 1.0:
            return True
        # Also over the edge of a drop, where no voxel counts otherwise.
        layers = self._table.layer_low, self._table.layer_high, int(offset[2])
        table = self._table._replace(layer_low=min(layers), layer_high=max(layers))
        depth = cast_ray(arrays, table, self._rules.unknown_depth, camera, offset / far)
        # A ray may graze the voxel beside the one that is meant.
        return abs(depth) >= far - 1.8

    def _update_far_evidence(self) -> None:
        """Weigh anew what looks at places that images showed since."""
        far_evidence = self._far_evidence
        if (
            far_evidence is None
            or far_evidence.revision == self._far_evidence_revision
            or not self._sums
        ):
            return
        self._far_evidence_revision = far_evidence.revision
        nodes = np.array(list(self._sums))
        now, cued = self._far_evidence_from(nodes)
        changed = np.abs(now - self.far_evidence_nat[nodes]).max(axis=1) > MIN_CHANGE_NAT
        changed |= (cued != self.cued[nodes]).any(axis=1)
        # The others stay as they were weighed last: what fades slowly adds up.
        self.far_evidence_nat[nodes[changed]] = now[changed]
        self.cued[nodes[changed]] = cued[changed]
        for node in nodes[changed]:
            self._choose(int(node))

    def _far_evidence_from(
        self, nodes: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """What images say of what each heading of some nodes shows: nat, and whether a cue."""
        if self._far_evidence is None:
            size = (len(nodes), self.far_evidence_nat.shape[1])
            return np.zeros(size, np.float32), np.zeros(size, np.bool_)
        assert self._orientations is not None, "follow() comes first"
        reach_m = self._reach[nodes][:, :: self._orientations.stride] * np.float32(self._voxel_m)
        where = (self._at[nodes], self._orientations.yaws, reach_m)
        return self._far_evidence.ahead(*where), self._far_evidence.cued(*where)

    def _choose(self, node: int) -> None:
        assert self._orientations is not None
        weights = self._unweighted
        if self._regions is not None:
            reach_m = self._reach[node][:: self._orientations.stride] * self._voxel_m
            weights = self._regions.ahead(self._at[node], self._orientations.yaws, reach_m)
        choice = choose_view(
            self._sums[node],
            self._probabilities,
            self.config.min_level_voxels,
            self.far_evidence_nat[node],
            self.cued[node],
            weights,
        )
        self.gain[node] = choice.gain
        self.potential[node] = choice.potential
        self.level[node] = choice.level
        self.yaw[node] = self._orientations.yaws[choice.heading]
        self.tilt[node] = self._orientations.tilts[choice.tilt]
        self.by_heading[node] = choice.by_heading

    def _camera_voxel(self, voxel_size: float, x: float, y: float) -> tuple[int, int, int]:
        return math.floor(x / voxel_size), math.floor(y / voxel_size), self._camera_layer

    def _half_fov_columns(self, table: ViewTable) -> int:
        return round(0.5 * self._robot.horizontal_fov_rad / table.bin_rad)

    def _prepare(self, arrays: MapArrays, floor_z_m: float) -> None:
        v, config, robot = arrays.voxel_size, self.config, self._robot
        camera = math.floor((floor_z_m + robot.camera_height_m) / v)
        band_low = math.ceil((floor_z_m + config.band_low_m) / v - 0.5)
        layers = (
            min(band_low, math.ceil((floor_z_m + config.object_low_m) / v - 0.5)),
            math.floor((floor_z_m + config.band_high_m) / v - 0.5),
        )
        if self._table is not None and (camera, layers) == (self._camera_layer, self._layers):
            return
        self._camera_layer, self._layers = camera, layers
        half = 0.5 * robot.vertical_fov_rad
        self._table = build_view_table(
            yaw_bins=config.yaw_bins,
            pitch_low=max(-0.5 * math.pi, robot.min_tilt_rad - half),
            pitch_high=min(0.5 * math.pi, robot.max_tilt_rad + half),
            range_voxels=robot.max_depth_m / v,
            layer_low=layers[0] - camera,
            layer_high=layers[1] - camera,
        )
        self._orientations = build_orientations(
            self._table, robot, config.heading_stride, config.tilts
        )
        self._rules = ViewRules(
            unknown_occupied=config.unknown_occupied,
            unknown_depth=config.unknown_depth_m / v,
            unknown_looks=float(config.unknown_looks),
            surface_looks=float(config.surface_looks),
            surface_range=config.surface_range_m / v,
            ooi_floor=config.ooi_floor,
            ooi_threshold=self._ooi_threshold,
            termination_range=config.termination_range_m / v,
            termination_depth=config.termination_depth_m / v,
            termination_fringe=_FRINGE * surface_scale(v),
            level_range=config.level_range_m / v,
            floor_layers=band_low - layers[0],
        )
        # The raster has changed: what was summed over the old one means nothing any more.
        self.evaluated[:] = -1
        self._sums.clear()
        self._labelled.clear()
