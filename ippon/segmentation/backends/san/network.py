"""The SAN network: image and classifier weights in, masks and class logits out."""

from torch import Tensor, nn
from torch.nn import functional

from ippon.segmentation.backends.san.architecture import SanArchitecture
from ippon.segmentation.backends.san.clip import FeatureTower, MaskRecogniser
from ippon.segmentation.backends.san.side_adapter import SideAdapter
from ippon.segmentation.backends.san.text import TextClassifier

PIXEL_MEAN = (0.48145466, 0.4578275, 0.40821073)
PIXEL_STD = (0.26862954, 0.26130258, 0.27577711)
"""Mean and standard deviation of CLIP's training images, RGB in 0 to 1."""


class SanNetwork(nn.Module):
    """SAN (Xu et al., CVPR 2023, https://arxiv.org/abs/2302.12242).

    Modules and weights bear the names of the released checkpoints.
    """

    def __init__(self, architecture: SanArchitecture) -> None:
        super().__init__()
        self.architecture = architecture
        self.side_adapter_network = SideAdapter(architecture)
        self.clip_visual_extractor = FeatureTower(architecture)
        self.clip_rec_head = MaskRecogniser(architecture)
        self.ov_classifier = TextClassifier(architecture)

    def forward(self, image: Tensor, weights: Tensor) -> tuple[Tensor, Tensor]:
        """Return masks and the logit of each label for each mask.

        Args:
            image: (B, 3, H, W), `normalised` and padded to sides of `SIZE_MULTIPLE_PX`.
            weights: (C + 1, embedding width) from `TextClassifier.weights`.

        Returns:
            Class logits (B, Q, C + 1), the last column 'none of these'; mask logits
            (B, Q, H / 16, W / 16).
        """
        reduced = functional.interpolate(
            image, scale_factor=self.architecture.clip_scale, mode="bilinear", align_corners=False
        )
        features, grid = self.clip_visual_extractor(reduced)
        masks, attention = self.side_adapter_network(image, features, grid)
        embeddings = self.clip_rec_head(features[-1], attention, grid)
        return embeddings @ weights.T, masks


def normalised(image: Tensor) -> Tensor:
    """Normalise (B, 3, H, W) RGB in 0 to 255 to the statistics of the training images."""
    mean = image.new_tensor(PIXEL_MEAN).view(3, 1, 1)
    std = image.new_tensor(PIXEL_STD).view(3, 1, 1)
    return (image / 255.0 - mean) / std
