"""Networks in ONNX files, run by onnxruntime."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ippon.segmentation.detectors.network import Shape, Tensors
from ippon.segmentation.errors import CheckpointError, SegmentationError

_TYPES: Final[Mapping[str, Any]] = {
    "tensor(float)": np.float32,
    "tensor(float16)": np.float16,
    "tensor(double)": np.float64,
    "tensor(int64)": np.int64,
    "tensor(int32)": np.int32,
    "tensor(bool)": np.bool_,
}
_FATAL: Final = 4
"""Severity from which onnxruntime writes to standard error; errors are raised as well."""


class OnnxNetwork:
    """A network in an ONNX file; implements `Network`."""

    def __init__(self, path: Path, *, device: str = "auto", threads: int = 0) -> None:
        """Load a network.

        Args:
            path: The .onnx file.
            device: `auto`, `cpu`, `cuda` or `cuda:N`.
            threads: CPU cores; 0 for all.

        Raises:
            CheckpointError: The file is damaged, or needs operators that onnxruntime lacks.
            SegmentationError: The device does not exist.
        """
        import onnxruntime as ort  # noqa: PLC0415, an optional package

        providers = _providers(device, ort.get_available_providers())
        options = ort.SessionOptions()
        options.log_severity_level = _FATAL
        if threads:
            options.intra_op_num_threads = threads
            options.inter_op_num_threads = 1
        try:
            session: Any = ort.InferenceSession(str(path), options, providers=providers)
        except Exception as error:
            raise CheckpointError(_why_not_loaded(path, str(error))) from error
        running = session.get_providers()[0]
        if device.startswith("cuda") and running != _CUDA:
            raise SegmentationError(
                f"onnxruntime could not start CUDA and would take {running}: check the driver and "
                "the CUDA libraries, or take --segmentation.device cpu"
            )
        self._session = session
        self._types = {one.name: _type(path, one.name, one.type) for one in session.get_inputs()}
        self._outputs = [one.name for one in session.get_outputs()]
        self.inputs: Mapping[str, Shape] = {
            one.name: tuple(side if isinstance(side, int) else None for side in one.shape)
            for one in session.get_inputs()
        }
        self.notes: Mapping[str, str] = session.get_modelmeta().custom_metadata_map

    def run(self, inputs: Tensors) -> dict[str, NDArray[Any]]:
        """Compute the outputs; see `Network.run`."""
        feeds = {
            name: np.ascontiguousarray(values, self._types[name]) for name, values in inputs.items()
        }
        try:
            outputs = self._session.run(self._outputs, feeds)
        except Exception as error:
            raise SegmentationError(f"onnxruntime failed on an image: {_short(error)}") from error
        named = dict(zip(self._outputs, outputs, strict=True))
        odd = [name for name, values in named.items() if not isinstance(values, np.ndarray)]
        if odd:
            raise SegmentationError(f"outputs are arrays; {', '.join(odd)} of this network is none")
        return named


_CUDA: Final = "CUDAExecutionProvider"
_CPU: Final = "CPUExecutionProvider"


def _providers(device: str, available: list[str]) -> list[Any]:
    """Return the execution providers of onnxruntime, in order.

    Raises:
        SegmentationError: The device does not exist, or this onnxruntime does not support it.
    """
    kind, _, number = device.partition(":")
    if device == "cpu" or (device == "auto" and _CUDA not in available):
        return [_CPU]
    if device == "auto":
        return [_CUDA, _CPU]
    if kind != "cuda" or (number and not number.isdecimal()):
        raise SegmentationError(f"a device is auto, cpu, cuda or cuda:N; got {device!r}")
    if _CUDA not in available:
        raise SegmentationError(
            "this onnxruntime is built for the processor: pip install onnxruntime-gpu in its place,"
            " or take --segmentation.device cpu"
        )
    return [(_CUDA, {"device_id": number or "0"}), _CPU]


def _why_not_loaded(path: Path, said: str) -> str:
    reason = " ".join(said.split())[:300]
    missing = any(
        part in said for part in ("not a registered function/op", "No Op registered", "No opset")
    )
    if missing or "is not registered" in said:
        return (
            f"{path.name} needs an operator that onnxruntime lacks, so a library of its own or "
            f"another release: {reason}. Export it without custom operators"
        )
    if ".data" in said or "external" in said.lower():
        return f"{path.name} keeps its weights in another file, which is missing: {reason}"
    return f"{path.name} is damaged, cut off, or no ONNX file: {reason}"


def _type(path: Path, name: str, said: str) -> Any:
    if said not in _TYPES:
        raise CheckpointError(
            f"{path.name} takes {said} as its input {name}; a detector takes numbers: "
            f"{', '.join(_TYPES)}"
        )
    return _TYPES[said]


def _short(error: Exception) -> str:
    return " ".join(str(error).split())[:300]
