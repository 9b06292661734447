"""Reader of the released checkpoints."""

import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file
from torch import Tensor

from ippon.segmentation.backends.san.architecture import RELEASED, SanArchitecture
from ippon.segmentation.backends.san.network import SanNetwork
from ippon.segmentation.backends.san.tokenizer import FILE_NAMES, ClipTokenizer
from ippon.segmentation.errors import WITHOUT_NETWORK, CheckpointError

PROJECT_PAGE: Final = "https://github.com/MendelXu/SAN"
WEIGHTS_PAGE: Final = "https://huggingface.co/Mendel192/san"
MERGES_PAGE: Final = "https://github.com/openai/CLIP (clip/bpe_simple_vocab_16e6.txt.gz)"
_TRAINING_ONLY: Final = ("criterion.",)
_WIDTH_KEY: Final = "clip_visual_extractor.conv1.weight"


def find_checkpoint(model: str, folder: Path) -> Path:
    """Return the file of a model given by name or path.

    Args:
        model: A name of `RELEASED`, a file, or a folder that holds one; empty for the smaller.
        folder: Folder of checkpoints that are given by name.

    Raises:
        CheckpointError: There is no such file; the message says which file belongs where.
    """
    name = model or "san_vit_b_16"
    known = Path(name).stem in RELEASED
    places = [folder, Path()] if known else [Path()]
    files = (f"{name}.pth", f"{name}.safetensors", name)
    found = next((p / f for p in places for f in files if (p / f).is_file()), None)
    if found is None and Path(name).is_dir():
        inside = [Path(name) / f"{r}{s}" for r in RELEASED for s in (".pth", ".safetensors")]
        found = next((path for path in inside if path.is_file()), None)
    if found is not None:
        return found
    if not known:
        raise CheckpointError(
            f"there is no checkpoint at {name}; give a file, or one of {', '.join(RELEASED)}"
        )
    raise CheckpointError(
        f"the weights of SAN are not on this machine: put {Path(name).stem}.pth (from "
        f"{WEIGHTS_PAGE}, project page {PROJECT_PAGE}) into {folder}. {WITHOUT_NETWORK}"
    )


def find_tokenizer(checkpoint: Path) -> ClipTokenizer:
    """Load the list of merges beside a checkpoint.

    Raises:
        CheckpointError: The list is missing or damaged.
    """
    paths = [checkpoint.parent / name for name in FILE_NAMES]
    found = next((path for path in paths if path.is_file()), None)
    if found is None:
        raise CheckpointError(
            f"SAN reads labels with CLIP's list of merges: put {FILE_NAMES[0]} (from "
            f"{MERGES_PAGE}), or Hugging Face's {FILE_NAMES[1]} of any CLIP, beside {checkpoint}"
        )
    return ClipTokenizer.load(found)


def load_network(path: Path, architecture: SanArchitecture | None = None) -> SanNetwork:
    """Return the network of a checkpoint, with its weights.

    Args:
        path: A `.pth` as released, or the same weights as `.safetensors`.
        architecture: None to derive it from the weights.

    Raises:
        CheckpointError: Unreadable, or not the weights of a SAN.
    """
    state = {
        name: tensor for name, tensor in _read(path).items() if not name.startswith(_TRAINING_ONLY)
    }
    return network_of(state, architecture or _architecture_of(state, path), str(path))


def network_of(
    state: Mapping[str, Tensor], architecture: SanArchitecture, source: str
) -> SanNetwork:
    """Return a network with given weights.

    Raises:
        CheckpointError: Weights are missing, unknown, or of another shape.
    """
    with torch.device("meta"):
        network = SanNetwork(architecture)
    weights = {"ov_classifier.attn_mask": _causal(architecture), **state}
    _check(weights, network.state_dict(), source)
    network.load_state_dict(weights, assign=True)
    return network.float().eval().requires_grad_(requires_grad=False)


def _read(path: Path) -> dict[str, Tensor]:
    try:
        if path.suffix == ".safetensors":
            return load_file(path)
        # Weights only: an untrusted checkpoint must not run code.
        content: Any = torch.load(path, map_location="cpu", weights_only=True)
    except (SafetensorError, pickle.UnpicklingError, RuntimeError, OSError, EOFError) as error:
        reason = str(error).split("\n", maxsplit=1)[0][:200]
        raise CheckpointError(
            f"{path} is not a checkpoint of weights ({reason}); "
            f"download it again from {WEIGHTS_PAGE}"
        ) from error
    state = content.get("model", content) if isinstance(content, dict) else None
    if not isinstance(state, dict) or not all(isinstance(v, Tensor) for v in state.values()):
        raise CheckpointError(f"{path} holds no weights by name; SAN's are at {WEIGHTS_PAGE}")
    return state


def _architecture_of(state: Mapping[str, Tensor], path: Path) -> SanArchitecture:
    first = state.get(_WIDTH_KEY)
    width = None if first is None else first.shape[0]
    for architecture in RELEASED.values():
        if width == architecture.clip_width:
            return architecture
    what = f"{_WIDTH_KEY} is {tuple(first.shape)}" if first is not None else f"no {_WIDTH_KEY}"
    raise CheckpointError(
        f"{path} is not a released SAN ({what}, {len(state)} weights); {WEIGHTS_PAGE} has "
        f"{' and '.join(RELEASED)}"
    )


def _check(state: Mapping[str, Tensor], expected: Mapping[str, Tensor], source: str) -> None:
    wrong = [
        f"{name} is {tuple(state[name].shape)}, not {tuple(expected[name].shape)}"
        for name in expected
        if name in state and state[name].shape != expected[name].shape
    ]
    problems = {
        "missing": sorted(expected.keys() - state.keys()),
        "unknown": sorted(state.keys() - expected.keys()),
        "of another shape": wrong,
    }
    said = [f"{len(names)} {k} ({', '.join(names[:3])})" for k, names in problems.items() if names]
    if said:
        raise CheckpointError(f"{source} does not fit the network: weights {'; '.join(said)}")


def _causal(architecture: SanArchitecture) -> Tensor:
    context = architecture.text_context
    return torch.full((context, context), float("-inf")).triu(1)
