"""Key of a language model's endpoint."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

KEY_VARIABLE: Final = "IPPON_API_KEY"
"""Holds the key of the endpoint that IPPON asks, whatever its host."""
OPENAI_KEY_VARIABLE: Final = "OPENAI_API_KEY"
OPENAI_BASE_URL_VARIABLE: Final = "OPENAI_BASE_URL"
"""Names the endpoint that `OPENAI_API_KEY` is for, where that is not OpenAI's own."""
_OPENAI: Final = "openai.com"


def read_api_key(
    environment: Mapping[str, str], base_url: str, file: Path | None = None
) -> str | None:
    """Take the key from a file, else from IPPON_API_KEY, else from OPENAI_API_KEY.

    Programs of all kinds expect OPENAI_API_KEY in the environment. It is taken only for OpenAI's
    own hosts over HTTPS and for the address in OPENAI_BASE_URL, so that no other endpoint gets it.

    Args:
        environment: Variables of the process.
        base_url: Address of the endpoint.
        file: Holds the key alone; None for none.

    Raises:
        ValueError: The file cannot be read or holds more than one line.
    """
    if file is None:
        names = [KEY_VARIABLE]
        if _is_openais(base_url, environment):
            names.append(OPENAI_KEY_VARIABLE)
        keys = (environment.get(name, "").strip() for name in names)
        return next(filter(None, keys), None)
    try:
        text = file.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"cannot read the API key from {file}: {type(error).__name__}") from None
    if not text or len(text.split()) != 1:
        raise ValueError(f"{file} must hold the API key alone, on one line")
    return text


def withheld_note(environment: Mapping[str, str], base_url: str) -> str:
    """Return why OPENAI_API_KEY is not sent to an endpoint; empty where it is, or is not set."""
    is_set = bool(environment.get(OPENAI_KEY_VARIABLE, "").strip())
    if not is_set or _is_openais(base_url, environment):
        return ""
    return (
        f"{OPENAI_KEY_VARIABLE} was not sent: it is for OpenAI, or for the address in "
        f"{OPENAI_BASE_URL_VARIABLE}. Set {KEY_VARIABLE} to the key of this endpoint, or give "
        "--llm.key-file"
    )


def _is_openais(base_url: str, environment: Mapping[str, str]) -> bool:
    if base_url == environment.get(OPENAI_BASE_URL_VARIABLE):
        return True
    url = urlsplit(base_url)
    host = (url.hostname or "").lower()
    return url.scheme == "https" and (host == _OPENAI or host.endswith(f".{_OPENAI}"))
