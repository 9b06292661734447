"""Options of a language model, shared by several commands."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Llm:
    """A language model that rates proximity levels; without one, the embedded prior is used.

    The API key comes from a file, IPPON_API_KEY, or OPENAI_API_KEY, which is sent only to OpenAI
    and to the address in OPENAI_BASE_URL; no key is logged or recorded.
    """

    model: str | None = None
    """Name of the model at its endpoint, or installed:NAME for a provider that another package
    adds; by default IPPON_LLM_MODEL."""
    base_url: str | None = None
    """Address of an OpenAI-compatible endpoint, such as http://127.0.0.1:11434/v1; by default
    IPPON_LLM_BASE_URL, OPENAI_BASE_URL, or OpenAI's."""
    key_file: Path | None = None
    """File that contains only the API key; overrides the environment."""
    timeout_s: float = 30.0
    """Maximum time for one answer; the search continues meanwhile."""
    second_opinion: bool = False
    """Before a find is announced, send the part of the image that shows it to a model that takes
    images, and weigh its answer; a find waits at most 8 s. The image part leaves this machine if
    the model runs elsewhere."""
    look_every_s: float = 0.0
    """Interval at which the camera image is sent to a model that takes images, which may add common
    objects to recognise; 0 sends none. Images leave this machine if the model runs elsewhere."""
