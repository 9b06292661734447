"""Architectures of the released SAN models."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True, kw_only=True)
class SanArchitecture:
    """Sizes that determine the shape of every weight of a SAN."""

    clip_layers: int
    """Blocks of CLIP's image tower, those that recognise the masks included."""
    clip_width: int
    clip_heads: int
    clip_patch_px: int
    clip_image_px: int
    """Side of CLIP's training images; determines its positional embedding."""
    clip_scale: float
    """Scale of CLIP's input relative to the side adapter's."""
    recognition_from: int
    """First block that classifies masks instead of extracting features."""
    embedding_width: int
    """Length of the embeddings that images and texts share."""
    text_layers: int
    text_width: int
    text_heads: int
    text_vocabulary: int = 49408
    text_context: int = 77
    side_layers: int = 8
    side_width: int = 240
    side_heads: int = 6
    side_patch_px: int = 16
    side_image_px: int = 640
    fusion: tuple[int, ...]
    """CLIP blocks whose output is added before block 0, 1, 2 ... of the side adapter."""
    queries: int = 100
    mask_width: int = 256

    @property
    def clip_grid(self) -> int:
        """Patches along one side of CLIP's training images."""
        return self.clip_image_px // self.clip_patch_px

    @property
    def side_grid(self) -> int:
        """Patches along one side of the side adapter's training images."""
        return self.side_image_px // self.side_patch_px


SIZE_MULTIPLE_PX: Final = 32
"""Sides of input images are multiples of this."""

RELEASED: Final = {
    "san_vit_b_16": SanArchitecture(
        clip_layers=12,
        clip_width=768,
        clip_heads=12,
        clip_patch_px=16,
        clip_image_px=224,
        clip_scale=0.5,
        recognition_from=9,
        embedding_width=512,
        text_layers=12,
        text_width=512,
        text_heads=8,
        fusion=(0, 3, 6, 9),
    ),
    "san_vit_large_14": SanArchitecture(
        clip_layers=24,
        clip_width=1024,
        clip_heads=16,
        clip_patch_px=14,
        clip_image_px=336,
        clip_scale=0.7,
        recognition_from=18,
        embedding_width=768,
        text_layers=12,
        text_width=768,
        text_heads=12,
        fusion=(0, 6, 12, 18),
    ),
}
"""The released models, by the names of their files."""
