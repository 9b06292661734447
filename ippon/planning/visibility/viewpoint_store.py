"""Gain, termination and orientation of every viewpoint, and the step of their last evaluation."""

import copy
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.guidance.levels import Level, LevelProbabilities
from ippon.mapping.arrays import MapArrays
from ippon.mapping.far_evidence.far_evidence import MIN_CHANGE_NAT
from ippon.mapping.far_evidence.joint_evidence import EvidenceAhead
from ippon.planning.visibility.panorama import cast_panorama
from ippon.planning.visibility.region_weights import RegionWeights, Stroke, WeightGrid
from ippon.planning.visibility.staleness import stale_kernel
from ippon.planning.visibility.view_config import ViewConfig
from ippon.planning.visibility.view_geometry import ViewGeometry, layers_at, ranges_for
from ippon.planning.visibility.view_memory import ViewMemory
from ippon.planning.visibility.view_table import in_frustum
from ippon.planning.visibility.viewpoint_gain import (
    ViewSums,
    choose_view,
    frame_object,
    recount_levels,
    sum_sectors,
    sum_views,
)
from ippon.robot import RobotProfile


class ViewpointStore:
    """Evaluations of the roadmap's nodes, one row per node."""

    def __init__(
        self, config: ViewConfig, robot: RobotProfile, capacity: int, ooi_threshold: float
    ) -> None:
        """Begin with no evaluation.

        Args:
            config: What a voxel counts.
            robot: Camera and its mount.
            capacity: Number of rows.
            ooi_threshold: p_T, above which a voxel is an object voxel.
        """
        self.config = config
        self._robot = robot
        self._ooi_threshold = ooi_threshold
        self.memory = ViewMemory(config.staleness, robot.max_depth_m)
        """Number of images of every voxel, and where the map has changed."""
        self._geometry: ViewGeometry | None = None
        headings = config.yaw_bins // config.heading_stride
        self.evaluated = np.full(capacity, -1, dtype=np.int64)
        """(capacity,) step of the last evaluation, -1 for never."""
        self.for_other_goal = np.zeros(capacity, dtype=np.bool_)
        """(capacity,) whether that was for the goal before: a stale one tells nothing of this."""
        self.gain = np.zeros(capacity, dtype=np.float32)
        """(capacity,) G(n), eq. (3), at the best orientation."""
        self.potential = np.zeros(capacity, dtype=np.float32)
        """(capacity,) highest gain of any orientation if p_img were that of the average level, and
        no room were weighed: whether anything is left to explore depends on neither."""
        self.termination = np.zeros(capacity, dtype=np.float32)
        """(capacity,) T(n), eq. (4)."""
        self.yaw = np.zeros(capacity)
        self.tilt = np.zeros(capacity)
        self.level = np.full(capacity, int(Level.AVERAGE), dtype=np.uint8)
        """(capacity,) `Level` that p_img was taken from."""
        self.by_heading = np.zeros((capacity, headings), dtype=np.float32)
        """(capacity, A) gain of each candidate heading at its best tilt."""
        self._reach = np.zeros((capacity, config.yaw_bins), dtype=np.float32)
        self._framing = np.full((capacity, 2), np.nan)
        self._at = np.zeros((capacity, 2))
        self._regions: RegionWeights | None = None
        self._weighed: tuple[tuple[Stroke, ...], bool] = (), False
        """The painted regions, and whether rooms count."""
        self._unweighted = np.ones(headings, dtype=np.float32)
        self._far_evidence: EvidenceAhead | None = None
        self._far_evidence_revision = 0
        self.far_evidence_nat = np.zeros((capacity, headings), dtype=np.float32)
        """(capacity, A) nat, log-likelihood ratio of the object ahead, from far evidence."""
        self.cued = np.zeros((capacity, headings), dtype=np.bool_)
        """(capacity, A) headings that look at far evidence of a label that is certainly near the
        object."""
        self._sums: dict[int, ViewSums] = {}
        self._labelled: dict[int, NDArray[np.int32]] = {}
        self._probabilities = LevelProbabilities().as_array()

    @property
    def geometry(self) -> ViewGeometry:
        """Directions and ranges of a view from the present floor; needs an `update` first."""
        assert self._geometry is not None, "update() comes first: the voxel size is the map's"
        return self._geometry

    def update(
        self,
        arrays: MapArrays,
        floor_z_m: float,
        T_world_base: Float64Array,
        tilt_rad: float,
        standing_at: Float64Array | None = None,
        *,
        termination_min: float = 0.0,
    ) -> None:
        """Take over the map's changes, and count the image that was taken from here.

        Args:
            arrays: The map, with that image in it.
            floor_z_m: Height of the floor, metres.
            T_world_base: Pose of the robot.
            tilt_rad: Tilt of its camera.
            standing_at: (2,) position of the viewpoint that the robot has reached, None for none.
                The robot stands beside it, where it may see other voxels; those seen from the
                viewpoint itself count as observed, too, so that its gain falls.
            termination_min: T_min.
        """
        self._update_geometry(arrays, floor_z_m, termination_min)
        geometry = self.geometry
        self.memory.update(arrays, geometry.layers, geometry.rules)
        self._update_far_evidence()
        T_world_camera = T_world_base @ self._robot.T_base_camera(tilt_rad)
        ahead = T_world_camera[:3, 2]
        shown = in_frustum(
            geometry.table.rays,
            self._robot,
            math.atan2(T_world_base[1, 0], T_world_base[0, 0]),
            math.asin(max(-1.0, min(1.0, float(ahead[2])))),
            self.config.image_fraction,
        )
        places = [T_world_camera[:2, 3]] + ([] if standing_at is None else [standing_at])
        for voxel in dict.fromkeys(geometry.camera_voxel(place) for place in places):
            self.memory.record(arrays, geometry.table, geometry.rules, voxel, shown)

    def evaluate(self, node: int, xy: Float64Array, arrays: MapArrays) -> None:
        """Cast the panorama of a node at `xy` (2,) and choose its orientation."""
        geometry = self.geometry
        table, orientations = geometry.table, geometry.orientations
        camera = geometry.camera_voxel(xy)
        panorama = cast_panorama(arrays, table, geometry.rules, self.memory.field, camera)
        sums = sum_views(panorama, orientations, geometry.half_fov_columns)
        self._sums[node] = sums
        self._labelled[node] = panorama.labelled
        self._reach[node] = np.abs(panorama.depth).max(axis=0)
        self.termination[node] = panorama.termination
        yaw, tilt = self._framing[node]
        framing = frame_object(
            sums,
            panorama,
            orientations,
            table,
            None if math.isnan(yaw) else (float(yaw), float(tilt)),
            hold=self.config.framing_hold,
            centre_weight=self.config.framing_centre_weight,
        )
        self._framing[node] = framing if framing is not None else (math.nan, math.nan)
        self.evaluated[node] = self.memory.step
        self.for_other_goal[node] = False
        self._at[node] = xy
        far_evidence_nat, cued = self._far_evidence_from(np.array([node]))
        self.far_evidence_nat[node], self.cued[node] = far_evidence_nat[0], cued[0]
        self._choose(node)

    def begin_goal(self, arrays: MapArrays) -> None:
        """See `ViewMemory.begin_goal`; gains stay until they are evaluated."""
        self.memory.begin_goal(arrays, self.geometry.layers)
        self.for_other_goal[:] = self.evaluated >= 0

    def set_probabilities(self, probabilities: NDArray[np.float32]) -> None:
        """Recompute every gain with other (4,) level probabilities; casts no ray."""
        self._probabilities = np.asarray(probabilities, dtype=np.float32)
        self._choose_all()

    def set_regions(self, strokes: Sequence[Stroke], rooms: WeightGrid | None = None) -> bool:
        """Recompute every gain with other painted regions and weights of rooms; casts no ray.

        Returns:
            Whether other regions are painted, or rooms begin or cease to count. Rooms are inferred
            every few seconds, mostly as they were.
        """
        before, self._weighed = self._weighed, (tuple(strokes), rooms is not None)
        if not strokes and rooms is None:
            self._regions = None
        elif self._regions is not None and self._weighed[0] == before[0]:
            self._regions = self._regions.with_rooms(rooms)
        else:
            self._regions = RegionWeights(self.config.regions, strokes, rooms)
        self._choose_all()
        return self._weighed != before

    def set_far_evidence(self, far_evidence: EvidenceAhead | None) -> None:
        """Weigh gains by evidence from beyond the map's range from now on; None for none.

        It is that of another goal: viewpoints that showed the object before are evaluated again,
        and end no search until then.
        """
        terminating = self.termination > 0.0
        self.termination[terminating] = 0.0
        self.evaluated[terminating] = -1
        self._far_evidence, self._far_evidence_revision = far_evidence, 0
        self.far_evidence_nat[:] = 0.0
        self.cued[:] = False
        self._choose_all()

    def copy(self) -> "ViewpointStore":
        """Return a store whose gains can be recomputed; it shares what was observed."""
        twin = copy.copy(self)
        for name in ("gain", "potential", "termination", "yaw", "tilt", "level", "by_heading"):
            setattr(twin, name, getattr(self, name).copy())
        twin._sums = dict(self._sums)  # noqa: SLF001
        return twin

    def recount_levels(self, arrays: MapArrays) -> None:
        """Recompute every gain with the levels that the map has now; casts no ray."""
        for node, sums in self._sums.items():
            geometry = self.geometry
            camera = geometry.camera_voxel(self._at[node])
            levels = recount_levels(arrays, geometry.table, camera, self._labelled[node])
            self._sums[node] = sums._replace(
                levels=sum_sectors(levels, geometry.orientations, geometry.half_fov_columns)
            )
            self._choose(node)

    def forget(self, node: int) -> None:
        """Clear the row of a removed node."""
        self.evaluated[node] = -1
        self.for_other_goal[node] = False
        self.gain[node] = self.potential[node] = self.termination[node] = 0.0
        self.by_heading[node] = 0.0
        self._framing[node] = math.nan
        self._sums.pop(node, None)
        self._labelled.pop(node, None)

    def stale(
        self, nodes: NDArray[np.int64], xy: Float64Array, voxel_size: float
    ) -> NDArray[np.bool_]:
        """Return which nodes were never evaluated, or saw space that has changed since.

        Args:
            nodes: (N,) rows.
            xy: (capacity, 2) positions of all nodes, metres.
            voxel_size: Edge of a voxel in metres.
        """
        out = np.zeros(len(nodes), dtype=np.bool_)
        stale_kernel(
            nodes,
            xy / voxel_size,
            self.evaluated,
            self._reach,
            self.memory.changed,
            self.memory.field.origin,
            self.geometry.table.range_voxels,
            out,
        )
        return out

    def framing(self, node: int) -> tuple[float, float]:
        """Return yaw and tilt that show the most object voxels, or else the highest gain."""
        yaw, tilt = self._framing[node]
        if math.isnan(yaw):
            return float(self.yaw[node]), float(self.tilt[node])
        return float(yaw), float(tilt)

    def far_evidence_at(self, node: int) -> tuple[float, bool]:
        """Return the far evidence in a viewpoint's view: nat, and whether it is a cue."""
        yaws = self.geometry.orientations.yaws
        heading = int(np.argmin(np.abs(yaws - self.yaw[node])))
        return float(self.far_evidence_nat[node, heading]), bool(self.cued[node, heading])

    def _update_geometry(self, arrays: MapArrays, floor_z_m: float, termination_min: float) -> None:
        voxel_size, old = arrays.voxel_size, self._geometry
        layers = layers_at(self.config, self._robot, voxel_size, floor_z_m)
        ranges = ranges_for(self.config, voxel_size, termination_min, arrays.ooi_clear_m)
        if old is not None and layers.same_raster(old.layers) and ranges == old.ranges:
            return
        self._geometry = ViewGeometry.build(
            self.config, self._robot, voxel_size, layers, ranges, self._ooi_threshold
        )
        # Sums over another raster cannot be used with this one.
        self.evaluated[:] = -1
        self._sums.clear()
        self._labelled.clear()

    def _update_far_evidence(self) -> None:
        """Recompute the gain of viewpoints that look at far evidence which has changed."""
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
        # The others keep the value of their last update, so that small changes add up.
        self.far_evidence_nat[nodes[changed]] = now[changed]
        self.cued[nodes[changed]] = cued[changed]
        for node in nodes[changed]:
            self._choose(int(node))

    def _far_evidence_from(
        self, nodes: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Return nat and cue of each heading of (N,) nodes, both (N, A)."""
        if self._far_evidence is None:
            size = (len(nodes), self.far_evidence_nat.shape[1])
            return np.zeros(size, np.float32), np.zeros(size, np.bool_)
        orientations = self.geometry.orientations
        voxel_m = np.float32(self.geometry.voxel_size)
        reach_m = self._reach[nodes][:, :: orientations.stride] * voxel_m
        where = (self._at[nodes], orientations.yaws, reach_m)
        return self._far_evidence.ahead(*where), self._far_evidence.cued(*where)

    def _choose_all(self) -> None:
        for node in self._sums:
            self._choose(node)

    def _choose(self, node: int) -> None:
        orientations = self.geometry.orientations
        weights = painted = self._unweighted
        if self._regions is not None:
            reach_m = self._reach[node][:: orientations.stride] * self.geometry.voxel_size
            weights, painted = self._regions.ahead(self._at[node], orientations.yaws, reach_m)
        choice = choose_view(
            self._sums[node],
            self._probabilities,
            self.config.min_level_voxels,
            self.far_evidence_nat[node],
            self.cued[node],
            weights,
            painted,
        )
        self.gain[node] = choice.gain
        self.potential[node] = choice.potential
        self.level[node] = choice.level
        self.yaw[node] = orientations.yaws[choice.heading]
        self.tilt[node] = orientations.tilts[choice.tilt]
        self.by_heading[node] = choice.by_heading
