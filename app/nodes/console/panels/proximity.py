"""Proximity levels of the current search: levels, reasons, source, and corrections."""

from collections.abc import Callable
from typing import Any, Final, get_args

import viser

from app.messages.status import LevelTable
from app.nodes.console.link.commands import Actions, CommandError
from app.nodes.console.panels import markup
from app.view.colors import QUIET
from ippon.guidance.levels import LevelName

MAX_LABEL: Final = 40
MAX_CONTEXT: Final = 2000
_NO_LABEL: Final = "–"


class ProximityPanel:
    """Builds its part of the Search tab inside the current container."""

    def __init__(self, gui: Any, actions: Actions) -> None:
        self._actions = actions
        self._labels: tuple[str, ...] = ()
        self._table: LevelTable | None = None
        self._levels = gui.add_html(markup.levels(None))
        title = "Reasons" if actions.recorded else "Reasons and corrections"
        with gui.add_folder(title, expand_by_default=False):
            if not actions.recorded:
                self._build_corrections(gui)
            self._question = gui.add_button(
                "Question and answer",
                color=QUIET,
                icon=viser.Icon.MESSAGE_2,
                hint="The exact prompt to the language model and its reply",
                visible=False,
            )
            self._question.on_click(self._show_conversation)
            self._reasons = gui.add_html(markup.reasons(None))

    def show(self, table: LevelTable) -> None:
        """Show the levels of a search."""
        self._table = table
        self._levels.content = markup.levels(table)
        self._reasons.content = markup.reasons(table)
        self._question.visible = bool(table.prompt)
        labels = tuple(sorted(row.label for row in table.rows))
        if labels and labels != self._labels and not self._actions.recorded:
            self._labels = labels
            self._label.options = labels

    def _build_corrections(self, gui: Any) -> None:
        self._label = gui.add_dropdown("Object kind", (_NO_LABEL,))
        self._level = gui.add_dropdown("Level", get_args(LevelName), initial_value="near")
        change = gui.add_button("Change the level", color=QUIET)
        change.on_click(lambda _: self._try(self._change_level))
        self._known = gui.add_text(
            "Suppose", "", hint='Context to try, for example "it is next to the bed"'
        )
        what_if = gui.add_button(
            "What if?",
            color=QUIET,
            icon=viser.Icon.HELP,
            hint="Shows the next viewpoint with this level and context; the search does not change",
        )
        what_if.on_click(lambda _: self._try(self._what_if))
        self._answer = gui.add_html("")
        self._more = gui.add_text(
            "New kind",
            "",
            hint="Another kind of object to recognise from now on, for example bookcase",
        )
        add = gui.add_button("Add this kind", color=QUIET, icon=viser.Icon.PLUS)
        add.on_click(lambda _: self._try(self._add_label))

    def _try(self, command: Callable[[], str]) -> None:
        """Run a command and show its result here, because the top of the tab may be out of view."""
        try:
            self._answer.content = markup.answer(command(), ok=True)
        except CommandError as error:
            self._answer.content = markup.answer(str(error), ok=False)

    def _change_level(self) -> str:
        label, level = self._label.value, self._level.value
        if label == _NO_LABEL:
            raise CommandError("Start a search first, then change its levels.")
        return self._actions.set_level(label, level)

    def _what_if(self) -> str:
        label, context = self._label.value, self._known.value.strip()
        levels: dict[str, LevelName] = {} if label == _NO_LABEL else {label: self._level.value}
        if len(context) > MAX_CONTEXT:
            raise CommandError(f"At most {MAX_CONTEXT} characters; this is {len(context)}.")
        reply = self._actions.preview(context or None, levels)
        changed = ", ".join(reply.changed[:6]).replace("_", " ") or "no level would change"
        if reply.same:
            return f"The choice would not change: {reply.now} ({changed})."
        return f"Now {reply.now}. It would be {reply.then} ({changed})."

    def _add_label(self) -> str:
        label = self._more.value.strip()
        if not 1 <= len(label) <= MAX_LABEL:
            raise CommandError(f"Type one to {MAX_LABEL} characters, for example: bookcase")
        done = self._actions.add_label(label)
        self._more.value = ""
        return done

    def _show_conversation(self, event: Any) -> None:
        table = self._table
        if table is None or event.client is None:
            return
        gui = event.client.gui
        with gui.add_modal("Question and answer") as modal:
            gui.add_html(markup.conversation(table))
            close = gui.add_button("Close")
        close.on_click(lambda _: modal.close())
