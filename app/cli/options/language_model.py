"""Options of a language model, as several commands take them."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Llm:
    """A language model for the levels; without one the embedded prior answers alone.

    Its key comes from IPPON_API_KEY, OPENAI_API_KEY or a file; it is never logged or recorded.
    """

    model: str | None = None
    """Name of the model at its endpoint; without one, that of IPPON_LLM_MODEL."""
    base_url: str | None = None
    """Address of an OpenAI-compatible endpoint, such as http://127.0.0.1:11434/v1; without one,
    that of IPPON_LLM_BASE_URL or OPENAI_BASE_URL, or OpenAI's."""
    key_file: Path | None = None
    """File that holds the key alone, in place of the environment."""
    timeout_s: float = 30.0
    """The longest that one answer may take; the search goes on meanwhile."""
    second_opinion: bool = False
    """Before a find is announced, show a model that takes images the part of the image that shows
    it, and weigh its answer; a find waits for it 8 s at most. The part leaves this machine when the
    model is elsewhere."""
    look_every_s: float = 0.0
    """Show a model that takes images what the camera sees, this often, and let it add common
    objects to tell apart; 0 never does. Images leave this machine when the model is elsewhere."""
