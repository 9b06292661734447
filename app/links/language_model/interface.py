"""What a language model is asked for, and its answers; loads no client of one."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from ippon.guidance.language.naming import ResolvedObject
from ippon.guidance.language.sentence import Query
from ippon.guidance.levels import Guidance

RULES = "rules"
"""Provider of a sentence that no model read."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelsAnswer:
    """Levels, and what was said to get them."""

    guidance: Guidance
    prompt: str
    """The exact question."""
    reply: str
    """The exact answer, both where the model was asked twice; empty if there was none."""
    elapsed_ms: float
    from_cache: bool
    failed: str
    """Why the embedded prior answered in the model's place; empty when the model did."""


@dataclass(frozen=True, slots=True)
class SentenceAnswer:
    """Object and context of one sentence, and who read them."""

    query: Query
    provider: str
    prompt: str
    reply: str
    failed: str
    """Why rules read it in the model's place; empty when the model did."""


@dataclass(frozen=True, slots=True)
class ObjectNames:
    """Things in an image that were not told apart yet."""

    labels: tuple[str, ...]
    failed: str = ""
    """Why there is no answer; empty when there is one."""


class LanguageModelInterface(Protocol):
    """Whoever answers in a model's place where it does not: never raises, may take its time."""

    @property
    def name(self) -> str:
        """What the operator sees as provider."""
        ...

    def levels(
        self, ooi: ResolvedObject | str, context: str, vocabulary: Sequence[str], *, scenario: str
    ) -> LevelsAnswer:
        """Rate the proximity of every common object to a goal."""
        ...

    def read_query(self, sentence: str) -> SentenceAnswer:
        """Read object and context from one sentence."""
        ...

    def name_objects(self, jpeg: bytes, vocabulary: Sequence[str]) -> ObjectNames:
        """Name things in an image that a vocabulary lacks; for models that take images."""
        ...

    def close(self) -> None:
        """End what is under way."""
        ...
