"""`--llm...`: the language model, from the command line or the environment."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import platformdirs

from app.cli.options.language_model import Llm
from app.errors import UsageError
from ippon import extensions

if TYPE_CHECKING:
    from app.links.language_model.interface import LanguageModelInterface

INSTALLED = "installed:"
"""Prefix of a provider that another package adds."""
MODEL_VARIABLE = "IPPON_LLM_MODEL"
BASE_URL_VARIABLES = ("IPPON_LLM_BASE_URL", "OPENAI_BASE_URL")
OPENAI_URL = "https://api.openai.com/v1"


def make_model(options: Llm, environment: Mapping[str, str]) -> "LanguageModelInterface | None":
    """Return the language model, None if none is named; then only the prior is used.

    Raises:
        UsageError: The settings contradict each other, or the key cannot be read.
    """
    if not options.look_every_s >= 0.0:
        raise UsageError(f"--llm.look-every-s is 0 or more seconds; got {options.look_every_s:g}")
    model = options.model or environment.get(MODEL_VARIABLE, "")
    if not model:
        if options.base_url is not None or options.key_file is not None:
            raise UsageError(
                f"--llm.base-url and --llm.key-file need a model: name it with --llm.model or "
                f"{MODEL_VARIABLE}"
            )
        if options.second_opinion or options.look_every_s > 0.0:
            raise UsageError(
                "--llm.second-opinion and --llm.look-every-s (second_opinion and look_every_s in a "
                f"file) show images to a model: name it with --llm.model or {MODEL_VARIABLE}"
            )
        return None
    if model.startswith(INSTALLED):
        try:
            make = extensions.load(extensions.LANGUAGE_MODELS, model.removeprefix(INSTALLED))
        except extensions.ExtensionError as error:
            raise UsageError(f"--llm: {error}") from error
        return make(options.timeout_s)
    base_url = options.base_url or next(
        (url for name in BASE_URL_VARIABLES if (url := environment.get(name))), OPENAI_URL
    )
    from app.links.language_model.api_key import read_api_key, withheld_note
    from app.links.language_model.chat import ChatConfig
    from app.links.language_model.language_model import LanguageModel

    try:
        key = read_api_key(environment, base_url, options.key_file)
        config = ChatConfig(
            base_url=base_url,
            model=model,
            api_key=key,
            without_key=withheld_note(environment, base_url),
            timeout_s=options.timeout_s,
        )
    except ValueError as error:
        raise UsageError(f"--llm: {error}") from error
    if key is None and base_url == OPENAI_URL:
        raise UsageError(
            "OpenAI requires a key: set OPENAI_API_KEY or give --llm.key-file; for a model on this "
            "machine give its address, such as --llm.base-url http://127.0.0.1:11434/v1"
        )
    return LanguageModel(config, cache_dir=cache_folder())


def cache_folder() -> Path:
    """Return the folder of cached answers."""
    return platformdirs.user_cache_path("ippon") / "levels"


def as_arguments(options: Llm) -> tuple[str, ...]:
    """Return arguments with which another process uses the same model."""
    given = {
        "--llm.model": options.model,
        "--llm.base-url": options.base_url,
        "--llm.key-file": None if options.key_file is None else str(options.key_file.absolute()),
        "--llm.timeout-s": str(options.timeout_s),
        "--llm.look-every-s": str(options.look_every_s),
    }
    words = tuple(word for name, value in given.items() if value for word in (name, value))
    # Also where it is off: the other process may read a file in which it is on.
    opinion = "second-opinion" if options.second_opinion else "no-second-opinion"
    return (*words, f"--llm.{opinion}")
