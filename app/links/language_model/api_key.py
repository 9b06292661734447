"""Key of a language model's endpoint."""

from collections.abc import Mapping
from pathlib import Path

KEY_VARIABLES = ("IPPON_API_KEY", "OPENAI_API_KEY")


def read_api_key(environment: Mapping[str, str], file: Path | None = None) -> str | None:
    """Take the key from a file, or else from the first variable of `KEY_VARIABLES` that is set.

    Raises:
        ValueError: The file cannot be read or holds more than one line.
    """
    if file is None:
        keys = (environment.get(name, "").strip() for name in KEY_VARIABLES)
        return next(filter(None, keys), None)
    try:
        text = file.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"cannot read the API key from {file}: {type(error).__name__}") from None
    if not text or len(text.split()) != 1:
        raise ValueError(f"{file} must hold the API key alone, on one line")
    return text
