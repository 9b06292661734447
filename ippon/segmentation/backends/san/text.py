"""CLIP's text tower, and the mask classifier from label embeddings."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from ippon.segmentation.backends.san.architecture import SanArchitecture
from ippon.segmentation.backends.san.clip import ClipBlock


class TextTransformer(nn.Module):
    """Blocks of the text tower, under the checkpoint's name."""

    def __init__(self, width: int, heads: int, layers: int) -> None:
        super().__init__()
        self.resblocks = nn.ModuleList(ClipBlock(width, heads) for _ in range(layers))


class TextClassifier(nn.Module):
    """Text embeddings, and the learned embedding of 'none of these'."""

    attn_mask: Tensor

    def __init__(self, architecture: SanArchitecture) -> None:
        super().__init__()
        a = architecture
        self.token_embedding = nn.Embedding(a.text_vocabulary, a.text_width)
        self.positional_embedding = nn.Parameter(torch.empty(a.text_context, a.text_width))
        self.transformer = TextTransformer(a.text_width, a.text_heads, a.text_layers)
        self.ln_final = nn.LayerNorm(a.text_width)
        self.text_projection = nn.Parameter(torch.empty(a.text_width, a.embedding_width))
        self.logit_scale = nn.Parameter(torch.empty(()))
        self.bg_embed = nn.Parameter(torch.empty(1, a.embedding_width))
        causal = torch.full((a.text_context, a.text_context), float("-inf")).triu(1)
        self.register_buffer("attn_mask", causal)

    def embed(self, tokens: Tensor) -> Tensor:
        """Return text embeddings.

        Args:
            tokens: (N, context) int64, padded with zeros; the end token has the highest number.

        Returns:
            (N, embedding width), of unit length.
        """
        last = tokens.argmax(dim=-1)
        # Attention is causal, so padding after the longest text can be dropped.
        length = int(last.max()) + 1
        x = self.token_embedding(tokens[:, :length]) + self.positional_embedding[:length]
        for block in self.transformer.resblocks:
            x = block(x, self.attn_mask[:length, :length])
        x = self.ln_final(x)[torch.arange(len(tokens), device=tokens.device), last]
        return functional.normalize(x @ self.text_projection, dim=-1)

    def weights(self, embeddings: Tensor) -> Tensor:
        """Return (C + 1, embedding width) classifier weights of (C, embedding width) labels.

        The last row is 'none of these'. Inner products with mask embeddings are logits.
        """
        rows = functional.normalize(torch.cat([embeddings, self.bg_embed]), dim=-1)
        return self.logit_scale.exp() * rows
