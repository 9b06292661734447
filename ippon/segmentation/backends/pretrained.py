"""Models of the `transformers` library, loaded from local files only."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from huggingface_hub import try_to_load_from_cache
from safetensors import SafetensorError
from transformers import AutoTokenizer
from transformers.utils.logging import disable_progress_bar

from ippon.segmentation.errors import WITHOUT_NETWORK, CheckpointError
from ippon.segmentation.model_registry import model_folder, terms_of

IMAGENET_MEAN = (0.485, 0.456, 0.406)
IMAGENET_STD = (0.229, 0.224, 0.225)
CLIP_MEAN = (0.48145466, 0.4578275, 0.40821073)
CLIP_STD = (0.26862954, 0.26130258, 0.27577711)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pretrained:
    """A model given by name or folder."""

    model: str
    """A folder, or a name on the hub such as `CIDAS/clipseg-rd64-refined`."""
    folder: Path
    """Folder of the models; `model_folder` says where in it one lies."""

    @property
    def source(self) -> str:
        """The folder if it exists, else the name, which may be in the hub's local cache."""
        for path in (Path(self.model), model_folder(self.model, self.folder)):
            if path.is_dir():
                return str(path)
        return self.model

    @property
    def kind(self) -> str:
        """Type of the model in its config.json, such as `sam2_video`.

        Raises:
            CheckpointError: The model is not on this machine, or the file is damaged.
        """
        said = self._settings("config.json")
        if said is None:
            raise self._error(FileNotFoundError("it holds no config.json"))
        return str(said.get("model_type", ""))

    def load(self, model_class: Any, *also: str) -> Any:
        """Load all weights of a model.

        Args:
            model_class: A model class of `transformers`.
            also: Further accepted model types, whose files contain the same weights.

        Raises:
            CheckpointError: The weights are not on this machine, damaged, or of another model.
        """
        # Checked first, because the library would load a foreign file as a network of default size.
        expected = dict.fromkeys((model_class.config_class.model_type, *also))
        if self.kind not in expected:
            raise CheckpointError(
                f"{self.source} is another model: its config.json says {self.kind!r}; expected "
                f"{' or '.join(map(repr, expected))}"
            )
        # Turn off the library's progress bars.
        disable_progress_bar()
        try:
            # Weights are read from safetensors only, because pickles can run code.
            model, info = model_class.from_pretrained(
                self.source,
                local_files_only=True,
                use_safetensors=True,
                output_loading_info=True,
                dtype=torch.float32,
            )
        except (OSError, ValueError, RuntimeError, KeyError, SafetensorError) as error:
            raise self._error(error) from error
        lacking = [*sorted(info["missing_keys"]), *map(str, info["mismatched_keys"])]
        if lacking:
            raise CheckpointError(
                f"{self.source} is another model: {len(lacking)} weights are missing or of another "
                f"shape ({', '.join(lacking[:3])}); expected one for {type(model).__name__}"
            )
        return model.eval().requires_grad_(requires_grad=False)

    def tokenizer(self) -> Any:
        """Load the tokenizer in the model's folder.

        Raises:
            CheckpointError: There is no tokenizer.
        """
        try:
            return AutoTokenizer.from_pretrained(self.source, local_files_only=True)
        except (OSError, ValueError, KeyError) as error:
            raise self._error(error) from error

    def normalisation(
        self, mean: tuple[float, ...], std: tuple[float, ...]
    ) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return mean and standard deviation from the model's files, or the given ones."""
        said = self.preprocessing()
        return tuple(said.get("image_mean", mean)), tuple(said.get("image_std", std))

    def preprocessing(self) -> dict[str, Any]:
        """Return the image preprocessing in the model's files; empty if there is none.

        Raises:
            CheckpointError: The file is damaged.
        """
        said = self._settings("preprocessor_config.json")
        if said is None:
            said = (self._settings("processor_config.json") or {}).get("image_processor", {})
        return said

    def _settings(self, name: str) -> dict[str, Any] | None:
        """Read a JSON file of the folder or the hub's local cache; None if there is none."""
        if Path(self.source).is_dir():
            path = Path(self.source) / name
        else:
            try:
                path = try_to_load_from_cache(self.source, name)
            except ValueError:  # Not a valid name on the hub.
                return None
            if not isinstance(path, str):
                return None
            path = Path(path)
        if not path.is_file():
            return None
        try:
            said = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            raise CheckpointError(f"{path} is damaged: {error}") from error
        if not isinstance(said, dict):
            raise CheckpointError(f"{path} is damaged: expected a JSON object")
        return said

    def _error(self, error: Exception) -> CheckpointError:
        reason = str(error).strip().split("\n", maxsplit=1)[0][:200]
        if Path(self.source).is_dir():
            return CheckpointError(f"{self.source} is not a folder of such a model: {reason}")
        folder = model_folder(self.model, self.folder)
        return CheckpointError(
            f"the weights of {self.model}{terms_of(self.model)} are not on this machine: fetch its "
            f"folder (config.json, model.safetensors, the tokenizer's files) from "
            f"https://huggingface.co/{self.model}, "
            f'for example with "hf download {self.model} --local-dir {folder}". '
            f"{WITHOUT_NETWORK}"
        )


def tokens_of(tokenizer: Any, texts: list[str], length: int) -> torch.Tensor:
    """Return (N, length) token numbers, padded with 0 after the end token."""
    encoded = tokenizer(texts, truncation=True, max_length=length)["input_ids"]
    tokens = torch.zeros(len(texts), length, dtype=torch.long)
    for row, numbers in zip(tokens, encoded, strict=True):
        row[: len(numbers)] = torch.tensor(numbers)
    return tokens
