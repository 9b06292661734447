"""Detectors in ONNX files: what they see comes back at its place in the image."""

import importlib.util
import json
import warnings

import numpy as np
import pytest

pytest.importorskip("onnxruntime", reason="the extra ippon[detector] is not installed")
pytest.importorskip("onnx", reason="the development packages are not installed")

from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.detectors.coco import COCO_80, COCO_91
from ippon.segmentation.detectors.decoding.candidates import grid_cells
from ippon.segmentation.detectors.detector import source_name
from ippon.segmentation.errors import CheckpointError, SegmentationError
from ippon.segmentation.loading import load_segmenter
from tests.onnx_graphs import bright_box_network, constant_network, image_input

CELLS = 8 * 8 + 4 * 4 + 2 * 2
"""Cells of a YOLO with an input of 64x64."""


def load(path, **options):
    config = SegmentationConfig(backend="detector", model=str(path), threads=1, **options)
    return load_segmenter(config, path.parent)


def square(shape, box, colour=(255, 0, 0)):
    """Return an image with a coloured rectangle."""
    left, top, right, bottom = box
    image = np.zeros((*shape, 3), np.uint8)
    image[top:bottom, left:right] = colour
    return image


@pytest.mark.parametrize("shape", [(480, 640), (640, 480), (128, 128), (300, 1000), (90, 61)])
def test_a_red_thing_is_found_at_its_place(tmp_path, shape):
    detector = load(bright_box_network(tmp_path / "red.onnx", 128, 0.5))
    height, width = shape
    box = (width // 5, height // 4, width // 2, height // 3 * 2)
    (one,) = detector.segment(square(shape, box), ("wall",), "mug").instances
    # The grey border of the image is below the threshold; blue and green are other channels.
    np.testing.assert_allclose(one.box_px, box, atol=1.01 * max(shape) / 128)
    assert (one.label, round(one.score, 6)) == ("mug", 0.9)
    blue = detector.segment(square(shape, box, (0, 255, 255)), ("wall",), "mug")
    assert blue.instances == ()


def rows(*boxes):
    return np.array([boxes], np.float32)


def test_only_requested_labels_are_returned(tmp_path):
    found = rows(
        [0, 0, 20, 20, 0.8, COCO_80.index("cup")],
        [5, 5, 30, 30, 0.7, COCO_80.index("couch")],
        [5, 5, 30, 30, 0.6, COCO_80.index("dog")],
        [5, 5, 30, 30, 0.04, COCO_80.index("cup")],
        [5, 5, 30, 30, 0.9, 80],
        [5, 5, 30, 30, 0.9, -1],
        [5, 5, 30, 30, 0.9, np.nan],
    )
    detector = load(constant_network(tmp_path / "yolo26.onnx", {"output0": found}))
    seen = detector.segment(np.zeros((64, 64, 3), np.uint8), ("wall", "sofa"), "cup")
    assert [(one.label, round(one.score, 3)) for one in seen.instances] == [
        ("cup", 0.8),
        ("sofa", 0.7),
    ]
    assert (seen.labels, seen.ooi, seen.dropped) == (("sofa", "cup"), "cup", 0)
    assert seen.source == "yolo26"
    unseen = detector.segment(np.zeros((64, 64, 3), np.uint8), ("wall", "sofa"), "hat")
    assert (unseen.labels, unseen.ooi) == (("sofa",), None)


def test_invalid_boxes_are_dropped_and_counted(tmp_path):
    cup = COCO_80.index("cup")
    found = rows(
        [10, 10, 20, 20, 0.9, cup],
        [20, 20, 10, 10, 0.9, cup],
        [np.nan, 0, 9, 9, 0.9, cup],
        [np.inf, 0, 9, 9, 0.9, cup],
        [70, 70, 90, 90, 0.9, cup],
        [10, 10, 20, 20, 1.7, cup],
    )
    detector = load(constant_network(tmp_path / "odd.onnx", {"output0": found}))
    seen = detector.segment(np.zeros((64, 64, 3), np.uint8), ("wall",), "cup")
    assert [one.box_px for one in seen.instances] == [(10.0, 10.0, 20.0, 20.0)]
    assert seen.dropped == 5


def test_scores_that_are_not_numbers_are_an_error_and_no_empty_image(tmp_path):
    output = yolov8_output(80, [(32, 32, 20, 20, COCO_80.index("cup"), np.nan)])
    detector = load(constant_network(tmp_path / "half.onnx", {"output0": output}))
    image = np.zeros((64, 64, 3), np.uint8)
    with pytest.raises(SegmentationError, match="scores that are not numbers"):
        detector.segment(image, ("wall",), "cup")
    assert detector.segment(image, ("wall", "chair"), None).instances == ()


def test_ten_thousand_boxes_take_no_time_and_the_best_stay(tmp_path):
    rng = np.random.default_rng(0)
    corners = rng.uniform(0, 600, (8400, 2))
    output = np.zeros((84, 8400), np.float32)
    output[:4] = np.concatenate([corners, rng.uniform(1, 60, (8400, 2))], axis=1).T
    output[4 + COCO_80.index("cup")] = rng.uniform(0.1, 1, 8400)
    output[4 + COCO_80.index("cup"), 77] = 0.9999
    images = image_input(shape=(1, 3, 640, 640))
    path = constant_network(tmp_path / "y.onnx", {"output0": output[None]}, inputs=[images])
    seen = load(path).segment(np.zeros((640, 640, 3), np.uint8), ("wall",), "cup")
    assert 100 < len(seen.instances) <= 300
    assert seen.instances[0].score == pytest.approx(0.9999)


def yolov8_output(classes, boxes, extra=0):
    """Return (1, 4 + C + extra, CELLS) with boxes: centre x, y, width, height, class, score."""
    output = np.zeros((1, 4 + classes + extra, CELLS), np.float32)
    for cell, (x, y, w, h, number, score) in enumerate(boxes):
        output[0, :4, cell] = x, y, w, h
        output[0, 4 + number, cell] = score
    return output


def test_classes_of_one_label_suppress_each_other_and_others_do_not(tmp_path):
    names = {0: "couch", 1: "sofa", 2: "chair"}
    output = yolov8_output(3, [(30, 30, 20, 20, k, 0.9 - 0.1 * k) for k in range(3)])
    path = constant_network(tmp_path / "y.onnx", {"o": output}, notes={"names": str(names)})
    seen = load(path).segment(np.zeros((64, 64, 3), np.uint8), ("sofa", "chair"), None)
    assert [(one.label, round(one.score, 3)) for one in seen.instances] == [
        ("sofa", 0.9),
        ("chair", 0.7),
    ]


def test_masks_of_prototypes_lie_over_the_image_within_their_boxes(tmp_path):
    """Two prototypes: the left half of the input, and its right half."""
    prototypes = np.full((1, 2, 16, 16), -9.0, np.float32)
    prototypes[0, 0, :, :8] = prototypes[0, 1, :, 8:] = 9.0
    output = yolov8_output(1, [(32, 32, 40, 16, 0, 0.9)], extra=2)
    output[0, 5:, 0] = 1.0, 0.0
    path = constant_network(
        tmp_path / "seg.onnx", {"output0": output, "output1": prototypes},
        notes={"names": "['cup']"},
    )  # fmt: skip
    seen = load(path).segment(np.zeros((240, 480, 3), np.uint8), ("wall",), "cup")
    (one,) = seen.instances
    # The image lies in rows 16 to 48 of the input, 7.5 of its pixels for one of the input's.
    np.testing.assert_allclose(one.box_px, (90, 60, 390, 180), atol=1e-6)
    assert one.mask.shape == (8, 16)
    expected = np.zeros((8, 16), bool)
    expected[2:6, 3:8] = True
    np.testing.assert_array_equal(one.mask, expected)


def test_masks_of_stretched_images_are_in_the_images_proportions(tmp_path):
    logits = np.full((1, 2, 91), -9.0, np.float32)
    logits[0, 0, COCO_91.index("cup")] = 3.0
    boxes = np.array([[[0.5, 0.5, 1, 1], [0.5, 0.5, 0.1, 0.1]]], np.float32)
    masks = np.full((1, 2, 32, 32), -5.0, np.float32)
    masks[0, 0, :16] = 5.0
    path = constant_network(
        tmp_path / "rfdetr-seg.onnx", {"dets": boxes, "labels": logits, "masks": masks}
    )
    detector = load(path)
    (one,) = detector.segment(np.zeros((120, 240, 3), np.uint8), ("wall",), "cup").instances
    assert one.mask.shape == (16, 32)
    assert one.mask[:8].all()
    assert not one.mask[8:].any()
    assert detector.layout.family == "rf-detr"


def test_an_object_smaller_than_a_pixel_of_its_mask_keeps_its_box(tmp_path):
    prototypes = np.full((1, 1, 16, 16), -9.0, np.float32)
    output = yolov8_output(1, [(32, 32, 2, 2, 0, 0.9)], extra=1)
    output[0, 5, 0] = 1.0
    path = constant_network(
        tmp_path / "seg.onnx", {"output0": output, "output1": prototypes},
        notes={"names": "['cup']"},
    )  # fmt: skip
    (one,) = load(path).segment(np.zeros((64, 64, 3), np.uint8), ("wall",), "cup").instances
    assert one.mask is None


def test_rt_detrs_own_exports_get_the_size_of_their_input(tmp_path):
    outputs = {
        "labels": np.array([[COCO_80.index("tv"), 200]], np.int64),
        "boxes": np.array([[[16, 8, 48, 40], [0, 0, 9, 9]]], np.float32),
        "scores": np.array([[0.7, 0.9]], np.float32),
    }
    inputs = [image_input(), image_input("orig_target_sizes", (1, 2), 7)]
    detector = load(constant_network(tmp_path / "dfine_s.onnx", outputs, inputs=inputs))
    assert detector._feeds(np.zeros((3, 64, 96), np.float32))["orig_target_sizes"].tolist() == [
        [96, 64]
    ]
    seen = detector.segment(np.zeros((128, 256, 3), np.uint8), ("tv",), None)
    assert [(one.label, one.box_px) for one in seen.instances] == [
        ("tv", (64.0, 16.0, 192.0, 80.0))
    ]


def test_files_beside_a_transformers_export_are_read(tmp_path):
    folder = tmp_path / "my_detector"
    folder.mkdir()
    logits, boxes = np.zeros((1, 5, 2), np.float32), np.full((1, 5, 4), 0.5, np.float32)
    path = constant_network(folder / "model.onnx", {"logits": logits, "pred_boxes": boxes})
    with pytest.raises(CheckpointError, match="tells 2 classes and does not say which: name them"):
        load(path)
    said = {"model_type": "rf_detr", "id2label": {"0": "hat", "1": "N/A"}}
    (folder / "config.json").write_text(json.dumps(said))
    mean = {"do_normalize": True, "image_mean": [0.5] * 3, "image_std": [0.25] * 3}
    (folder / "preprocessor_config.json").write_text(json.dumps(mean))
    detector = load(path)
    assert detector.vocabulary.names == ("hat",)
    assert (detector.layout.family, detector.source) == ("rf-detr", "my_detector")
    white, _ = detector.image_input.prepare(np.full((9, 9, 3), 255, np.uint8))
    np.testing.assert_allclose(white, 2.0, rtol=1e-6)
    mean["do_normalize"] = False
    (folder / "preprocessor_config.json").write_text(json.dumps(mean))
    white, _ = load(path).image_input.prepare(np.full((9, 9, 3), 255, np.uint8))
    np.testing.assert_allclose(white, 1.0, rtol=1e-6)
    (folder / "config.json").write_text("[1")
    with pytest.raises(CheckpointError, match=r"config\.json cannot be read: "):
        load(path)


def test_files_above_the_hubs_folder_of_exports_are_read(tmp_path):
    folder = tmp_path / "our_detr-ONNX" / "onnx"
    folder.mkdir(parents=True)
    outputs = {
        "logits": np.zeros((1, 5, 3), np.float32),
        "pred_boxes": np.full((1, 5, 4), 0.5, np.float32),
    }
    # The hub's exports of DETR take a mask of 64x64, whatever the size of the image.
    inputs = [
        image_input("pixel_values", (None, 3, None, None)),
        image_input("pixel_mask", (None, 64, 64), 7),
    ]
    said = {"model_type": "detr", "id2label": {"0": "hat", "1": "cap"}}
    (folder.parent / "config.json").write_text(json.dumps(said))
    detector = load(constant_network(folder / "model.onnx", outputs, inputs=inputs))
    assert detector.vocabulary.names == ("hat", "cap")
    assert (detector.layout.family, detector.source) == ("detr", "our_detr-ONNX")
    feeds = detector._feeds(np.zeros((3, 640, 640), np.float32))
    assert feeds["pixel_mask"].shape == (1, 64, 64)
    # What lies beside the file goes before.
    (folder / "config.json").write_text(json.dumps(said | {"id2label": {"0": "a", "1": "b"}}))
    assert load(folder / "model.onnx").vocabulary.names == ("a", "b")


@pytest.mark.parametrize(
    ("objectness", "family", "fit", "channels"),
    [(1.0, "yolov5", "centre", "RGB"), (0.5, "yolox", "corner", "BGR")],
)
def test_yolov6_is_told_from_yolox_by_its_constant_objectness(
    tmp_path, objectness, family, fit, channels
):
    rows = np.zeros((1, CELLS, 85), np.float32)
    middles = grid_cells((64, 64), (8, 16, 32))
    rows[0, :, :2] = (middles[:, :2] + 0.5) * middles[:, 2:]
    rows[0, :, 2:4] = 20.0
    rows[0, :, 4] = objectness
    rows[0, 27, 5 + COCO_80.index("cup")] = 0.9
    detector = load(constant_network(tmp_path / "yolo.onnx", {"outputs": rows}))
    assert detector.layout.family == family
    assert (detector.image_input.fit, detector.image_input.channels) == (fit, channels)
    (one,) = detector.segment(np.zeros((64, 64, 3), np.uint8), ("cup",), None).instances
    assert one.score == pytest.approx(0.9 * objectness)
    assert one.box_px == (18.0, 18.0, 38.0, 38.0)


@pytest.mark.parametrize("kind", ["rt_detr", "rt_detr_v2", "d_fine", "rf_detr"])
@pytest.mark.parametrize("classes", [91, 92])
def test_the_type_of_a_transformers_model_tells_its_family(tmp_path, kind, classes):
    """Fine-tuned to as many classes as the outputs of RF-DETR or of the first DETR for COCO."""
    logits = np.full((1, 5, classes), -9.0, np.float32)
    logits[0, 0, classes - 1] = 2.0
    boxes = np.full((1, 5, 4), 0.5, np.float32)
    path = constant_network(tmp_path / "own.onnx", {"logits": logits, "pred_boxes": boxes})
    names = {str(k): f"thing {k}" for k in range(classes)}
    said = {"model_type": kind, "id2label": names}
    (tmp_path / "config.json").write_text(json.dumps(said))
    detector = load(path)
    own = "rf-detr" if kind == "rf_detr" else "rt-detr"
    assert detector.layout.family == own
    last = f"thing_{classes - 1}"
    (one,) = detector.segment(np.zeros((64, 64, 3), np.uint8), (last,), None).instances
    assert (one.label, round(one.score, 3)) == (last, 0.881)


def test_a_network_is_named_by_its_file_or_folder(tmp_path):
    assert source_name(tmp_path / "yolox_s.onnx") == "yolox_s"
    assert source_name(tmp_path / "rtdetr_r18" / "model.onnx") == "rtdetr_r18"
    assert source_name(tmp_path / "rtdetr_r18" / "model_fp16.onnx") == "rtdetr_r18"
    assert source_name(tmp_path / "rfdetr-ONNX" / "onnx" / "model_q4.onnx") == "rfdetr-ONNX"
    assert source_name(tmp_path / "yolo11n_ncnn_model" / "model.ncnn.param") == "yolo11n_ncnn_model"


@pytest.mark.parametrize(
    ("outputs", "text"),
    [
        ({"logits": (1, 1000)}, "looks like a classifier of 1000 classes"),
        ({"out": (1, 21, 64, 64)}, "looks like a network that judges every pixel"),
        ({"a": (1, 5, 5), "b": (1, 9), "c": (1, 2)}, "a (5, 5), b (9,), c (2,) for an input of"),
        ({"output0": (1, 83, CELLS + 2)}, "known are nanodet, yolox, yolov5, yolov8"),
        ({"boxes": (1, 9, 4), "scores": (1, 9), "labels": (1, 8)}, "not of a known detector"),
        ({"logits": (1, 9, 80), "pred_boxes": (1, 8, 4)}, "not of a known detector"),
    ],
)
def test_other_architectures_are_refused(tmp_path, outputs, text):
    arrays = {name: np.zeros(shape, np.float32) for name, shape in outputs.items()}
    with pytest.raises(CheckpointError) as caught:
        load(constant_network(tmp_path / "other.onnx", arrays))
    assert text in str(caught.value)


@pytest.mark.parametrize(
    ("inputs", "text"),
    [
        ([image_input(shape=(1, 1, 64, 64))], "takes images (1, 1, 64, 64); a detector takes one"),
        ([image_input(shape=(8, 3, 64, 64))], "takes images (8, 3, 64, 64)"),
        ([image_input(shape=(1, 64, 64, 3))], "takes images (1, 64, 64, 3)"),
        ([image_input(shape=(None, None, None, 3))], "takes images (None, None, None, 3)"),
        ([image_input(), image_input("prompt", (1, 77))], "prompt (1, 77); a detector takes one"),
        ([image_input("ids", (1, 7))], "this network takes ids (1, 7)"),
        ([image_input(shape=(1, 3, 10**6, 640))], "640x1000000; a detector takes at most 8192"),
    ],
)
def test_other_inputs_are_refused(tmp_path, inputs, text):
    path = constant_network(
        tmp_path / "other.onnx", {"output0": np.zeros((1, 5, 6), np.float32)}, inputs=inputs
    )
    with pytest.raises(CheckpointError) as caught:
        load(path)
    assert text in str(caught.value)


def test_the_number_of_labels_must_be_that_of_the_outputs(tmp_path):
    labels = tmp_path / "labels.txt"
    labels.write_text("hat\ncap\n")
    path = constant_network(tmp_path / "y.onnx", {"output0": np.zeros((1, 7, CELLS), np.float32)})
    with pytest.raises(CheckpointError, match="tells 3 classes and the labels name 2; the labels"):
        load(path, labels_file=str(labels))
    labels.write_text("hat\n-\ncap = beanie, cap\n")
    detector = load(path, labels_file=str(labels))
    assert detector.vocabulary.names == ("hat", "cap")
    assert detector.vocabulary.knows("beanie")


def test_a_family_that_is_named_must_fit(tmp_path):
    outputs = {
        "logits": np.zeros((1, 9, 81), np.float32),
        "pred_boxes": np.zeros((1, 9, 4), np.float32),
    }
    path = constant_network(tmp_path / "d.onnx", outputs)
    with pytest.raises(CheckpointError, match="are those of rt-detr, not of yolox: take"):
        load(path, family="yolox")
    detector = load(path, family="detr")
    assert (detector.layout.family, detector.layout.classes) == ("detr", 80)
    assert detector.image_input.mean[0] == pytest.approx(123.675)


def test_the_size_can_be_chosen_where_the_file_leaves_it_open(tmp_path):
    output = {"output0": np.zeros((1, 5, 6), np.float32)}
    open_size = [image_input(shape=(1, 3, None, None))]
    path = constant_network(tmp_path / "open.onnx", output, inputs=open_size)
    assert load(path).image_input.size == (640, 640)
    assert load(path, input_px=320).image_input.size == (320, 320)
    fixed = constant_network(tmp_path / "fixed.onnx", output)
    assert load(fixed).image_input.size == (64, 64)
    with pytest.raises(CheckpointError, match="takes images of 64x64 alone"):
        load(fixed, input_px=320)


def tiny(name):
    """Return a randomly initialised detector of `transformers`, small enough for a test."""
    import torch
    import transformers as t

    torch.manual_seed(0)
    resnet = {"embedding_size": 16, "depths": [1, 1, 1, 1], "layer_type": "basic"}
    shared = {
        "encoder_hidden_dim": 32, "encoder_in_channels": [32, 48, 64], "d_model": 32,
        "feat_strides": [8, 16, 32], "encoder_ffn_dim": 32, "encoder_attention_heads": 2,
        "num_queries": 30, "decoder_in_channels": [32] * 3, "decoder_ffn_dim": 32,
        "decoder_layers": 2, "decoder_attention_heads": 2, "num_labels": 80, "num_denoising": 0,
        "eval_size": None, "anchor_image_size": None,
    }  # fmt: skip
    if name == "detr":
        backbone = t.ResNetConfig(**resnet, hidden_sizes=[16] * 3 + [32], out_features=["stage4"])
        return t.DetrForObjectDetection(t.DetrConfig(
            use_timm_backbone=False, use_pretrained_backbone=False, backbone=None,
            backbone_config=backbone, d_model=32, encoder_layers=1, decoder_layers=1,
            encoder_ffn_dim=32, decoder_ffn_dim=32, encoder_attention_heads=2,
            decoder_attention_heads=2, num_queries=20, num_labels=91,
        ))  # fmt: skip
    if name == "rf_detr":
        backbone = t.RfDetrDinov2Config(
            hidden_size=32, num_hidden_layers=4, num_attention_heads=2, image_size=112,
            patch_size=14, out_features=["stage2", "stage4"], num_windows=2,
            window_block_indexes=[0, 2], mlp_ratio=2,
        )  # fmt: skip
        return t.RfDetrForObjectDetection(t.RfDetrConfig(
            backbone_config=backbone, d_model=32, decoder_ffn_dim=32, decoder_layers=1,
            decoder_cross_attention_heads=2, decoder_self_attention_heads=2, num_queries=20,
            group_detr=1, num_labels=91, hidden_expansion=0.5, c2f_num_blocks=1,
            decoder_n_points=2,
        ))  # fmt: skip
    stages = ["stage2", "stage3", "stage4"]
    if name == "d_fine":
        backbone = t.HGNetV2Config(
            embedding_size=16, hidden_sizes=[32, 32, 48, 64], depths=[1] * 4,
            stem_channels=[3, 16, 16], stage_in_channels=[16, 32, 32, 48],
            stage_mid_channels=[16] * 4, stage_out_channels=[32, 32, 48, 64],
            stage_num_blocks=[1] * 4, stage_numb_of_layers=[1] * 4, out_features=stages,
        )  # fmt: skip
        return t.DFineForObjectDetection(t.DFineConfig(backbone_config=backbone, **shared))
    backbone = t.RTDetrResNetConfig(**resnet, hidden_sizes=[16, 32, 48, 64], out_features=stages)
    kinds = {
        "rt_detr": (t.RTDetrForObjectDetection, t.RTDetrConfig),
        "rt_detr_v2": (t.RTDetrV2ForObjectDetection, t.RTDetrV2Config),
    }
    model, config = kinds[name]
    return model(config(backbone_config=backbone, **shared))


def export(model, path, side):
    """Write a model as `transformers`' exporters do: pixel_values to logits and pred_boxes."""
    import torch

    class Outputs(torch.nn.Module):
        def __init__(self):
            super().__init__()
            self.model = model

        def forward(self, pixels):
            outputs = self.model(pixel_values=pixels)
            return outputs.logits, outputs.pred_boxes

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(
            Outputs().eval(), (torch.rand(1, 3, side, side),), str(path), opset_version=17,
            dynamo=False, input_names=["pixel_values"], output_names=["logits", "pred_boxes"],
        )  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("transformers") is None, reason="needs transformers")
