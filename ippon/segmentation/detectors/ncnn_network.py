"""Networks in ncnn files: a .param file with its .bin beside it."""

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ippon.segmentation.detectors.ncnn_files import (
    Layer,
    check_weights,
    read_structure,
    try_out,
)
from ippon.segmentation.detectors.network import LARGEST_SIDE_PX, Shape, Tensors
from ippon.segmentation.errors import CheckpointError, SegmentationError

_SIDE_PX: Final = 640
"""Side of the input of most detectors whose files state none."""
_NANODET_SIDE_PX: Final = 416


class NcnnNetwork:
    """A network with one image as input; implements `Network`."""

    def __init__(
        self, path: Path, *, device: str = "auto", threads: int = 0, input_px: int = 0
    ) -> None:
        """Check the files and load the network.

        Args:
            path: The .param file.
            device: `auto` or `cpu`.
            threads: CPU cores; 0 for all.
            input_px: Side of the square input; 0 for that in the file, else the default.

        Raises:
            CheckpointError: A file is missing, damaged, or of another network.
            SegmentationError: The device is not supported.
        """
        if device not in {"auto", "cpu"}:
            raise SegmentationError(
                f"ncnn files run on the processor; got the device {device!r}: take "
                "--segmentation.device cpu, or an ONNX file for a GPU"
            )
        weights = path.with_suffix(".bin")
        if not weights.is_file():
            raise CheckpointError(
                f"{path.name} needs its weights beside it: there is no {weights.name} in "
                f"{path.parent}"
            )
        layers = read_structure(path)
        check_weights(weights, layers)
        inputs = [layer for layer in layers if layer.kind == "Input"]
        if len(inputs) != 1:
            raise CheckpointError(f"{path.name} takes {len(inputs)} inputs; a detector takes one")
        said = _size(path, inputs[0])
        usual = _NANODET_SIDE_PX if "nanodet" in path.name.lower() else _SIDE_PX
        side = input_px or usual
        size = said if min(said) > 0 and not input_px else (side, side)
        try_out(path, weights, size)
        self._ncnn: Any = importlib.import_module("ncnn")
        self._net = _load(self._ncnn, path, weights, threads)
        name = str(self._net.input_names()[0])
        self._outputs = tuple(str(one) for one in self._net.output_names())
        self.inputs: Mapping[str, Shape] = {name: (1, 3, *size)}
        self.notes: Mapping[str, str] = {}

    def run(self, inputs: Tensors) -> dict[str, NDArray[Any]]:
        """Compute the outputs; see `Network.run`."""
        extractor: Any = self._net.create_extractor()
        # ncnn does not copy the arrays, so they must outlive the extractor.
        held = {
            name: np.ascontiguousarray(values[0], np.float32) for name, values in inputs.items()
        }
        for name, values in held.items():
            extractor.input(name, self._ncnn.Mat(values))
        outputs: dict[str, NDArray[Any]] = {}
        for name in self._outputs:
            failed, output = extractor.extract(name)
            if failed:
                raise SegmentationError(f"ncnn failed on an image (status {failed} for {name})")
            outputs[name] = np.array(output, np.float32)
        return outputs


def _size(path: Path, layer: Layer) -> tuple[int, int]:
    """Return (H, W) of the input as the file states it, 0 for none.

    Raises:
        CheckpointError: It is no size.
    """
    said = [layer.parameters.get(key, "0") for key in (1, 0)]
    if not all(side.isdecimal() and int(side) <= LARGEST_SIDE_PX for side in said):
        raise CheckpointError(
            f"{path.name} takes images of {said[1]}x{said[0]}; a detector takes at most "
            f"{LARGEST_SIDE_PX} pixels a side"
        )
    return int(said[0]), int(said[1])


def _load(ncnn: Any, param: Path, weights: Path, threads: int) -> Any:
    net: Any = ncnn.Net()
    net.opt.use_vulkan_compute = False
    if threads:
        net.opt.num_threads = threads
    if net.load_param(str(param)) or net.load_model(str(weights)):
        raise CheckpointError(f"ncnn does not load {param.name} with {weights.name}")
    return net
