"""Requests of pages about the scene: fly to a place, name what is under the pointer, and click."""

import asyncio
import queue
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

from app.nodes.console.link.commands import ClickAction
from app.nodes.console.web.browsers import Browser

PATIENCE_S: Final = 2.0
MAX_WAITING: Final = 32
"""Requests beyond these are dropped: the page sends the next one soon."""

Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """A thing that a page wants to see."""

    browser: Browser
    centre_world: Point
    size_m: Point
    at_once: bool = False
    """Without a flight."""
    thing: str = ""
    """What the page calls it; empty for a place."""
    share: float | None = None
    """Probability that it is of its kind."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hover:
    """A point of the view under the pointer of a page."""

    browser: Browser
    u: float
    """Column as a share of the view's width."""
    v: float
    """Row as a share of its height."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClickChoice:
    """What a click on the map or the plan does in a page."""

    tool: ClickAction
    brush_m: float
    """Radius of the brush in metres."""


_Q = TypeVar("_Q")
_A = TypeVar("_A")


class _Questions(Generic[_Q, _A]):
    """Questions of pages that the scene thread answers."""

    def __init__(self, otherwise: _A) -> None:
        """Begin without a question; `otherwise` is the answer where none comes in time."""
        self._otherwise = otherwise
        self._waiting: queue.SimpleQueue[tuple[_Q, Future[_A]]] = queue.SimpleQueue()

    async def ask(self, question: _Q) -> _A:
        """Return the scene thread's answer."""
        if self._waiting.qsize() >= MAX_WAITING:
            return self._otherwise
        future: Future[_A] = Future()
        self._waiting.put((question, future))
        try:
            async with asyncio.timeout(PATIENCE_S):
                return await asyncio.wrap_future(future)
        except TimeoutError:
            return self._otherwise

    def answer(self, answer_of: Callable[[_Q], _A]) -> None:
        """Answer all that wait."""
        while not self._waiting.empty():
            question, future = self._waiting.get()
            if future.set_running_or_notify_cancel():
                future.set_result(answer_of(question))


class SceneRequests:
    """Queues the requests of the pages; the scene thread takes and answers them."""

    def __init__(self) -> None:
        self._looks: queue.SimpleQueue[Look] = queue.SimpleQueue()
        self._framings: queue.SimpleQueue[Browser] = queue.SimpleQueue()
        self._hovers = _Questions[Hover, str]("")
        self._choices = _Questions[Browser, ClickChoice | None](None)

    def look(self, look: Look) -> None:
        """Have the cameras of a browser fly to a thing, from any thread."""
        if self._looks.qsize() < MAX_WAITING:
            self._looks.put(look)

    def frame(self, browser: Browser) -> None:
        """Show the whole map again in a browser, from any thread."""
        if self._framings.qsize() < MAX_WAITING:
            self._framings.put(browser)

    async def name_under(self, hover: Hover) -> str:
        """Return the name of what is under the pointer; empty for nothing that is named."""
        return await self._hovers.ask(hover)

    async def click_choice(self, browser: Browser) -> ClickChoice | None:
        """Return what a click does in a browser.

        Returns:
            None if nothing is chosen, its pages differ, or the scene does not answer in time.
        """
        return await self._choices.ask(browser)

    def looks(self) -> list[Look]:
        """Take the things that pages want to see. Called by the scene thread."""
        taken: list[Look] = []
        while not self._looks.empty():
            taken.append(self._looks.get())
        return taken

    def framings(self) -> list[Browser]:
        """Take the browsers that want to see the whole map. Called by the scene thread."""
        taken: list[Browser] = []
        while not self._framings.empty():
            taken.append(self._framings.get())
        return taken

    def answer_hovers(self, name_of: Callable[[Hover], str]) -> None:
        """Answer what is under the pointers. Called by the scene thread."""
        self._hovers.answer(name_of)

    def answer_choices(self, choice_of: Callable[[Browser], ClickChoice | None]) -> None:
        """Answer what a click does. Called by the scene thread."""
        self._choices.answer(choice_of)
