"""The fields and the button of a search, of which each browser has its own.

Two people who type at the same time would write into each other's text otherwise.
"""

from collections.abc import Callable, Sequence
from typing import Any, Final

import viser

from app.messages.control import SearchRequest
from app.nodes.console.panels.last_questions import Question
from app.view.drawing.viser_private import ignore_disconnect, uuid_of
from app.view.words import Words
from ippon.guidance.language.goals.goal import Goal
from ippon.guidance.language.requests.sentence import is_name

USUAL_SCENARIO: Final = SearchRequest(object="hat").scenario


class QueryForm:
    """Builds the fields of one browser inside the current container."""

    def __init__(
        self,
        client: Any,
        say: Words,
        draft: Question | None,
        ask: Callable[["QueryForm"], None],
        keep: Callable[[Question], None],
    ) -> None:
        """Add the controls.

        Args:
            client: viser's, of the browser.
            say: The words of the controls.
            draft: What stands in the fields; None for what stands in those of a new browser.
            ask: Called when the browser asks for what stands in them.
            keep: Told what stands in them, as it is typed.
        """
        self._client = client
        self._proposed = ("", "", "")
        """Object and context of a doubtful reading, and the context that stood there before."""
        self._held: tuple[tuple[str, str], Sequence[Goal]] | None = None
        """Object and context that stand beside a doubtful reading, and its goals."""
        gui = client.gui
        wanted, context, scenario = draft or ("", "", USUAL_SCENARIO)
        with gui.add_form(None) as form:
            self._wanted = gui.add_text(
                say("field.find"), wanted, hint=say("panel.search.find.hint")
            )
            self._context = gui.add_text(
                say("panel.search.context"), context, hint=say("panel.search.context.hint")
            )
            self._scenario = gui.add_text(
                say("panel.search.scenario"), scenario, hint=say("panel.search.scenario.hint")
            )
            search = gui.add_button(say("panel.search.search"), icon=viser.Icon.SEARCH)
        for field in (self._wanted, self._context, self._scenario):
            field.on_update(lambda _: keep(self.typed))
        search.on_click(lambda _: form.submit())
        form.on_submit(lambda _: ask(self))

    @property
    def typed(self) -> Question:
        """What stands in the fields."""
        return self._wanted.value, self._context.value, self._scenario.value

    @property
    def question(self) -> Question:
        """What stands in the fields, without blanks around it."""
        wanted, context, scenario = self.typed
        return wanted.strip(), context.strip(), scenario.strip()

    def asked(self) -> Question:
        """Return what is asked for, without the context of another sentence.

        A doubtful reading is written into the fields. Whoever corrects the object keeps its
        context; whoever writes another sentence does not.
        """
        wanted, context, scenario = self.question
        proposed, of_reading, own = self._proposed
        if context and context == of_reading and wanted != proposed and not is_name(wanted):
            self.write(wanted, own)
            context = own
        return wanted, context, scenario

    def propose(self, wanted: str, context: str) -> None:
        """Write a doubtful reading into the fields, to be corrected."""
        self._proposed = wanted.strip(), context.strip(), self.question[1]
        self.write(wanted, context)

    def hold(self, goals: Sequence[Goal]) -> None:
        """Keep the goals of a doubtful reading for the next press of Search."""
        self._held = self.question[:2], goals

    def take_held(self, wanted: str, context: str) -> Sequence[Goal]:
        """Return the goals kept, and keep them no longer.

        Args:
            wanted: What is asked for now; none are returned if it is something else.
            context: Its context, likewise.
        """
        held, self._held = self._held, None
        return held[1] if held is not None and held[0] == (wanted, context) else ()

    def field_uuids(self) -> set[str]:
        """Return the identifiers of the fields in messages."""
        return {uuid_of(field) for field in (self._wanted, self._context, self._scenario)}

    def write(self, wanted: str, context: str) -> None:
        """Put other words into the fields for object and context."""
        with ignore_disconnect(self._client):
            self._wanted.value, self._context.value = wanted, context