@pytest.mark.parametrize("name", ["rt_detr", "rt_detr_v2", "d_fine", "rf_detr", "detr"])
def test_real_architectures_agree_with_transformers(tmp_path, name):
    """Random weights; the processors' own post-processing of the same outputs is the truth."""
    import torch
    from transformers import DetrImageProcessor, RTDetrImageProcessor
    from transformers.modeling_outputs import ModelOutput

    model = tiny(name).eval()
    for parameter in model.parameters():
        parameter.data += 0.05 * torch.randn_like(parameter)
    if name == "detr":
        # Of 92 classes that exclude each other, random weights let none stand out.
        model.class_labels_classifier.weight.data *= 100.0
    if name == "rf_detr":
        # Its training starts with scores of 0.01.
        model.class_embed.bias.data.zero_()
    path = tmp_path / f"{name}.onnx"
    if name == "rf_detr":
        # The exporter without further packages lacks an operator of it: its outputs are held.
        with torch.no_grad():
            held = model(pixel_values=torch.rand(1, 3, 112, 112))
        values = {key: held[key].numpy() for key in ("logits", "pred_boxes")}
        constant_network(path, values, inputs=[image_input("pixel_values", (1, 3, 112, 112))])
    else:
        export(model, path, 128)
    detector = load(path)
    families = {"detr": "detr", "rf_detr": "rf-detr"}
    assert detector.layout.family == families.get(name, "rt-detr")
    color = np.random.default_rng(1).integers(0, 256, (96, 160, 3), dtype=np.uint8)
    asked = tuple(dict.fromkeys(detector.vocabulary.names))
    seen = detector.segment(color, asked, None)
    raw = detector._network.run({"pixel_values": detector.image_input.prepare(color)[0][None]})
    outputs = ModelOutput({key: torch.from_numpy(value) for key, value in raw.items()})
    processor = DetrImageProcessor() if name == "detr" else RTDetrImageProcessor()
    truth = processor.post_process_object_detection(
        outputs, threshold=0.05, target_sizes=[(96, 160)]
    )[0]
    # Each box of the processor's is among ours, with its label and score.
    classes = detector.vocabulary.classes
    ours = [(one.label, one.score, one.box_px) for one in seen.instances]
    checked = 0
    for score, number, box in zip(truth["scores"], truth["labels"], truth["boxes"], strict=True):
        inside = box.numpy().clip(0, [160, 96, 160, 96])
        if not classes[number] or (inside[2:] - inside[:2] < 1).any() or score < 0.0501:
            continue
        if len(ours) == 300 and score <= ours[-1][1]:
            continue
        checked += 1
        assert any(
            label == classes[number]
            and abs(own - float(score)) < 1e-5
            and np.allclose(place, inside, atol=1e-3)
            for label, own, place in ours
        )
    assert checked >= min(5, len(ours))
    assert ours
