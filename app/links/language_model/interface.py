"""Interface of a language model and its answers, without importing a client."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from ippon.guidance.language.goals.goal import Goal, Request
from ippon.guidance.language.naming import ResolvedObject
from ippon.guidance.levels import Guidance
from ippon.mission.finds.second_opinion import Opinion

RULES = "rules"
"""Provider of a sentence that was read by rules."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelsAnswer:
    """Levels, with the exact prompt and reply."""

    guidance: Guidance
    prompt: str
    """The exact question."""
    reply: str
    """The exact answer, both where the model was asked twice; empty if there was none."""
    elapsed_ms: float
    from_cache: bool
    failed: str
    """Why the embedded prior was used instead of the model; empty if the model answered."""


@dataclass(frozen=True, slots=True)
class SentenceAnswer:
    """What one sentence asks for, and who read it."""

    request: Request
    provider: str
    prompt: str
    reply: str
    failed: str
    """Why rules read it instead of the model; empty if the model answered."""


@dataclass(frozen=True, slots=True)
class ObjectNames:
    """Names of objects in an image that the vocabulary lacks."""

    labels: tuple[str, ...]
    failed: str = ""
    """Why there is no answer; empty when there is one."""


class LanguageModelInterface(Protocol):
    """A language model with fallbacks: its methods do not raise, and may block for seconds."""

    @property
    def name(self) -> str:
        """Name of the provider that the operator sees."""
        ...

    def levels(
        self, ooi: ResolvedObject | str, context: str, vocabulary: Sequence[str], *, scenario: str
    ) -> LevelsAnswer:
        """Rate the proximity of every common object to a goal."""
        ...

    def read_request(self, sentence: str, previous: Sequence[Goal] = ()) -> SentenceAnswer:
        """Read what one sentence asks for, after the goals of the request before."""
        ...

    def read_picture(self, jpeg: bytes) -> SentenceAnswer:
        """Name the object that a picture shows; needs a model that takes images.

        Without an answer, the request has no goal and says why.
        """
        ...

    def name_objects(self, jpeg: bytes, vocabulary: Sequence[str]) -> ObjectNames:
        """Name objects in an image that a vocabulary lacks; needs a model that takes images."""
        ...

    def second_opinion(self, jpeg: bytes, display: str) -> Opinion:
        """Judge whether an image shows an object; needs a model that takes images.

        Args:
            jpeg: The image.
            display: The object with what tells it from others: "mug, with a dinosaur on it".
        """
        ...

    def close(self) -> None:
        """Cancel pending requests."""
        ...
