"""A vision-language model's opinion on a find, weighed as evidence before the find is announced.

The mission hands out a request and continues to look at the find until an answer arrives or its
time is over. An answer is evidence like an image: it adds nats to the find's log-odds, which are
then compared with the threshold of object voxels.
"""

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from ippon.frame import NANOSECONDS, Frame
from ippon.guidance.prompts.opinion_prompt import Verdict
from ippon.mission.snapshot import Find

_MAX_PROBABILITY: Final = 1.0 - 1e-4
"""Bound of a find's probability before it is changed: log-odds must be finite."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SecondOpinionConfig:
    """Weight of a vision-language model's answer.

    The weights are set by hand: a yes is worth less than one clear image of a detector, and a no
    outweighs it. Answers of such models on crops of true and false finds were not measured.
    """

    wait_s: float = 8.0
    """Seconds of robot time after which a find is announced without an answer; more waits longer
    for a slow model."""
    yes_nats: float = 2.0
    """Nats that a yes adds to the log-odds of the find; more trusts it more."""
    no_nats: float = -3.0
    """Nats that a no adds, at most 0; less trusts it more."""
    same_m: float = 0.5
    """Distance that the centre of a find may move, as its voxels change, without being another one;
    more asks less often."""
    min_crop_px: int = 64
    """Shortest side of the part of the image that is shown; more shows more around small finds."""
    crop_margin: float = 0.5
    """Margin on each side of the find, as a fraction of its longer side; more shows more around
    it."""

    def __post_init__(self) -> None:
        """Reject weights of the wrong sign, and crops without pixels."""
        if not (0.0 <= self.wait_s <= 60.0 and self.yes_nats >= 0.0 >= self.no_nats):
            raise ValueError(
                "wait_s lies within 0 to 60, yes_nats is 0 or more, no_nats 0 or less; got "
                f"{self.wait_s}, {self.yes_nats}, {self.no_nats}"
            )
        if self.min_crop_px < 1 or self.crop_margin < 0.0:
            raise ValueError(
                "min_crop_px must be at least 1 and crop_margin at least 0; got "
                f"{self.min_crop_px}, {self.crop_margin}"
            )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OpinionRequest:
    """A question about one find."""

    number: int
    object: str
    """The object, with all that an image may show of it."""
    crop: NDArray[np.uint8]
    """(h, w, 3) RGB image around the find."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Opinion:
    """An answer, or the reason why there is none."""

    verdict: Verdict | Literal["none"]
    text: str = ""
    """The reason in the model's words, or the failure."""
    by: str = ""
    """Name of the model."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Weighed:
    """A find with the opinion on it."""

    find: Find
    """The find with its probability after the answer."""
    waiting: bool = False
    opinion: Opinion | None = None
    """None if no model was asked."""

    @property
    def sentence(self) -> str:
        """The text for the operator; empty if no model was asked."""
        one = self.opinion
        if one is None:
            return ""
        by = one.by or "the model"
        said = {
            "none": "no second opinion",
            "yes": f"{by} agrees",
            "no": f"{by} disagrees",
            "unsure": f"{by} is unsure",
        }[one.verdict]
        return f"{said}: {one.text}" if one.text else said


@dataclass(slots=True)
class _Asked:
    number: int
    goal_id: int
    find: Find
    since_ns: int
    opinion: Opinion | None = None


class SecondOpinions:
    """Requests one opinion on each find; inactive until `ask` is set.

    Args:
        config: Weight of the answers.
    """

    def __init__(self, config: SecondOpinionConfig) -> None:
        self.ask: Callable[[OpinionRequest], None] | None = None
        """Takes a request and returns at once; the answer arrives by `answer`."""
        self._config = config
        self._asked: list[_Asked] = []
        self._number = 0

    def answer(self, number: int, opinion: Opinion) -> bool:
        """Set the answer to a request; returns whether it is still pending."""
        for one in self._asked:
            if one.number == number and one.opinion is None:
                one.opinion = opinion
                return True
        return False

    def weigh(
        self, find: Find, goal_id: int, described: str, frame: Frame, running: Collection[int]
    ) -> Weighed:
        """Return a find with the opinion on it; the first call requests one.

        Args:
            find: The find that would be announced.
            goal_id: Goal of the search.
            described: The object with all that an image may show of it.
            frame: The present frame.
            running: Goals of all running searches; what was asked for others is forgotten.
        """
        if self.ask is None:
            return Weighed(find=find)
        self._asked = [one for one in self._asked if one.goal_id in running]
        mine = (one for one in self._asked if one.goal_id == goal_id)
        asked = next((one for one in mine if self._is_same(one.find, find)), None)
        if asked is None:
            if find.box_px is None:
                return Weighed(find=find)
            self._number += 1
            asked = _Asked(self._number, goal_id, find, frame.stamp_ns)
            self._asked.append(asked)
            crop = crop_of(self._config, frame.color, find.box_px)
            self.ask(OpinionRequest(number=self._number, object=described, crop=crop))
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
        p = min(max(find.probability, 1.0 - _MAX_PROBABILITY), _MAX_PROBABILITY)
        odds = math.log(p / (1.0 - p)) + nats
        return replace(find, probability=1.0 / (1.0 + math.exp(-odds)))

    def _is_same(self, one: Find, other: Find) -> bool:
        near_m = max(self._config.same_m, 0.5 * max(one.size_m))
        return math.dist(one.position_world, other.position_world) < near_m


def crop_of(
    config: SecondOpinionConfig, color: NDArray[np.uint8], box_px: tuple[int, int, int, int]
) -> NDArray[np.uint8]:
    """Return the (h, w, 3) part of an image around a box (u0, v0, u1, v1), with a margin."""
    height, width = color.shape[:2]
    left, top, right, bottom = box_px
    side = max(right - left, bottom - top)
    half = max(0.5 * side + config.crop_margin * side, 0.5 * config.min_crop_px)
    u, v = 0.5 * (left + right), 0.5 * (top + bottom)
    rows = slice(max(0, int(v - half)), min(height, int(v + half) + 1))
    columns = slice(max(0, int(u - half)), min(width, int(u + half) + 1))
    return np.ascontiguousarray(color[rows, columns])
