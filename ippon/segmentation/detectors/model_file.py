"""Opening of detector files with the matching library."""

import importlib
from pathlib import Path
from typing import Final

from ippon.segmentation.detectors.network import Network
from ippon.segmentation.errors import CheckpointError, MissingPackageError

DETECTOR_HINT: Final = 'pip install "ippon[detector]", or scripts/setup --detector'
HUB_FOLDER: Final = "onnx"
"""Folder of a repository of the Hugging Face hub with its models; their description is above it."""
_SMALLEST: Final = 16
"""Bytes; no network is smaller."""
_PICKLES: Final = frozenset({".pt", ".pth", ".pkl", ".pickle", ".ckpt"})
_PICKLE_MARKS: Final = (b"PK\x03\x04", b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05")
"""First bytes of files of torch.save and pickle."""


def open_network(path: Path, *, device: str, threads: int, input_px: int) -> Network:
    """Load a detector's file.

    Args:
        path: An .onnx file, or an ncnn .param file with its .bin beside it.
        device: `auto`, `cpu`, `cuda` or `cuda:N`.
        threads: CPU cores; 0 for all.
        input_px: Side of the input if the file leaves it open; 0 for the default.

    Raises:
        CheckpointError: The file is missing, damaged, or of another type.
        MissingPackageError: The library for it is not installed.
        SegmentationError: The device does not exist.
    """
    path = _checked(path)
    package = "ncnn" if path.suffix.lower() == ".param" else "onnxruntime"
    try:
        importlib.import_module(package)
    except ImportError as error:
        raise MissingPackageError(
            f"detectors in {path.suffix.lower()} files need {package}: {DETECTOR_HINT}"
        ) from error
    if package == "ncnn":
        from ippon.segmentation.detectors.ncnn_network import NcnnNetwork  # noqa: PLC0415

        return NcnnNetwork(path, device=device, threads=threads, input_px=input_px)
    from ippon.segmentation.detectors.onnx_network import OnnxNetwork  # noqa: PLC0415

    return OnnxNetwork(path, device=device, threads=threads)


def find_model(model: str, folder: Path) -> Path:
    """Return the path of a model given by path, or by name in the folder of models.

    Raises:
        CheckpointError: No model is given.
    """
    if not model:
        raise CheckpointError(
            "the detector needs its file: --segmentation.model FILE, an .onnx file or an ncnn "
            ".param file with its .bin beside it"
        )
    path = Path(model)
    return path if path.exists() or path.is_absolute() else folder / path


def _checked(path: Path) -> Path:
    """Return the file to open, after checking its first bytes.

    Raises:
        CheckpointError: The file is not of a supported type.
    """
    suffix = path.suffix.lower()
    if not path.exists():
        raise CheckpointError(f"there is no {path}; a detector is an .onnx or an ncnn .param file")
    if not path.is_file():
        raise CheckpointError(
            f"{path} is not a file; a detector is an .onnx or an ncnn .param file"
        )
    with path.open("rb") as file:
        head = file.read(64)
    if suffix in _PICKLES or head.startswith(_PICKLE_MARKS):
        raise CheckpointError(
            f"{path.name} is a PyTorch file: it may contain code that runs when it is opened, so "
            "it is not opened. Export it to ONNX where you trust it (torch.onnx.export, "
            "'yolo export format=onnx', or the export script of its repository)"
        )
    if suffix == ".bin" and path.with_suffix(".param").is_file():
        return path.with_suffix(".param")
    if suffix not in {".onnx", ".param"}:
        raise CheckpointError(
            f"{path.name} is not a detector file: .onnx, or an ncnn .param with its .bin beside it"
        )
    if len(head) < _SMALLEST:
        raise CheckpointError(f"{path.name} is empty or cut off: it has {len(head)} bytes")
    if suffix == ".onnx" and head.isascii() and head.decode("ascii").isprintable():
        raise CheckpointError(
            f"{path.name} is not an ONNX file: it is text that begins with {head[:30].decode()!r}"
        )
    return path
