"""Tiny models with random weights, saved as `transformers` saves the published ones."""

from pathlib import Path

import torch
import transformers

from ippon.segmentation.backends.san.tokenizer import _byte_symbols

WORDS = ("wall", "chest", "of", "drawers", "coffee", "table", "cup", "tv", "lamp", "television")
"""Words that the tiny BERT tokenizer knows."""
CLIP_TEXT = {
    "hidden_size": 16,
    "intermediate_size": 32,
    "num_hidden_layers": 2,
    "num_attention_heads": 2,
    "vocab_size": 514,
    "max_position_embeddings": 40,
    "bos_token_id": 512,
    "eos_token_id": 513,
    "pad_token_id": 0,
}


def shake(model, seed: int = 0):
    """Give a model weights large enough that what it says depends on what it is given."""
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for values in model.parameters():
            if values.ndim > 1:
                spread = (3.0 / values[0].numel()) ** 0.5
                values.copy_((torch.rand(values.shape, generator=generator) * 2 - 1) * spread)
            else:
                values.add_((torch.rand(values.shape, generator=generator) - 0.5) * 0.4)
        for name, values in model.named_buffers():
            if name.endswith("positional_embedding"):  # SAM draws it when it is made.
                values.copy_(torch.randn(values.shape, generator=generator))
    return model


def save_clip_tokenizer(folder: Path) -> None:
    """Save a tokenizer that knows bytes and no merges."""
    symbols = list(_byte_symbols().values())
    tokens = [*symbols, *(s + "</w>" for s in symbols), "<|startoftext|>", "<|endoftext|>"]
    numbers = {token: k for k, token in enumerate(tokens)}
    transformers.CLIPTokenizer(vocab=numbers, merges=[]).save_pretrained(folder)


def sam3_parts() -> dict:
    """Return the parts of a SAM 3 configuration that both variants share."""
    small = {
        "hidden_size": 32,
        "num_attention_heads": 2,
        "intermediate_size": 32,
        "num_layers": 1,
        "dropout": 0.0,
    }
    vision = {
        "backbone_config": {
            "model_type": "sam3_vit_model",
            "hidden_size": 16,
            "intermediate_size": 32,
            "num_hidden_layers": 2,
            "num_attention_heads": 2,
            "image_size": 56,
            "patch_size": 14,
            "window_size": 2,
            "global_attn_indexes": [1],
            "pretrain_image_size": 28,
        },
        "fpn_hidden_size": 32,
        "backbone_feature_sizes": [[16, 16], [8, 8], [4, 4]],
    }
    return {
        "vision_config": vision,
        "geometry_encoder_config": small,
        "detr_encoder_config": small,
        "detr_decoder_config": {**small, "num_queries": 10},
        "mask_decoder_config": {"hidden_size": 32, "num_attention_heads": 2},
    }


def save_sam3(folder: Path) -> None:
    """Save a SAM 3 with its tokenizer."""
    config = transformers.Sam3Config(
        **sam3_parts(), text_config={**CLIP_TEXT, "model_type": "clip_text_model"}
    )
    shake(transformers.Sam3Model(config)).save_pretrained(folder)
    save_clip_tokenizer(folder)


def save_sam3_lite(folder: Path) -> None:
    """Save a SAM 3 with a light text encoder, and its tokenizer."""
    parts = sam3_parts()
    parts["vision_config"]["model_type"] = "sam3_vision_model"
    text = {k: v for k, v in CLIP_TEXT.items() if not k.endswith("_token_id")}
    config = transformers.Sam3LiteTextConfig(
        **parts, text_config={**text, "num_hidden_layers": 3, "projection_dim": 16}
    )
    shake(transformers.Sam3LiteTextModel(config)).save_pretrained(folder)
    save_clip_tokenizer(folder)


def save_bert_tokenizer(folder: Path) -> None:
    """Save a tokenizer with the special tokens at the numbers that Grounding DINO knows."""
    tokens = [f"[unused{k}]" for k in range(1030 + len(WORDS))]
    tokens[0], tokens[100], tokens[101], tokens[102], tokens[103] = (
        "[PAD]",
        "[UNK]",
        "[CLS]",
        "[SEP]",
        "[MASK]",
    )
    tokens[1012], tokens[1029] = ".", "?"
    tokens[1030:] = WORDS
    (folder / "vocab.txt").write_text("\n".join(tokens) + "\n")
    numbers = {token: k for k, token in enumerate(tokens)}
    transformers.BertTokenizer(vocab=numbers, do_lower_case=True).save_pretrained(folder)


