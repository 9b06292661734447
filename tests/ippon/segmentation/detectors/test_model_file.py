"""Files that are no detector, with the words that say so."""

import os
import pickle
import zipfile

import numpy as np
import pytest

pytest.importorskip("onnxruntime", reason="the extra ippon[detector] is not installed")
onnx = pytest.importorskip("onnx", reason="the development packages are not installed")

from ippon.segmentation.config import SegmentationConfig  # noqa: E402
from ippon.segmentation.detectors.model_file import find_model  # noqa: E402
from ippon.segmentation.errors import CheckpointError, SegmentationError  # noqa: E402
from ippon.segmentation.loading import load_segmenter  # noqa: E402
from tests.onnx_graphs import constant_network, image_input, save  # noqa: E402

PYTORCH = (
    " is a PyTorch file: it may contain code that runs when it is opened, so it is not opened. "
    "Export it to ONNX where you trust it (torch.onnx.export, 'yolo export format=onnx', or the "
    "export script of its repository)"
)


class RunsCode:
    """Makes a folder when it is read from a pickle."""

    def __init__(self, path):
        self.path = str(path)

    def __reduce__(self):
        return os.mkdir, (self.path,)


def refusal(path, **options):
    config = SegmentationConfig(backend="detector", model=str(path), threads=1, **options)
    with pytest.raises(CheckpointError) as caught:
        load_segmenter(config, path.parent)
    return str(caught.value)


@pytest.mark.parametrize("name", ["best.pt", "model.onnx", "model.param", "model"])
@pytest.mark.parametrize("protocol", [2, 4, 5])
def test_code_in_a_pickle_does_not_run(tmp_path, name, protocol):
    made = tmp_path / "made"
    content = pickle.dumps({"weights": RunsCode(made)}, protocol=protocol)
    (tmp_path / name).write_bytes(content)
    assert refusal(tmp_path / name) == f"{name}{PYTORCH}"
    assert not made.exists()
    # The same pickle where it is trusted, to show that it would have done something.
    pickle.loads(content)
    assert made.exists()


def test_code_in_an_old_pickle_does_not_run(tmp_path):
    """Protocol 0 is text, without a mark at its beginning."""
    made = tmp_path / "made"
    content = pickle.dumps(RunsCode(made), protocol=0)
    (tmp_path / "model.onnx").write_bytes(content)
    refusal(tmp_path / "model.onnx")
    (tmp_path / "model.bin").write_bytes(content)
    (tmp_path / "model.param").write_text("7767517\n1 1\nInput in0 0 1 in0\n")
    refusal(tmp_path / "model.param")
    assert not made.exists()


def test_pickles_are_not_opened(tmp_path):
    with zipfile.ZipFile(tmp_path / "best.onnx", "w") as archive:
        archive.writestr("archive/data.pkl", pickle.dumps(RunsCode(tmp_path / "made")))
    assert refusal(tmp_path / "best.onnx") == f"best.onnx{PYTORCH}"
    assert not (tmp_path / "made").exists()


def test_invalid_files_are_named_with_alternatives(tmp_path):
    is_what = "a detector is an .onnx or an ncnn .param file"
    missing = tmp_path / "none.onnx"
    assert refusal(missing) == f"there is no {missing}; {is_what}"
    folder = tmp_path / "folder.onnx"
    folder.mkdir()
    assert refusal(folder) == f"{folder} is not a file; {is_what}"
    (tmp_path / "a.jpg").write_bytes(b"\xff\xd8" * 20)
    assert refusal(tmp_path / "a.jpg") == (
        "a.jpg is not a detector file: .onnx, or an ncnn .param with its .bin beside it"
    )
    (tmp_path / "short.onnx").write_bytes(b"\x08\x08")
    assert refusal(tmp_path / "short.onnx") == "short.onnx is empty or cut off: it has 2 bytes"
    (tmp_path / "page.onnx").write_text("<html>404: Not Found</html>" * 3)
    assert refusal(tmp_path / "page.onnx") == (
        "page.onnx is not an ONNX file: it is text that begins with "
        "'<html>404: Not Found</html><ht'"
    )


def test_damaged_files_are_refused(tmp_path):
    path = constant_network(tmp_path / "y.onnx", {"output0": np.zeros((1, 5, 6), np.float32)})
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    assert refusal(path).startswith("y.onnx is damaged, cut off, or no ONNX file: ")
    path.write_bytes(np.random.default_rng(0).bytes(4000))
    assert refusal(path).startswith("y.onnx is damaged, cut off, or no ONNX file: ")


def test_operators_of_another_library_are_refused(tmp_path):
    output = onnx.helper.make_tensor_value_info("o", onnx.TensorProto.FLOAT, [1, 5, 6])
    node = onnx.helper.make_node("EfficientNMS_TRT", ["images"], ["o"], domain="trt")
    opsets = [onnx.helper.make_opsetid("", 17), onnx.helper.make_opsetid("trt", 1)]
    said = refusal(save(tmp_path / "t.onnx", [node], [image_input()], [output], opsets=opsets))
    assert said.startswith("t.onnx needs an operator that onnxruntime lacks")
    assert said.endswith("Export it without custom operators")


def test_weights_in_another_file_must_be_there(tmp_path):
    path = constant_network(tmp_path / "big.onnx", {"output0": np.zeros((1, 300, 6), np.float32)})
    model = onnx.load(path)
    onnx.save(model, path, save_as_external_data=True, location="big.onnx.data", size_threshold=0)
    (tmp_path / "big.onnx.data").unlink()
    said = refusal(path)
    assert said.startswith("big.onnx keeps its weights in another file, which is missing: ")


def test_a_model_is_a_path_or_a_name_in_the_folder_of_models(tmp_path):
    (tmp_path / "a.onnx").write_bytes(b"x")
    assert find_model("a.onnx", tmp_path) == tmp_path / "a.onnx"
    assert find_model(str(tmp_path / "b.onnx"), tmp_path) == tmp_path / "b.onnx"
    with pytest.raises(CheckpointError) as caught:
        find_model("", tmp_path)
    assert str(caught.value) == (
        "the detector needs its file: --segmentation.model FILE, an .onnx file or an ncnn .param "
        "file with its .bin beside it"
    )


def test_unknown_devices_are_rejected(tmp_path):
    path = constant_network(tmp_path / "y.onnx", {"output0": np.zeros((1, 5, 6), np.float32)})
    config = SegmentationConfig(backend="detector", model=str(path), device="tpu")
    with pytest.raises(SegmentationError, match="a device is auto, cpu, cuda or cuda:N; got 'tpu'"):
        load_segmenter(config, tmp_path)
