"""Parameters of a view: what a voxel counts, and how finely directions are sampled."""

import math
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True, kw_only=True)
class StalenessConfig:
    """Changes of a block of 8 x 8 x 8 voxels after which viewpoints that see it are stale.

    Counts of voxels within the layers that a view covers. Larger values evaluate less often and
    leave gains out of date for longer.
    """

    unknown_voxels: float = 24.0
    """Change in the number of unknown voxels."""
    occupied_voxels: float = 8.0
    """Change in the number of occupied voxels."""
    unlabelled_voxels: float = 4.0
    """Change in the number of occupied voxels without a label."""
    object_voxels: float = 0.7
    """Change in the sum of p(v in O); below 1 so that one object voxel suffices."""

    def __post_init__(self) -> None:
        """Reject thresholds that every block exceeds."""
        if (
            min(
                self.unknown_voxels,
                self.occupied_voxels,
                self.unlabelled_voxels,
                self.object_voxels,
            )
            <= 0.0
        ):
            raise ValueError(
                "thresholds of staleness must be above 0; got "
                f"{self.unknown_voxels}, {self.occupied_voxels}, {self.unlabelled_voxels}, "
                f"{self.object_voxels}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class RegionConfig:
    """Weights of the floor regions that the operator painted."""

    preferred_weight: float = 6.0
    """Factor on the gain of a view that covers only preferred floor; more outweighs larger
    differences in level."""
    avoided_weight: float = 0.02
    """Factor on the gain of a view that covers only avoided floor; more lets the robot look there
    once little else is left."""

    def __post_init__(self) -> None:
        """Reject weights that would turn a preference into its opposite."""
        if not 0.0 < self.avoided_weight <= 1.0 <= self.preferred_weight < math.inf:
            raise ValueError(
                "avoided_weight must lie in (0, 1] and preferred_weight be finite and at least 1; "
                f"got {self.avoided_weight}, {self.preferred_weight}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewConfig:
    """What a voxel counts in a view, and how finely directions are sampled."""

    unknown_occupied: float = 0.1
    """p_occ of an unknown voxel; more raises the gain of unknown space against that of known
    surfaces."""
    unknown_depth_m: float = 5.0
    """Distance that a ray travels through unknown space, equal to the camera's range; less makes
    corners of known rooms as attractive as rooms that were not entered (docs/decisions.md)."""
    unknown_views: int = 8
    """Images of an unknown voxel after which it has no gain; more returns longer to glass and dark
    holes."""
    surface_views: int = 40
    """Images of a surface voxel after which it has no gain, whatever its probability; more looks
    longer at what resembles the object."""
    surface_range_m: float = 3.5
    """Range within which surfaces have a gain: a little less than the range up to which the map
    updates object probabilities. More counts views that change no probability."""
    ooi_floor: float = 0.05
    """p(v in O) up to which a voxel is background; less lets thousands of wall voxels at one
    percent outweigh an unexplored room."""
    band_low_m: float = 0.1
    """Height above the floor from which all voxels count; more ignores low surfaces."""
    object_low_m: float = -0.05
    """Height above the floor from which object voxels count; less finds objects that lie flat on
    the floor."""
    band_high_m: float = 2.0
    """Height above the floor up to which voxels count; more looks for objects on the ceiling."""
    termination_range_m: float = 0.95
    """Horizontal range of N_T, a little less than the metre of the task: the robot need not stop
    exactly on the viewpoint. More ends searches farther from the object."""
    large_termination_range_m: float = 0.8
    """The same for objects with T_min above `termination_fringe_voxels`, a voxel and the stopping
    tolerance less than the metre: the nearest voxels often belong to something beside the object.
    More ends more searches too far from it."""
    termination_depth_m: float = 0.7
    """Range beyond `termination_range_m` in which further voxels of the object count: of a bed too
    few voxels lie within a metre. More stops earlier; 0 is the paper's T(n)."""
    termination_depth_factor: float = 3.0
    """Voxels beyond `termination_range_m` count up to this many times those within it; more lets a
    smaller part of the object within reach end the search."""
    termination_depth_angle_rad: float = 0.2
    """Voxels beyond `termination_range_m` count if their heading differs by at most this from that
    of an object voxel within it; more joins separate objects."""
    termination_fringe_voxels: float = 5.0
    """Object voxels within `termination_range_m`, at 10 cm voxel size, that may be misclassified
    surroundings: only those above this number make voxels beyond it count. More demands more of
    the object within reach."""
    level_range_m: float = 5.0
    """Range within which labelled voxels decide the level of p_img; more lets distant objects
    decide (docs/decisions.md)."""
    min_level_voxels: int = 5
    """Voxels below which a level counts as empty; more ignores more misclassified voxels."""
    yaw_bins: int = 160
    """Directions around the horizon; more resolves smaller gaps and takes longer."""
    heading_stride: int = 4
    """Directions from one candidate heading to the next; more chooses among fewer headings."""
    tilts: int = 7
    """Candidate tilts between the camera's limits; more takes longer."""
    framing_hold: float = 0.05
    """Fraction of the object's voxels that another framing must show in addition to replace the
    present one; more turns the camera less often."""
    framing_centre_weight: float = 0.01
    """Fraction of the object's voxels per radian that framing gives up to centre the object; more
    centres it better and cuts off more of it."""
    image_fraction: float = 0.97
    """Part of the image, from its centre, that counts as observed: registration may cut off the
    border. More counts border voxels as observed that the camera did not measure."""
    staleness: StalenessConfig = field(default_factory=StalenessConfig)
    regions: RegionConfig = field(default_factory=RegionConfig)

    def __post_init__(self) -> None:
        """Reject rasters, ranges and probabilities that cannot work."""
        stride = self.heading_stride
        if stride < 1 or self.yaw_bins % stride or self.yaw_bins < 16 or self.tilts < 2:
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
        if not 0.0 < self.image_fraction <= 1.0:
            raise ValueError(f"image_fraction must lie in (0, 1]; got {self.image_fraction}")
        positive = (
            self.termination_depth_factor,
            self.termination_depth_angle_rad,
            self.termination_fringe_voxels,
            self.framing_hold,
            self.framing_centre_weight,
        )
        if min(positive) < 0.0:
            raise ValueError(
                "termination_depth_factor, termination_depth_angle_rad, termination_fringe_voxels, "
                "framing_hold and framing_centre_weight must be at least 0; got "
                f"{', '.join(map(str, positive))}"
            )
