"""Gives a goal in plain words to the nearest free robot, for a page."""

import threading
from typing import Annotated, Final

import msgspec
import zenoh

from app.links.fleet.assignment import Assignment, assign
from app.links.fleet.bids import CredentialOf
from app.links.fleet.navigators import live_navigators
from app.links.language_model.sentence_reading import search_of
from app.links.network.requests import RequestRefusedError, ask
from app.links.network.session import LinkError, open_client
from app.links.network.topic_listener import CONNECT_S
from app.messages import keys
from app.messages.control import SearchRequest, SentenceReading, SentenceRequest
from app.messages.plain_text import as_sentence
from app.nodes.console.fleet.robot_paths import path_of
from app.nodes.console.link.panel_requests import READ_S, REQUESTER
from app.nodes.console.web.browsers import Browser
from app.nodes.console.web.permissions import request_refusal
from app.view.bid_wording import place_of, why_not
from app.view.spoken import spoken
from app.view.words import Words
from ippon.guidance.language.requests.sentence import (
    MAX_OBJECT_CHARS,
    MAX_SENTENCE_CHARS,
    is_name,
)

TURN_S: Final = 20.0
"""Time to wait while another page gives a goal."""
_MOST_READERS: Final = 2
"""Robots that are asked to read a sentence, one after another."""


class GoalToGive(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Request of a page: a goal in plain words."""

    sentence: Annotated[str, msgspec.Meta(max_length=MAX_SENTENCE_CHARS)]
    sure: bool = False
    """The reading of the sentence was shown as doubtful, and the operator wants it like this."""


class OtherRobot(msgspec.Struct, frozen=True, kw_only=True):
    """A robot that did not get the goal."""

    name: str
    path: str
    """Of its page."""
    why: str


class GoalGiven(msgspec.Struct, frozen=True, kw_only=True):
    """Reply to `GoalToGive`."""

    ok: bool
    text: str
    doubtful: bool = False
    """Nobody was asked: send it again with `sure` to give it."""
    robot: str = ""
    """Who got it; empty for nobody."""
    path: str = ""
    """Of the page of that robot."""
    others: list[OtherRobot] = []


class _UnclearError(Exception):
    """The sentence gives no search; the text is for the operator."""

    def __init__(self, text: str, *, doubtful: bool = False) -> None:
        super().__init__(text)
        self.doubtful = doubtful


class GoalAssignment:
    """One goal at a time; pages that come meanwhile wait for their turn. Safe from any thread.

    Args:
        endpoint: Of the router.
        own: The console's own robot, which reads the sentences if it is there.
        say: The words.
    """

    def __init__(self, endpoint: str, own: str, say: Words) -> None:
        self._endpoint, self._own, self._say = endpoint, own, say
        self._turn = threading.Lock()

    def give(self, goal: GoalToGive, browser: Browser, credential_of: CredentialOf) -> GoalGiven:
        """Give a goal to the best robot that takes it; waits for all answers.

        Args:
            goal: In plain words.
            browser: Whose request it is.
            credential_of: Returns what a request of the browser to a robot carries.
        """
        refusal = request_refusal(browser, SearchRequest(object="goal"), self._say)
        if refusal:
            return GoalGiven(ok=False, text=refusal)
        if not self._turn.acquire(timeout=TURN_S):
            return GoalGiven(ok=False, text=self._say("give.busy"))
        try:
            with open_client(self._endpoint, CONNECT_S) as session:
                search = self._read(session, goal)
                return self._told(search, assign(session, search, credential_of))
        except _UnclearError as error:
            return GoalGiven(ok=False, text=str(error), doubtful=error.doubtful)
        except (LinkError, zenoh.ZError) as error:
            return GoalGiven(ok=False, text=self._say.said(str(error)))
        finally:
            self._turn.release()

    def _read(self, session: zenoh.Session, goal: GoalToGive) -> SearchRequest:
        """Return the search of a sentence.

        Raises:
            _UnclearError: It gives none, or nobody could read it.
        """
        say, sentence = self._say, goal.sentence.strip()
        if not sentence:
            raise _UnclearError(say("give.empty"))
        if is_name(sentence):
            self._check_length(sentence, MAX_OBJECT_CHARS)
            return SearchRequest(object=sentence, requester=REQUESTER)
        reading = self._reading(session, sentence)
        if not reading.goals:
            raise _UnclearError(as_sentence(reading.because))
        if len(reading.goals) > 1:
            raise _UnclearError(say("give.several", n=len(reading.goals)))
        (read,) = reading.goals
        search = search_of(read, REQUESTER)
        self._check_length(search.object, MAX_OBJECT_CHARS)
        if read.refers_to:
            raise _UnclearError(say("give.refers", object=read.display))
        if reading.doubtful and not goal.sure:
            shown = ", ".join(filter(None, (say.name(search.object), search.context)))
            because = as_sentence(reading.because)
            raise _UnclearError(say("give.doubtful", goal=shown, because=because), doubtful=True)
        return search

    def _check_length(self, text: str, most: int) -> None:
        if len(text) > most:
            raise _UnclearError(self._say("give.long", most=most, n=len(text)))

    def _reading(self, session: zenoh.Session, sentence: str) -> SentenceReading:
        names = live_navigators(session)
        if not names:
            raise _UnclearError(self._say("give.none"))
        readers = sorted(names, key=lambda name: name != self._own)[:_MOST_READERS]
        problem = ""
        for name in readers:
            request, key = SentenceRequest(sentence=sentence), f"{name}/{keys.SENTENCE}"
            try:
                return spoken(ask(session, key, request, SentenceReading, READ_S), self._say)
            except (LinkError, RequestRefusedError) as error:
                problem = self._say.said(str(error))
        raise _UnclearError(self._say("give.unread", problem=problem))

    def _told(self, search: SearchRequest, result: Assignment) -> GoalGiven:
        say = self._say
        others = [
            OtherRobot(name=one.name, path=path_of(one.name), why=why_not(one, say))
            for one in result.others
        ]
        best = result.given
        if best is not None and best.bid is not None:
            place = place_of(best.bid, say)
            text = say("give.given", robot=best.name, object=say.name(search.object), place=place)
            notes: list[str] = []
            if result.accepted is not None:
                notes = [as_sentence(note) for note in spoken(result.accepted, say).notes]
            return GoalGiven(
                ok=True, text=" ".join([text, *notes]), robot=best.name, path=path_of(best.name),
                others=others,
            )  # fmt: skip
        refusals = {one.detail for one in result.others if one.problem == "refused"}
        if result.unsure is not None:
            text = say("give.unsure", robot=result.unsure.name)
        elif len(refusals) == 1 and all(one.problem == "refused" for one in result.others):
            # All say the same of the search itself.
            text = as_sentence(say.said(refusals.pop()))
        else:
            text = say("give.nobody") if others else say("give.none")
        return GoalGiven(ok=False, text=text, others=others)
