"""Device of a network, and handling of memory exhaustion."""

from collections.abc import Generator
from contextlib import contextmanager

import torch

from ippon.segmentation.config import Precision
from ippon.segmentation.errors import OutOfMemoryError, SegmentationError


def choose_device(name: str) -> torch.device:
    """Return the device; `auto` is a GPU if there is one.

    Raises:
        SegmentationError: The device does not exist.
    """
    if name == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    try:
        device = torch.device(name)
    except RuntimeError as error:
        raise SegmentationError(_unknown(name)) from error
    if device.type not in {"cpu", "cuda"}:
        raise SegmentationError(_unknown(name))
    if device.type == "cuda" and not torch.cuda.is_available():
        raise SegmentationError(
            f"this torch ({torch.__version__}) sees no GPU; take --segmentation.device cpu, or "
            "install a torch built for CUDA"
        )
    if device.type == "cuda" and (device.index or 0) >= torch.cuda.device_count():
        raise SegmentationError(
            f"there is no {name}: torch sees {torch.cuda.device_count()} GPUs, numbered from 0"
        )
    return device


def _unknown(name: str) -> str:
    return f"a device is auto, cpu, cuda or cuda:N; got {name!r}"


def choose_dtype(precision: Precision, device: torch.device) -> torch.dtype:
    """Return the precision; `auto` is half precision on a GPU, float32 elsewhere."""
    if precision == "auto":
        return torch.float16 if device.type == "cuda" else torch.float32
    return {"float32": torch.float32, "float16": torch.float16, "bfloat16": torch.bfloat16}[
        precision
    ]


@contextmanager
def memory_guard(what: str) -> Generator[None]:
    """Convert a failed allocation to an error with advice.

    Raises:
        OutOfMemoryError: In place of torch's error.
    """
    try:
        yield
    except torch.OutOfMemoryError as error:
        raise OutOfMemoryError(_advice(what)) from error
    except (RuntimeError, MemoryError) as error:
        # On the CPU torch raises a RuntimeError for it.
        if isinstance(error, RuntimeError) and "allocate memory" not in str(error):
            raise
        raise OutOfMemoryError(_advice(what)) from error


def _advice(what: str) -> str:
    return (
        f"memory ran out in {what}; a smaller --segmentation.short-side-px, "
        "--segmentation.precision float16 on a GPU, or --segmentation.device cpu may fit"
    )
