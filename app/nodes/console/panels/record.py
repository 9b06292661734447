"""Recording controls of the Session tab: on, off, notes and marks."""

from collections.abc import Sequence
from html import escape
from typing import Any, Final

from app.messages.recording import RecordingStatus
from app.nodes.console.link.commands import Actions, RecordAction
from app.nodes.console.panels import markup
from app.nodes.console.panels.markup import attempt
from app.view.colors import QUIET
from app.view.words import Words

MAX_NOTE: Final = 2000


class RecordPanel:
    """Builds the part inside the current container."""

    def __init__(self, gui: Any, actions: Actions) -> None:
        self._actions = actions
        say = self._words = actions.say
        self._state = gui.add_html(recording_lines((), say))
        on, off, mark = (say(f"panel.record.{word}") for word in ("on", "off", "mark"))
        self._names: dict[str, RecordAction] = {on: "start", off: "stop", mark: "mark"}
        self._switch = gui.add_button_group(say("panel.record.record"), (on, off, mark))
        with gui.add_form(None) as form:
            self._text = gui.add_text(
                say("panel.record.note"), "", hint=say("panel.record.note.hint")
            )
            note = gui.add_button(say("panel.record.save"), color=QUIET)
        self._answer = gui.add_html("")
        self._switch.on_click(lambda event: self._press(event.target.value))
        note.on_click(lambda _: form.submit())
        form.on_submit(lambda _: self._note())

    def show(self, statuses: Sequence[RecordingStatus]) -> None:
        """Show what each recorder does."""
        self._state.content = recording_lines(statuses, self._words)

    def _press(self, word: str) -> None:
        attempt(self._answer, lambda: self._actions.record(self._names[word], ""))

    def _note(self) -> None:
        text = self._text.value.strip()
        if not text:
            self._answer.content = markup.answer(self._words("panel.record.empty"), ok=False)
            return
        if len(text) > MAX_NOTE:
            problem = self._words("panel.record.long", most=MAX_NOTE, n=len(text))
            self._answer.content = markup.answer(problem, ok=False)
        elif attempt(self._answer, lambda: self._actions.record("note", text)):
            self._text.value = ""


def recording_lines(statuses: Sequence[RecordingStatus], say: Words) -> str:
    """Return the state of each recorder and its warning, as HTML; several are told to be so."""
    if not statuses:
        return markup.muted(escape(say("panel.record.nobody")))
    several = say("panel.record.several", n=len(statuses)) if len(statuses) > 1 else ""
    head = f'<p class="ip-warning">{escape(several)}</p>' if several else ""
    return head + "".join(_recording_line(status, say) for status in statuses)


def _recording_line(status: RecordingStatus, say: Words) -> str:
    minutes, seconds = divmod(int(status.seconds), 60)
    text = say(
        "panel.record.lost" if status.dropped else "panel.record.running",
        time=f"{minutes}:{seconds:02d}",
        size=f"{status.written_bytes / 1e6:.0f}",
        n=status.dropped,
    )
    head = escape(text if status.state == "recording" else status.text)
    warning = f'<p class="ip-muted">{escape(status.warning)}</p>' if status.warning else ""
    where = escape(status.session.rsplit("/", 1)[-1])
    return f'<p class="ip-recording"><b>{head}</b><span>{where}</span></p>{warning}'
