"""The side adapter: a small vision transformer that proposes masks from CLIP's features."""

from collections.abc import Sequence
from itertools import pairwise
from typing import cast

import torch
from torch import Tensor, nn
from torch.nn import functional

from ippon.segmentation.backends.san.architecture import SanArchitecture
from ippon.segmentation.backends.san.clip import resized_positions


class SideAttention(nn.Module):
    """Multi-head self-attention."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.qkv = nn.Linear(width, 3 * width)
        self.proj = nn.Linear(width, width)

    def forward(self, x: Tensor) -> Tensor:
        """Map (B, L, width) to (B, L, width)."""
        q, k, v = self.qkv(x).unflatten(-1, (3, self.heads, -1)).permute(2, 0, 3, 1, 4)
        attended = functional.scaled_dot_product_attention(q, k, v)
        return self.proj(attended.transpose(1, 2).flatten(2))


class SideMlp(nn.Module):
    """The feed-forward part of a block."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.fc1 = nn.Linear(width, 4 * width)
        self.fc2 = nn.Linear(4 * width, width)

    def forward(self, x: Tensor) -> Tensor:
        """Map (..., width) to (..., width)."""
        return self.fc2(functional.gelu(self.fc1(x)))


class SideBlock(nn.Module):
    """One residual block of the side adapter."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.norm1 = nn.LayerNorm(width, eps=1e-6)
        self.attn = SideAttention(width, heads)
        self.norm2 = nn.LayerNorm(width, eps=1e-6)
        self.mlp = SideMlp(width)

    def forward(self, x: Tensor) -> Tensor:
        """Map (B, L, width) to (B, L, width)."""
        x = x + self.attn(self.norm1(x))
        return x + self.mlp(self.norm2(x))


class PatchEmbedding(nn.Module):
    """Patch embedding, under the checkpoint's name for it."""

    def __init__(self, patch_px: int, width: int) -> None:
        super().__init__()
        self.proj = nn.Conv2d(3, width, patch_px, patch_px)


class SideTransformer(nn.Module):
    """Weights of the small vision transformer; `SideAdapter` runs its blocks."""

    def __init__(self, architecture: SanArchitecture) -> None:
        super().__init__()
        a = architecture
        self.pos_embed = nn.Parameter(torch.empty(1, a.side_grid**2, a.side_width))
        self.patch_embed = PatchEmbedding(a.side_patch_px, a.side_width)
        self.blocks = nn.ModuleList(
            SideBlock(a.side_width, a.side_heads) for _ in range(a.side_layers)
        )


class ChannelNorm(nn.Module):
    """Normalisation of (B, C, H, W) over the channels."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.empty(channels))
        self.bias = nn.Parameter(torch.empty(channels))

    def forward(self, x: Tensor) -> Tensor:
        """Normalise, scale and shift."""
        last = functional.layer_norm(
            x.permute(0, 2, 3, 1), self.weight.shape, self.weight, self.bias, eps=1e-6
        )
        return last.permute(0, 3, 1, 2)


class Fusion(nn.Module):
    """Addition of CLIP's features to the patches of the side adapter."""

    def __init__(self, clip_width: int, side_width: int) -> None:
        super().__init__()
        self.input_proj = nn.Sequential(
            ChannelNorm(clip_width), nn.Conv2d(clip_width, side_width, kernel_size=1)
        )

    def forward(
        self, tokens: Tensor, clip_grid: tuple[int, int], side_grid: tuple[int, int]
    ) -> Tensor:
        """Map (B, 1 + h * w, clip width) to (B, H * W, side width), without the class token."""
        features = tokens[:, 1:].transpose(1, 2).unflatten(2, clip_grid)
        projected = functional.interpolate(
            self.input_proj(features), size=side_grid, mode="bilinear", align_corners=False
        )
        return projected.flatten(2).transpose(1, 2)


class Perceptron(nn.Module):
    """Layers with ReLU between them: linear on tokens, 1x1 convolutions on images."""

    def __init__(self, widths: Sequence[int], *, image: bool) -> None:
        super().__init__()
        pairs = pairwise(widths)
        self.layers = nn.ModuleList(
            nn.Conv2d(a, b, kernel_size=1) if image else nn.Linear(a, b) for a, b in pairs
        )

    def forward(self, x: Tensor) -> Tensor:
        """Apply the layers."""
        for layer in self.layers[:-1]:
            x = functional.relu(layer(x))
        return self.layers[-1](x)