def save_grounding_dino(folder: Path, kind: str = "mm-grounding-dino") -> None:
    """Save a Grounding DINO of either make with its tokenizer."""
    config_class, model_class = {
        "mm-grounding-dino": (
            transformers.MMGroundingDinoConfig,
            transformers.MMGroundingDinoForObjectDetection,
        ),
        "grounding-dino": (
            transformers.GroundingDinoConfig,
            transformers.GroundingDinoForObjectDetection,
        ),
    }[kind]
    config = config_class(
        backbone_config=transformers.SwinConfig(
            image_size=64,
            patch_size=4,
            embed_dim=8,
            depths=[1, 1, 1, 1],
            num_heads=[1, 1, 2, 2],
            window_size=4,
            out_indices=[2, 3, 4],
        ),
        text_config=transformers.BertConfig(
            vocab_size=1060,
            hidden_size=16,
            num_hidden_layers=2,
            num_attention_heads=2,
            intermediate_size=32,
            max_position_embeddings=64,
        ),
        num_queries=20,
        encoder_layers=1,
        encoder_ffn_dim=32,
        encoder_attention_heads=2,
        decoder_layers=2,
        decoder_ffn_dim=32,
        decoder_attention_heads=2,
        d_model=32,
        max_text_len=40,
    )
    model = shake(model_class(config))
    with torch.no_grad():
        for name, values in model.named_parameters():
            # As it begins, everything is background.
            if "class_embed" in name and name.endswith("bias"):
                values.zero_()
    model.save_pretrained(folder)
    save_bert_tokenizer(folder)
    size = {"shortest_edge": 96, "longest_edge": 160}
    transformers.GroundingDinoImageProcessorPil(size=size).save_pretrained(folder)


def _small_sam2() -> dict:
    """Return the parts that SAM 2 and EdgeTAM share."""
    return {
        "prompt_encoder_config": {"hidden_size": 16, "image_size": 64, "patch_size": 16},
        "mask_decoder_config": {
            "hidden_size": 16,
            "mlp_dim": 32,
            "num_attention_heads": 2,
            "iou_head_hidden_dim": 16,
        },
    }


def save_sam2(folder: Path) -> None:
    """Save a SAM 2 for images of 64 pixels."""
    vision = {
        "model_type": "sam2_vision_model",
        "backbone_config": {
            "model_type": "sam2_hiera_det_model",
            "hidden_size": 8,
            "num_attention_heads": 1,
            "image_size": [64, 64],
            "blocks_per_stage": [1, 1, 2, 1],
            "embed_dim_per_stage": [8, 16, 32, 64],
            "num_attention_heads_per_stage": [1, 2, 4, 8],
            "window_size_per_stage": [8, 4, 4, 2],
            "global_attention_blocks": [3],
            "window_positional_embedding_background_size": [4, 4],
        },
        "backbone_channel_list": [64, 32, 16, 8],
        "backbone_feature_sizes": [[16, 16], [8, 8], [4, 4]],
        "fpn_hidden_size": 16,
    }
    config = transformers.Sam2Config(vision_config=vision, **_small_sam2())
    shake(transformers.Sam2Model(config)).save_pretrained(folder)


def save_edgetam(folder: Path) -> None:
    """Save an EdgeTAM for images of 64 pixels; needs timm."""
    vision = {
        "model_type": "edgetam_vision_model",
        "backbone_config": {
            "model_type": "timm_wrapper",
            "architecture": "repvit_m1",
            "num_classes": 2,
            "label_names": ["one", "two"],
            "model_args": {"in_chans": 3, "features_only": True, "out_indices": [0, 1, 2, 3]},
        },
        "backbone_feature_sizes": [[16, 16], [8, 8], [4, 4]],
        "fpn_hidden_size": 16,
    }
    config = transformers.EdgeTamConfig(vision_config=vision, **_small_sam2())
    shake(transformers.EdgeTamModel(config)).save_pretrained(folder)


def save_sam(folder: Path) -> None:
    """Save a SAM for images of 64 pixels."""
    vision = {
        "hidden_size": 16,
        "output_channels": 16,
        "num_hidden_layers": 2,
        "num_attention_heads": 2,
        "image_size": 64,
        "patch_size": 8,
        "window_size": 4,
        "global_attn_indexes": [1],
        "mlp_dim": 32,
        "num_pos_feats": 8,
    }
    parts = _small_sam2()
    parts["prompt_encoder_config"] |= {"patch_size": 8, "image_embedding_size": 8}
    config = transformers.SamConfig(vision_config=vision, **parts)
    shake(transformers.SamModel(config)).save_pretrained(folder)


_CLIP_VISION = {
    "hidden_size": 16,
    "intermediate_size": 32,
    "num_hidden_layers": 3,
    "num_attention_heads": 2,
    "image_size": 32,
    "patch_size": 8,
}


def save_clipseg(folder: Path) -> None:
    """Save a CLIPSeg with its tokenizer."""
    config = transformers.CLIPSegConfig(
        text_config=CLIP_TEXT,
        vision_config=_CLIP_VISION,
        projection_dim=12,
        extract_layers=[0, 1],
        reduce_dim=8,
        decoder_num_attention_heads=2,
        decoder_intermediate_size=16,
    )
    shake(transformers.CLIPSegForImageSegmentation(config)).save_pretrained(folder)
    save_clip_tokenizer(folder)


def save_owlv2(folder: Path) -> None:
    """Save an OWLv2 with its tokenizer."""
    config = transformers.Owlv2Config(
        text_config=CLIP_TEXT, vision_config=_CLIP_VISION, projection_dim=16
    )
    shake(transformers.Owlv2ForObjectDetection(config)).save_pretrained(folder)
    save_clip_tokenizer(folder)
