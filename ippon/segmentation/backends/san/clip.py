"""CLIP in SAN: a tower that extracts features, and its last blocks, which classify masks."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from ippon.segmentation.backends.san.architecture import SanArchitecture

NOT_LOOKED_AT = -100.0
"""Attention bias between tokens that do not attend to each other."""


class ClipAttention(nn.Module):
    """Multi-head self-attention with a bias for each pair of tokens."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.in_proj_weight = nn.Parameter(torch.empty(3 * width, width))
        self.in_proj_bias = nn.Parameter(torch.empty(3 * width))
        self.out_proj = nn.Linear(width, width)

    def forward(self, x: Tensor, bias: Tensor | None) -> Tensor:
        """Return the attention output, (B, L, width).

        Args:
            x: (B, L, width).
            bias: Broadcast to (B, heads, L, L), added before the softmax; or None.
        """
        joined = functional.linear(x, self.in_proj_weight, self.in_proj_bias)
        q, k, v = joined.unflatten(-1, (3, self.heads, -1)).permute(2, 0, 3, 1, 4)
        attended = functional.scaled_dot_product_attention(q, k, v, attn_mask=bias)
        return self.out_proj(attended.transpose(1, 2).flatten(2))


class ClipMlp(nn.Module):
    """Feed-forward part of a block, with OpenAI's approximate GELU."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.c_fc = nn.Linear(width, 4 * width)
        self.c_proj = nn.Linear(4 * width, width)

    def forward(self, x: Tensor) -> Tensor:
        """Map (..., width) to (..., width)."""
        hidden = self.c_fc(x)
        return self.c_proj(hidden * torch.sigmoid(1.702 * hidden))


class ClipBlock(nn.Module):
    """A residual block of either tower of CLIP."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.ln_1 = nn.LayerNorm(width)
        self.attn = ClipAttention(width, heads)
        self.ln_2 = nn.LayerNorm(width)
        self.mlp = ClipMlp(width)

    def forward(self, x: Tensor, bias: Tensor | None = None) -> Tensor:
        """Map (B, L, width) to (B, L, width)."""
        x = x + self.attn(self.ln_1(x), bias)
        return x + self.mlp(self.ln_2(x))


class FeatureTower(nn.Module):
    """First blocks of CLIP's image tower; names are those of the checkpoint."""

    def __init__(self, architecture: SanArchitecture) -> None:
        super().__init__()
        a = architecture
        self.grid = a.clip_grid
        self.class_embedding = nn.Parameter(torch.empty(a.clip_width))
        self.positional_embedding = nn.Parameter(torch.empty(a.clip_grid**2 + 1, a.clip_width))
        self.conv1 = nn.Conv2d(3, a.clip_width, a.clip_patch_px, a.clip_patch_px, bias=False)
        self.ln_pre = nn.LayerNorm(a.clip_width)
        self.resblocks = nn.ModuleList(
            ClipBlock(a.clip_width, a.clip_heads) for _ in range(a.recognition_from)
        )

    def forward(self, image: Tensor) -> tuple[list[Tensor], tuple[int, int]]:
        """Return features after each block.

        Args:
            image: (B, 3, H, W), normalised.

        Returns:
            The tokens before the first block and after each, (B, 1 + h * w, width), the class
            token first; and the grid (h, w).
        """
        patches = self.conv1(image)
        h, w = int(patches.shape[2]), int(patches.shape[3])
        tokens = patches.flatten(2).transpose(1, 2)
        first = self.class_embedding.expand(tokens.shape[0], 1, -1)
        x = torch.cat([first, tokens], dim=1) + self._positions(h, w)
        outputs = [self.ln_pre(x)]
        for block in self.resblocks:
            outputs.append(block(outputs[-1]))
        return outputs, (h, w)

    def _positions(self, h: int, w: int) -> Tensor:
        if (h, w) == (self.grid, self.grid):
            return self.positional_embedding
        grid = resized_positions(self.positional_embedding[1:], self.grid, (h, w))
        return torch.cat([self.positional_embedding[:1], grid])


class MaskRecogniser(nn.Module):
    """Last blocks of CLIP's image tower: one embedding per proposed mask.

    Each query starts as the class token. It attends to the patches, biased by its mask, and to
    itself; other tokens do not attend to queries, so the patches are processed as in CLIP.
    """

    def __init__(self, architecture: SanArchitecture) -> None:
        super().__init__()
        a = architecture
        self.queries = a.queries
        self.resblocks = nn.ModuleList(
            ClipBlock(a.clip_width, a.clip_heads) for _ in range(a.clip_layers - a.recognition_from)
        )
        self.ln_post = nn.LayerNorm(a.clip_width)
        self.proj = nn.Parameter(torch.empty(a.clip_width, a.embedding_width))

    def forward(self, tokens: Tensor, attention: Tensor, grid: tuple[int, int]) -> Tensor:
        """Return the embeddings of the masks.

        Args:
            tokens: (B, 1 + h * w, width) of the tower's last block.
            attention: (B, heads, Q, H, W), attention bias of each mask for each patch.
            grid: (h, w).

        Returns:
            (B, Q, embedding width), of unit length.
        """
        bias = self._bias(attention, grid)
        x = torch.cat([tokens[:, :1].expand(-1, self.queries, -1), tokens], dim=1)
        for block in self.resblocks:
            x = block(x, bias)
        return functional.normalize(self.ln_post(x[:, : self.queries]) @ self.proj, dim=-1)

    def _bias(self, attention: Tensor, grid: tuple[int, int]) -> Tensor:
        """Return (B, heads, L, L) for queries, class token and patches, in this order."""
        q, patches = self.queries, grid[0] * grid[1]
        pooled = functional.adaptive_max_pool2d(attention.flatten(1, 2), grid)
        pooled = pooled.flatten(2).unflatten(1, attention.shape[1:3])
        length = q + 1 + patches
        bias = attention.new_zeros(length, length)
        bias[:, :q] = NOT_LOOKED_AT
        bias[:q, q] = NOT_LOOKED_AT
        # Not fill_diagonal_, which torch.compile refuses on a part of a tensor.
        bias[:q, :q] *= 1.0 - torch.eye(q, dtype=bias.dtype, device=bias.device)
        bias = bias.expand(*attention.shape[:2], -1, -1).clone()
        bias[:, :, :q, q + 1 :] = pooled
        return bias


def resized_positions(positions: Tensor, side: int, size: tuple[int, int]) -> Tensor:
    """Interpolate (side * side, width) positional embeddings to (h * w, width), bicubically."""
    grid = positions.unflatten(0, (side, side)).permute(2, 0, 1)[None]
    resized = functional.interpolate(grid, size=size, mode="bicubic", align_corners=False)
    return resized[0].flatten(1).T