class MaskDecoder(nn.Module):
    """Masks and attention biases as inner products of queries and patches."""

    def __init__(self, architecture: SanArchitecture) -> None:
        super().__init__()
        a = architecture
        self.heads = a.clip_heads
        hidden = (a.side_width, a.mask_width, a.mask_width)
        self.query_mlp = Perceptron((*hidden, a.mask_width), image=False)
        self.pix_mlp = Perceptron((*hidden, a.mask_width), image=True)
        self.attn_mlp = Perceptron((*hidden, a.mask_width * a.clip_heads), image=True)
        self.bias_scaling = nn.Linear(1, 1)

    def forward(self, queries: Tensor, patches: Tensor) -> tuple[Tensor, Tensor]:
        """Decode (B, Q, width) queries and (B, width, H, W) patches.

        Returns:
            Mask logits (B, Q, H, W); attention biases (B, heads, Q, H, W).
        """
        query = self.query_mlp(queries)
        masks = torch.einsum("bqc,bchw->bqhw", query, self.pix_mlp(patches))
        keys = self.attn_mlp(patches).unflatten(1, (self.heads, -1))
        bias = torch.einsum("bqc,bnchw->bnqhw", query, keys)
        return masks, bias * self.bias_scaling.weight[0, 0] + self.bias_scaling.bias[0]


class SideAdapter(nn.Module):
    """Side adapter network, with features from CLIP's tower."""

    def __init__(self, architecture: SanArchitecture) -> None:
        super().__init__()
        a = architecture
        self.queries = a.queries
        self.grid = a.side_grid
        self.fusion = a.fusion
        self.query_embed = nn.Parameter(torch.empty(1, a.queries, a.side_width))
        self.query_pos_embed = nn.Parameter(torch.empty(1, a.queries, a.side_width))
        self.vit_model = SideTransformer(a)
        self.fusion_layers = nn.ModuleDict(
            {f"layer_{k}": Fusion(a.clip_width, a.side_width) for k in range(len(a.fusion))}
        )
        self.mask_decoder = MaskDecoder(a)

    def forward(
        self, image: Tensor, features: list[Tensor], clip_grid: tuple[int, int]
    ) -> tuple[Tensor, Tensor]:
        """Return proposed masks.

        Args:
            image: (B, 3, H, W), normalised.
            features: CLIP's tokens, as from `FeatureTower`.
            clip_grid: Their grid.

        Returns:
            Mask logits (B, Q, H / patch, W / patch); attention biases (B, heads, Q, same).
        """
        patches = self.vit_model.patch_embed.proj(image)
        grid = (int(patches.shape[2]), int(patches.shape[3]))
        positions = torch.cat([self.query_pos_embed, self._positions(*grid)], dim=1)
        queries = self.query_embed.expand(image.shape[0], -1, -1)
        x = torch.cat([queries, patches.flatten(2).transpose(1, 2)], dim=1) + positions
        x = self._fuse(0, x, features, clip_grid, grid)
        for k, block in enumerate(self.vit_model.blocks, start=1):
            x = self._fuse(k, block(x), features, clip_grid, grid)
            if k < len(self.vit_model.blocks):
                x = x + positions
        last = x[:, self.queries :].transpose(1, 2).unflatten(2, grid)
        return self.mask_decoder(x[:, : self.queries], last)

    def _positions(self, h: int, w: int) -> Tensor:
        positions = self.vit_model.pos_embed
        if (h, w) == (self.grid, self.grid):
            return positions
        return resized_positions(positions[0], self.grid, (h, w))[None]

    def _fuse(
        self,
        k: int,
        x: Tensor,
        features: list[Tensor],
        clip_grid: tuple[int, int],
        grid: tuple[int, int],
    ) -> Tensor:
        if k >= len(self.fusion):
            return x
        layer = cast("Fusion", self.fusion_layers[f"layer_{k}"])
        added = layer(features[self.fusion[k]], clip_grid, grid)
        return torch.cat([x[:, : self.queries], x[:, self.queries :] + added], dim=1)
