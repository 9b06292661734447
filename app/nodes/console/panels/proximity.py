"""Proximity levels of the current search: levels, reasons, source, and corrections."""

from collections.abc import Callable
from typing import Any, Final, get_args

import viser

from app.messages.status import LevelTable
from app.nodes.console.link.commands import Actions, CommandError
from app.nodes.console.panels import markup
from app.nodes.console.panels.markup import attempt
from app.view.colors import QUIET
from ippon.guidance.levels import LevelName

MAX_LABEL: Final = 40
MAX_CONTEXT: Final = 2000
_NO_LABEL: Final = "–"


class ProximityPanel:
    """Builds its part of the Search tab inside the current container."""

    def __init__(self, gui: Any, actions: Actions) -> None:
        self._actions = actions
        self._labels: dict[str, str] = {}
        """By their names."""
        self._table: LevelTable | None = None
        say = self._words = actions.say
        self._levels = gui.add_html(markup.levels(None, say))
        title = say("panel.levels.reasons" if actions.recorded else "panel.levels.corrections")
        with gui.add_folder(title, expand_by_default=False):
            if not actions.recorded:
                self._build_corrections(gui)
            self._question = gui.add_button(
                say("panel.levels.question"),
                color=QUIET,
                icon=viser.Icon.MESSAGE_2,
                hint=say("panel.levels.question.hint"),
                visible=False,
            )
            self._question.on_click(self._show_conversation)
            self._reasons = gui.add_html(markup.reasons(None, say))

    def show(self, table: LevelTable) -> None:
        """Show the levels of a search."""
        self._table = table
        self._levels.content = markup.levels(table, self._words)
        self._reasons.content = markup.reasons(table, self._words)
        self._question.visible = bool(table.prompt)
        labels = self._words.choices(row.label for row in table.rows)
        if labels and labels != self._labels and not self._actions.recorded:
            self._labels = labels
            # A level that nobody chose is no part of "What if?".
            self._label.options = (_NO_LABEL, *labels)

    def _build_corrections(self, gui: Any) -> None:
        say = self._words
        self._names: dict[str, LevelName] = {
            say(f"panel.level.{level}"): level for level in get_args(LevelName)
        }
        self._label = gui.add_dropdown(say("panel.levels.kind"), (_NO_LABEL,))
        self._level = gui.add_dropdown(
            say("panel.levels.level"), tuple(self._names), initial_value=say("panel.level.near")
        )
        change = gui.add_button(say("panel.levels.change"), color=QUIET)
        change.on_click(lambda _: self._try(self._change_level))
        self._known = gui.add_text(
            say("panel.levels.suppose"), "", hint=say("panel.levels.suppose.hint")
        )
        what_if = gui.add_button(
            say("panel.levels.what_if"),
            color=QUIET,
            icon=viser.Icon.HELP,
            hint=say("panel.levels.what_if.hint"),
        )
        what_if.on_click(lambda _: self._try(self._what_if))
        self._answer = gui.add_html("")
        self._more = gui.add_text(say("panel.levels.new"), "", hint=say("panel.levels.new.hint"))
        add = gui.add_button(say("panel.levels.add"), color=QUIET, icon=viser.Icon.PLUS)
        add.on_click(lambda _: self._try(self._add_label))

    def _try(self, command: Callable[[], str]) -> None:
        """Run a command and show its result here, because the top of the tab may be out of view."""
        attempt(self._answer, command)

    def _change_level(self) -> str:
        label, level = self._chosen(), self._names[self._level.value]
        if label is None:
            raise CommandError(
                self._words("panel.levels.choose" if self._labels else "panel.levels.first")
            )
        return self._actions.set_level(label, level)

    def _chosen(self) -> str | None:
        return self._labels.get(self._label.value)

    def _what_if(self) -> str:
        label, context = self._chosen(), self._known.value.strip()
        level = self._names[self._level.value]
        levels: dict[str, LevelName] = {} if label is None else {label: level}
        if len(context) > MAX_CONTEXT:
            raise CommandError(self._words("panel.search.long", most=MAX_CONTEXT, n=len(context)))
        reply = self._actions.preview(context or None, levels)
        changed = ", ".join(reply.changed[:6]).replace("_", " ")
        changed = changed or self._words("panel.levels.unchanged")
        key = "panel.levels.same" if reply.same else "panel.levels.then"
        return self._words(key, now=reply.now, then=reply.then, changed=changed)

    def _add_label(self) -> str:
        label = self._more.value.strip()
        if not 1 <= len(label) <= MAX_LABEL:
            raise CommandError(self._words("panel.levels.add.long", most=MAX_LABEL))
        done = self._actions.add_label(label)
        self._more.value = ""
        return done

    def _show_conversation(self, event: Any) -> None:
        table = self._table
        if table is None or event.client is None:
            return
        gui = event.client.gui
        with gui.add_modal(self._words("panel.levels.question")) as modal:
            gui.add_html(markup.conversation(table, self._words))
            close = gui.add_button(self._words("panel.chat.close"))
        close.on_click(lambda _: modal.close())
