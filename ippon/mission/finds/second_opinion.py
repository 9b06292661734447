"""What a vision-language model says of a find before it is announced, weighed as evidence.

The mission asks and goes on looking; somebody else answers, or nobody does. An answer is a witness
like an image: it adds nats to the find's log-odds, and the threshold that made it a find decides.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from ippon.frame import NANOSECONDS, Frame
from ippon.guidance.prompts.opinion_prompt import Verdict
from ippon.mission.snapshot import Find

_SAME_M: Final = 0.5
"""A candidate that moved less, as its voxels changed, is the one that was asked about."""
_LEAST_PX: Final = 64
"""Shorter side of what is shown of an image."""
_MARGIN: Final = 0.5
"""Of the box's longer side, on each side."""
_MOST: Final = 1.0 - 1e-4


@dataclass(frozen=True, slots=True, kw_only=True)
class SecondOpinionConfig:
    """How much a vision-language model's answer is worth.

    Set by hand, cautiously: a yes is worth less than one good look of a detector, and a no undoes
    it. Answers of such models on crops of true and false finds were not measured.
    """

    wait_s: float = 8.0
    """The longest that a find waits for its answer, in robot time; without one it is announced."""
    yes_nats: float = 2.0
    no_nats: float = -3.0

    def __post_init__(self) -> None:
        """Refuse an answer that says the opposite."""
        if not (0.0 <= self.wait_s <= 60.0 and self.yes_nats >= 0.0 >= self.no_nats):
            raise ValueError(
                "wait_s lies within 0 to 60, yes_nats is 0 or more, no_nats 0 or less; got "
                f"{self.wait_s}, {self.yes_nats}, {self.no_nats}"
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OpinionRequest:
    """What is to be asked."""

    number: int
    object: str
    """In the operator's words."""
    crop: NDArray[np.uint8]
    """(h, w, 3) RGB, the find in its middle."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Opinion:
    """An answer, or why there is none."""

    verdict: Verdict | Literal["none"]
    text: str = ""
    """The reason in the model's words, or the failure."""
    by: str = ""
    """Who answered."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Weighed:
    """A find with the opinion on it."""

    find: Find
    """With the probability after the answer."""
    waiting: bool = False
    opinion: Opinion | None = None
    """None where nobody was asked."""

    @property
    def sentence(self) -> str:
        """What the operator reads; empty where nobody was asked."""
        one = self.opinion
        if one is None:
            return ""
        reason = f": {one.text}" if one.text else ""
        if one.verdict == "none":
            return f"no second opinion{reason}"
        says = {"yes": "agrees", "no": "disagrees", "unsure": "is unsure"}[one.verdict]
        return f"{one.by or 'the model'} {says}{reason}"


@dataclass(slots=True)
class _Asked:
    number: int
    goal_id: int
    find: Find
    since_ns: int
    opinion: Opinion | None = None


class SecondOpinions:
    """Asks about each find once; off until somebody sets `ask`.

    Args:
        config: Worth of the answers.
    """

    def __init__(self, config: SecondOpinionConfig) -> None:
        self.ask: Callable[[OpinionRequest], None] | None = None
        """Takes a request and returns at once; the answer comes by `answer`."""
        self._config = config
        self._asked: list[_Asked] = []
        self._number = 0

    def answer(self, number: int, opinion: Opinion) -> bool:
        """Take an answer; returns whether its find still waits for it."""
        for one in self._asked:
            if one.number == number and one.opinion is None:
                one.opinion = opinion
                return True
        return False

    def weigh(self, find: Find, goal_id: int, display: str, frame: Frame) -> Weighed:
        """Return a find with the opinion on it; asks for one the first time.

        Args:
            find: About to be announced.
            goal_id: Of the search.
            display: The object in the operator's words.
            frame: Present image.
        """
        if self.ask is None:
            return Weighed(find=find)
        self._asked = [one for one in self._asked if one.goal_id == goal_id]
        asked = next((one for one in self._asked if _is_same(one.find, find)), None)
        if asked is None:
            if find.box_px is None:
                return Weighed(find=find)
            self._number += 1
            asked = _Asked(self._number, goal_id, find, frame.stamp_ns)
            self._asked.append(asked)
            crop = crop_of(frame.color, find.box_px)
            self.ask(OpinionRequest(number=self._number, object=display, crop=crop))
        if asked.opinion is None:
            waited_s = (frame.stamp_ns - asked.since_ns) / NANOSECONDS
            if 0.0 <= waited_s < self._config.wait_s:
                return Weighed(find=find, waiting=True)
            asked.opinion = Opinion(
                verdict="none", text=f"no answer within {self._config.wait_s:g} s"
            )
        return Weighed(find=self._with(find, asked.opinion), opinion=asked.opinion)

    def _with(self, find: Find, opinion: Opinion) -> Find:
        nats = {"yes": self._config.yes_nats, "no": self._config.no_nats}.get(opinion.verdict, 0.0)
        if nats == 0.0:
            return find
        p = min(max(find.probability, 1.0 - _MOST), _MOST)
        odds = math.log(p / (1.0 - p)) + nats
        return replace(find, probability=1.0 / (1.0 + math.exp(-odds)))


def crop_of(color: NDArray[np.uint8], box_px: tuple[int, int, int, int]) -> NDArray[np.uint8]:
    """Return the part of an image round a box, (h, w, 3), with half its side as margin."""
    height, width = color.shape[:2]
    left, top, right, bottom = box_px
    side = max(right - left, bottom - top)
    half = max(0.5 * side + _MARGIN * side, 0.5 * _LEAST_PX)
    u, v = 0.5 * (left + right), 0.5 * (top + bottom)
    rows = slice(max(0, int(v - half)), min(height, int(v + half) + 1))
    columns = slice(max(0, int(u - half)), min(width, int(u + half) + 1))
    return np.ascontiguousarray(color[rows, columns])


def _is_same(one: Find, other: Find) -> bool:
    return math.dist(one.position_world, other.position_world) < max(_SAME_M, 0.5 * max(one.size_m))
