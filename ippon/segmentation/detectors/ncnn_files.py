"""Validation of the two files of an ncnn network before ncnn reads them.

ncnn trusts its files: inconsistent layers make it read beyond its memory, and the process dies. So
the structure, and from it the size of the weights, is checked here, and then the network runs once
in a separate process.
"""

import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

from ippon.segmentation.errors import CheckpointError

MAGIC: Final = "7767517"
"""First line of every .param file of ncnn."""
MOST_LAYERS: Final = 100_000
TRIAL_S: Final = 120.0
"""Time limit for one image in the trial; the slowest detectors take a few seconds."""
_HALF, _FLOAT_TAGGED, _INT8 = 0x01306B47, 0x0002C056, 0x000D4B38
"""Tags before weights: float16; float32; int8. Without a tag they are float32."""

Parameters = Mapping[int, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Layer:
    """A line of a .param file."""

    kind: str
    name: str
    bottoms: tuple[str, ...]
    tops: tuple[str, ...]
    parameters: Parameters

    def number(self, key: int, usual: int = 0) -> int:
        """Return an integer parameter."""
        return int(self.parameters.get(key, str(usual)))

    def is_set(self, key: int, usual: int = 0) -> bool:
        """Return a flag."""
        return self.number(key, usual) != 0


def read_structure(path: Path) -> tuple[Layer, ...]:
    """Read a .param file.

    Raises:
        CheckpointError: The file is of another type, truncated, or its layers are inconsistent.
    """
    try:
        lines = path.read_text(encoding="ascii").split("\n")
    except UnicodeDecodeError as error:
        raise CheckpointError(f"{path} is not an ncnn .param file: it is not text") from error
    if not lines or lines[0].strip() != MAGIC:
        raise CheckpointError(
            f"{path} is not an ncnn .param file: it begins with {lines[0][:20]!r}, not {MAGIC}"
        )
    rows = [line.split() for line in lines[1:] if line.strip()]
    try:
        layers, blobs = (int(x) for x in rows[0]) if rows else (0, 0)
        found = tuple(_layer(row) for row in rows[1:])
    except (ValueError, IndexError) as error:
        raise CheckpointError(f"{path} is damaged: {error}") from error
    if len(found) != layers or not 0 < layers <= MOST_LAYERS:
        raise CheckpointError(
            f"{path} is damaged or cut off: it says {layers} layers and holds {len(found)}"
        )
    _check_blobs(path, found, blobs)
    return found


def _layer(row: list[str]) -> Layer:
    if len(row) < 4:
        raise ValueError(f"its line {' '.join(row)!r} is cut off")
    kind, name, n_bottoms, n_tops = row[0], row[1], int(row[2]), int(row[3])
    if n_bottoms < 0 or n_tops < 0 or len(row) < 4 + n_bottoms + n_tops:
        raise ValueError(f"layer {name} is cut off")
    ends = 4 + n_bottoms, 4 + n_bottoms + n_tops
    parameters = dict(part.split("=", 1) for part in row[ends[1] :])
    return Layer(
        kind=kind,
        name=name,
        bottoms=tuple(row[4 : ends[0]]),
        tops=tuple(row[ends[0] : ends[1]]),
        parameters={int(key): value for key, value in parameters.items()},
    )


def _check_blobs(path: Path, layers: tuple[Layer, ...], blobs: int) -> None:
    made: set[str] = set()
    for layer in layers:
        lacking = [name for name in layer.bottoms if name not in made]
        twice = [name for name in layer.tops if name in made]
        if lacking or twice:
            what = f"{lacking[0]}, which none makes before it" if lacking else f"{twice[0]} again"
            verb = "takes" if lacking else "makes"
            raise CheckpointError(f"{path} is damaged: layer {layer.name} {verb} {what}")
        made.update(layer.tops)
    if len(made) != blobs:
        raise CheckpointError(f"{path} is damaged: it says {blobs} blobs and holds {len(made)}")


def check_weights(path: Path, layers: tuple[Layer, ...]) -> None:
    """Check that a .bin file has exactly the size of a network's weights.

    Networks with unknown kinds of layers, or with int8 weights, are not checked; the trial covers
    them.

    Raises:
        CheckpointError: The size differs: the file is truncated, or of another network.
    """
    wanted = [_weights(layer) for layer in layers]
    known = [w for w in wanted if w is not None]
    if len(known) < len(wanted):
        return
    size = path.stat().st_size
    with path.open("rb") as file:
        for layer, arrays in zip(layers, known, strict=True):
            for tagged, count in arrays:
                here = file.tell()
                if not _skip(file, tagged, count, size):
                    raise CheckpointError(
                        f"{path} does not belong to its .param file, or is cut off: at byte {here} "
                        f"of {size} it lacks the {count} weights of layer {layer.name}"
                    )
        if file.tell() != size:
            raise CheckpointError(
                f"{path} does not belong to its .param file: the network has {file.tell()} bytes of"
                f" weights and the file {size}"
            )


def _skip(file: BinaryIO, tagged: bool, count: int, size: int) -> bool:
    """Skip an array; False if the file ends before it."""
    width = 4
    if tagged:
        tag = int.from_bytes(file.read(4), "little")
        if tag not in {0, _HALF, _FLOAT_TAGGED, _INT8}:
            return False
        width = {_HALF: 2, _INT8: 1}.get(tag, 4)
    length = -(-count * width // 4) * 4
    if count < 0 or file.tell() + length > size:
        return False
    file.seek(length, 1)
    return True


Arrays = list[tuple[bool, int]]
"""Whether a tag precedes it, and the number of elements of an array."""


def _filters(layer: Layer, size: int, bias: int) -> Arrays:
    return [(True, layer.number(size)), *([(False, layer.number(0))] * layer.is_set(bias))]


def _affine(channels: int, flag: int) -> Callable[[Layer], Arrays]:
    return lambda layer: [(False, layer.number(channels))] * (2 * layer.is_set(flag, 1))


def _memory(layer: Layer) -> Arrays:
    count = 1
    for key in (0, 1, 2, 11):
        count *= max(1, layer.number(key))
    return [(layer.number(21, 1) == 0, count)]


_WITH_WEIGHTS: Final[dict[str, Callable[[Layer], Arrays]]] = {
    **dict.fromkeys(
        ("Convolution", "ConvolutionDepthWise", "Deconvolution", "DeconvolutionDepthWise"),
        lambda layer: _filters(layer, 6, 5),
    ),
    "InnerProduct": lambda layer: _filters(layer, 2, 1),
    "BatchNorm": lambda layer: [(False, layer.number(0))] * 4,
    "PReLU": lambda layer: [(False, layer.number(0))],
    "Bias": lambda layer: [(False, layer.number(0))],
    "Scale": lambda layer: [(False, layer.number(0))] * (1 + layer.is_set(1)),
    "LayerNorm": _affine(0, 2),
    "InstanceNorm": _affine(0, 2),
    "GroupNorm": _affine(1, 3),
    "MemoryData": _memory,
}
_PLAIN_KINDS: Final = """
    AbsVal BinaryOp Cast Clip Concat Crop Dropout ELU Eltwise ExpandDims Flatten GELU HardSigmoid
    HardSwish Input Interp MatMul Mish Noop Packing Permute PixelShuffle Pooling ReLU Reduction
    Reshape ShuffleChannel Sigmoid Slice Softmax Split Squeeze Swish TanH Tile UnaryOp
"""
_WITHOUT_WEIGHTS: Final = frozenset(_PLAIN_KINDS.split())
_INT8_SCALES: Final = 8
"""Parameter of layers with int8 weights, whose scales follow the weights."""


def _weights(layer: Layer) -> Arrays | None:
    """Return the arrays of a layer in the .bin file; None if unknown."""
    if layer.kind in _WITHOUT_WEIGHTS:
        return []
    find = _WITH_WEIGHTS.get(layer.kind)
    if find is None:
        return None
    filters = layer.kind == "InnerProduct" or "onvolution" in layer.kind
    try:
        if filters and (layer.is_set(_INT8_SCALES) or layer.is_set(19)):
            return None
        return find(layer)
    except ValueError:
        return None


_TRIAL: Final = """
import sys
import ncnn
import numpy as np
net = ncnn.Net()
net.opt.use_vulkan_compute = False
net.opt.num_threads = 1
if net.load_param(sys.argv[1]) or net.load_model(sys.argv[2]):
    sys.exit(3)
extractor = net.create_extractor()
# ncnn reads the array itself, so the array has to outlive it.
image = np.zeros((3, int(sys.argv[3]), int(sys.argv[4])), np.float32)
extractor.input(net.input_names()[0], ncnn.Mat(image))
for name in net.output_names():
    failed, output = extractor.extract(name)
    if failed or np.array(output).size == 0:
        sys.exit(4)
"""


def try_out(param: Path, weights: Path, size: tuple[int, int]) -> None:
    """Run a network once in a separate process.

    Args:
        param: The .param file.
        weights: The .bin file.
        size: (H, W) of the input.

    Raises:
        CheckpointError: ncnn does not load it, fails, crashes or exceeds the time limit.
    """
    # The code is a constant of the program; the network's files are arguments.
    command = [sys.executable, "-P", "-c", _TRIAL, param, weights, str(size[0]), str(size[1])]
    try:
        done = subprocess.run(  # noqa: S603
            command, capture_output=True, text=True, check=False, timeout=TRIAL_S
        )
    except subprocess.TimeoutExpired as error:
        raise CheckpointError(
            f"ncnn took more than {TRIAL_S:.0f} s for one image with {param.name}"
        ) from error
    if done.returncode == 0:
        return
    said = " ".join(done.stderr.split())[-300:]
    how = {3: "does not load it", 4: "gives no output for an image"}.get(
        done.returncode, f"died with it (exit status {done.returncode})"
    )
    raise CheckpointError(
        f"ncnn {how}: {param.name} with {weights.name} and an input of {size[1]}x{size[0]}"
        f"{': ' + said if said else ''}"
    )
