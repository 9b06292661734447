"""Configuration of the voxel map."""

import dataclasses
from dataclasses import dataclass
from typing import Final, Literal

from ippon.mapping.arrays import BLOCK_EDGE, BLOCK_VOLUME
from ippon.mapping.blocks import BYTES_PER_VOXEL

SURFACE_VOXELS_PER_BLOCK: Final = 64
"""Surface voxels per block, on average, that fit within the memory limit."""
BYTES_PER_SURFACE_VOXEL: Final = 92
_BYTES_PER_BLOCK: Final = (
    BLOCK_VOLUME * BYTES_PER_VOXEL + SURFACE_VOXELS_PER_BLOCK * BYTES_PER_SURFACE_VOXEL
)
MOST_MEMORY_MB: Final = 50_000.0
"""Of a map whose voxels are numbered by 32 bits."""

Fusion = Literal["places", "paper", "max"]


@dataclass(frozen=True, slots=True, kw_only=True)
class MapConfig:
    """How observations are fused into the map."""

    voxel_size_m: float = 0.1
    """Edge of a voxel; larger is faster and coarser."""
    truncation_voxels: float = 4.0
    """Distance before a surface, in voxels, up to which the signed distance is measured; larger
    smooths more."""
    behind_voxels: float = 2.0
    """The same behind a surface, in voxels; larger lets the two sides of thin walls disturb each
    other."""
    clear_voxels: float = 0.4
    """Least distance of a voxel's centre before the surface, in voxels, for the voxel to be seen
    free; larger clears less space close to surfaces."""
    endpoint_depth_voxels: float = 0.2
    """Depth under the surface, in voxels, at which endpoints are counted, so that a floor on the
    boundary of two voxels occupies one layer; larger moves surfaces back."""
    min_range_m: float = 0.1
    """Least depth that is used, metres."""
    max_range_m: float = 5.0
    """Largest depth that makes surface; farther readings clear free space up to here. Larger costs
    time."""
    max_valid_depth_m: float = 20.0
    """Readings above count as no return, such as a sensor's code of 65.535 m."""
    common_max_range_m: float = 5.0
    """Range within which images update the labels of common objects; larger includes less certain
    views."""
    ooi_max_range_m: float = 4.0
    """Range within which images update the object of interest; larger includes less certain
    views."""
    distance_max_m: float = 1.0
    """Cut-off of the distance to obstacles; computing time grows with its square."""
    fusion: Fusion = "places"
    """Rule for scores: "places" reads them by the network's observation model and averages images
    from one place; "paper" uses the paper's filter, which treats all images as independent
    (ablation); "max" keeps the highest probability seen (ablation). Heatmaps of probabilities use
    the paper's filter in "places" and "paper"."""
    likelihood_floor: float = 1.0 / 255.0
    """Least likelihood of a label in one image; smaller trusts single images more."""
    weight_max: int = 32
    """Cap on the weight of the running mean of the signed distance; larger is smoother and adapts
    more slowly."""
    hit_evidence: int = 2
    """Evidence for occupied that an image adds to a voxel with surface points; larger maps
    obstacles sooner."""
    miss_evidence: int = 1
    """Evidence for free that an image adds to a voxel that it sees through; larger clears space
    sooner."""
    max_evidence: int = 10
    """Upper bound of the evidence: a removed object vanishes after `max_evidence / miss_evidence +
    1` views."""
    min_evidence: int = -4
    """Lower bound of the evidence: a new object appears after `-min_evidence / hit_evidence + 1`
    views."""
    hit_share: float = 0.08
    """Share of a voxel's face that surface must cover for the voxel to be occupied; larger ignores
    thin objects."""
    body_height_m: float = 0.5
    """Height above the base of the voxel layer whose free area counts as explored floor."""
    max_camera_speed_m_s: float = 10.0
    """Speed of the camera above which a frame is refused as a pose jump, if it moved more than one
    metre."""
    memory_limit_mb: float = 1024.0
    """Limit of the map's memory, megabytes; at the limit the oldest distant blocks are dropped."""
    directory_max_cells: int = 16_000_000
    """Limit of the box of blocks that encloses the map; frames beyond it are refused."""

    def __post_init__(self) -> None:
        """Reject values from which no map can be built."""
        positive = (
            "voxel_size_m", "truncation_voxels", "behind_voxels", "max_range_m", "distance_max_m",
            "clear_voxels", "common_max_range_m", "ooi_max_range_m", "max_valid_depth_m",
            "max_camera_speed_m_s",
        )  # fmt: skip
        for name in positive:
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive; got {getattr(self, name)}")
        if not 0.0 <= self.endpoint_depth_voxels <= 1.0:
            raise ValueError(
                f"endpoint_depth_voxels lies in 0 to 1; got {self.endpoint_depth_voxels}"
            )
        if not 0.0 < self.min_range_m < self.max_range_m:
            raise ValueError(
                f"min_range_m must lie between 0 and max_range_m; got {self.min_range_m}"
            )
        if not 0.0 < self.likelihood_floor <= 0.1:
            raise ValueError(f"likelihood_floor must be in (0, 0.1]; got {self.likelihood_floor}")
        if not (1 <= self.weight_max <= 255 and 0.0 < self.hit_share < 1.0):
            raise ValueError("weight_max must be in 1 to 255 and hit_share in (0, 1)")
        if not (
            1 <= self.hit_evidence <= self.max_evidence <= 100
            and 1 <= self.miss_evidence <= -self.min_evidence <= 100
        ):
            raise ValueError(
                "evidence must satisfy 1 <= hit <= max <= 100 and 1 <= miss <= -min <= 100; got "
                f"{self.hit_evidence}, {self.max_evidence}, {self.miss_evidence}, "
                f"{self.min_evidence}"
            )
        if not 0.0 < self.memory_limit_mb <= MOST_MEMORY_MB:
            raise ValueError(
                f"memory_limit_mb lies in 0 to {MOST_MEMORY_MB:.0f}; got {self.memory_limit_mb}"
            )
        need = int(1.5 * (self.max_range_m / (BLOCK_EDGE * self.voxel_size_m) + 2.0) ** 3)
        if self.max_blocks < need:
            raise ValueError(
                f"memory_limit_mb {self.memory_limit_mb} holds {self.max_blocks} blocks, and one "
                f"view alone may need {need}; raise it, or use larger voxels or a shorter range"
            )

    @property
    def max_blocks(self) -> int:
        """Number of blocks that fit within the memory limit."""
        return int(self.memory_limit_mb * 1e6 / _BYTES_PER_BLOCK)

    def holding(self, blocks: int) -> "MapConfig":
        """Return this configuration, with a memory limit that holds so many blocks and more."""
        need_mb = min((blocks + 1) * _BYTES_PER_BLOCK / 1e6, MOST_MEMORY_MB)
        return dataclasses.replace(self, memory_limit_mb=max(self.memory_limit_mb, need_mb))
