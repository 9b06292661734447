"""How observations become a map."""

from dataclasses import dataclass
from typing import Final, Literal

from ippon.mapping.arrays import BLOCK_EDGE, BLOCK_VOLUME
from ippon.mapping.blocks import BYTES_PER_VOXEL

SURFACE_ROWS_PER_BLOCK: Final = 64
"""Surface voxels that the map's bound allows for each block, on average."""
BYTES_PER_SURFACE_ROW: Final = 76


Fusion = Literal["places", "paper", "max"]


@dataclass(frozen=True, slots=True, kw_only=True)
class MapConfig:
    """How observations become a map."""

    voxel_size_m: float = 0.1
    """Edge of a voxel; larger is faster and coarser."""
    truncation_voxels: float = 4.0
    """Band before a surface in which the signed distance is graded, in voxels."""
    behind_voxels: float = 2.0
    """Band behind a surface in which it is; wider lets thin walls' two sides disturb each other."""
    min_range_m: float = 0.1
    """Nearer depth is not used."""
    max_range_m: float = 5.0
    """Farther depth is used to see free space up to here, but makes no surface."""
    max_valid_depth_m: float = 20.0
    """Readings above are a sensor's code for nothing, such as 65.535 m."""
    common_max_range_m: float = 5.0
    """Surface farther away learns nothing about common objects."""
    ooi_max_range_m: float = 4.0
    """Surface farther away learns nothing about the object of interest, which takes a closer
    look."""
    distance_max_m: float = 1.0
    """Distances to obstacles are cut off here; larger costs time with its square."""
    fusion: Fusion = "places"
    """"places": scores of a detector by its observation model, images from one place as one
    witness; heatmaps by the paper's filter. "paper": the paper's filter, for which all images are
    independent, for both (ablation). "max": keep the highest probability seen (ablation)."""
    likelihood_floor: float = 1.0 / 255.0
    """No single image makes a label less likely than this; smaller trusts images more."""
    weight_max: int = 32
    """Observations that the signed distance remembers; larger is smoother and slower to change."""
    hit_evidence: int = 2
    """Evidence for occupied that an image's hits add to a voxel."""
    miss_evidence: int = 1
    """Evidence for free that an image adds to a voxel it sees through."""
    max_evidence: int = 10
    """A removed object vanishes after `max_evidence / miss_evidence + 1` views of free space."""
    min_evidence: int = -4
    """A placed object appears after `-min_evidence / hit_evidence + 1` views."""
    hit_share: float = 0.08
    """Share of a voxel's face that must be covered by surface for the voxel to be occupied."""
    body_height_m: float = 0.5
    """Height above the base at which floor area counts as explored when it is free."""
    max_camera_speed_m_s: float = 10.0
    """A frame whose camera would have moved faster, beyond a metre, is refused as a pose jump."""
    memory_limit_mb: float = 1024.0
    """Bound on the map's memory; beyond it the oldest far blocks are dropped."""
    directory_max_cells: int = 16_000_000
    """Bound on the box of blocks that holds the map; frames that would need more are refused."""

    def __post_init__(self) -> None:
        """Reject values that no map can be made with."""
        positive = (
            "voxel_size_m", "truncation_voxels", "behind_voxels", "max_range_m", "distance_max_m",
            "common_max_range_m", "ooi_max_range_m", "max_valid_depth_m", "max_camera_speed_m_s",
        )  # fmt: skip
        for name in positive:
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive; got {getattr(self, name)}")
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
        need = int(1.5 * (self.max_range_m / (BLOCK_EDGE * self.voxel_size_m) + 2.0) ** 3)
        if self.max_blocks < need:
            raise ValueError(
                f"memory_limit_mb {self.memory_limit_mb} holds {self.max_blocks} blocks, and one "
                f"view alone may need {need}; raise it, or use larger voxels or a shorter range"
            )

    @property
    def max_blocks(self) -> int:
        """Blocks that fit in the memory limit."""
        per_block = BLOCK_VOLUME * BYTES_PER_VOXEL + SURFACE_ROWS_PER_BLOCK * BYTES_PER_SURFACE_ROW
        return int(self.memory_limit_mb * 1e6 / per_block)
