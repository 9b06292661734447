"""Fetches models from the Hugging Face hub, after logging their size and licence."""

import logging
import re
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from huggingface_hub import HfApi, snapshot_download, try_to_load_from_cache
from huggingface_hub.errors import GatedRepoError, RepositoryNotFoundError
from huggingface_hub.utils import httpx

from ippon.segmentation.model_registry import NAME_FILE, model_folder

logger = logging.getLogger(__name__)

HUB: Final = "https://huggingface.co"
_NAME: Final = re.compile(r"[A-Za-z0-9][\w.-]*/[A-Za-z0-9][\w.-]*")
_FILES: Final = ("*.json", "*.txt", "*.safetensors")
"""Configuration, tokenizer and weights; pickles are excluded, because they can run code."""
_WEIGHTS: Final = ".safetensors"
_ANSWER_S: Final = 10.0
_PARTIAL: Final = ".partial"


class ModelHubError(Exception):
    """A model could not be fetched; the text says why."""


def fetch_missing(names: Iterable[str], folder: Path, hub: str = HUB) -> None:
    """Fetch those models that are not on this machine.

    Failures are logged; loading the model then reports what is missing.

    Args:
        names: Names on the hub; paths are ignored.
        folder: Folder of the models.
        hub: Address of the hub.
    """
    for name in names:
        if not _NAME.fullmatch(name) or is_here(name, folder):
            continue
        try:
            _fetch(name, folder, hub)
        except ModelHubError as error:
            logger.warning("%s was not fetched: %s", name, error)


def is_here(name: str, folder: Path) -> bool:
    """Return whether a model is in a folder or in the hub's local cache."""
    if Path(name).is_dir() or model_folder(name, folder).is_dir():
        return True
    return isinstance(try_to_load_from_cache(name, "config.json"), str)


def _fetch(name: str, folder: Path, hub: str) -> None:
    """Fetch a model into its own folder, atomically.

    Raises:
        ModelHubError: It cannot be fetched.
    """
    target = model_folder(name, folder)
    partial = folder / (name.replace("/", "--") + _PARTIAL)
    try:
        said = HfApi(endpoint=hub).model_info(name, files_metadata=True, timeout=_ANSWER_S)
        files = {one.rfilename: one.size or 0 for one in said.siblings or ()}
        files = {path: size for path, size in files.items() if _is_taken(path)}
        licence = (said.card_data or {}).get("license") or "not stated"
        _check(files, folder, partial)
        logger.info(
            "fetching %s: %.0f MB, licence %s (%s/%s), into %s",
            name,
            sum(files.values()) / 1e6,
            licence,
            hub,
            name,
            target,
        )
        snapshot_download(
            name, revision=said.sha, local_dir=partial, allow_patterns=list(files), endpoint=hub
        )
    except GatedRepoError as error:
        raise ModelHubError(
            f"access must be granted by its owners: request it at {hub}/{name}, then run `hf "
            f"auth login`"
        ) from error
    except RepositoryNotFoundError as error:
        raise ModelHubError(f"{hub} has no such model") from error
    except (httpx.HTTPError, OSError, ValueError) as error:
        reason = " ".join(str(error).split())[:200]
        raise ModelHubError(f"{hub} cannot be reached or gave an error: {reason}") from error
    shutil.rmtree(partial / ".cache", ignore_errors=True)
    try:
        (partial / NAME_FILE).write_text(f"{name}\n", encoding="utf-8")
        partial.rename(target)
    except OSError as error:
        # Another process may have fetched the same model meanwhile.
        if not model_folder(name, folder).is_dir():
            raise ModelHubError(f"{target} cannot be written: {error.strerror}") from error


def _is_taken(path: str) -> bool:
    # Subfolders hold other formats.
    return "/" not in path and any(Path(path).match(pattern) for pattern in _FILES)


def _check(files: dict[str, int], folder: Path, partial: Path) -> None:
    if not any(path.endswith(_WEIGHTS) for path in files):
        raise ModelHubError("it holds no weights in safetensors, and pickles can run code")
    folder.mkdir(parents=True, exist_ok=True)
    # What an interrupted fetch left is not fetched again.
    here = sum(path.stat().st_size for path in partial.rglob("*") if path.is_file())
    free, needed = shutil.disk_usage(folder).free, max(0, sum(files.values()) - here)
    if free < needed:
        raise ModelHubError(
            f"it needs {needed / 1e6:.0f} MB, and {folder} has {free / 1e6:.0f} MB left"
        )
