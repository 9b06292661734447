"""Recording controls of the Session tab: on, off, notes and marks."""

from collections.abc import Callable
from html import escape
from typing import Any, Final

from app.messages.recording import RecordingStatus
from app.nodes.console.link.commands import Actions, CommandError
from app.nodes.console.panels import markup
from app.view.colors import QUIET

MAX_NOTE: Final = 2000
NOBODY = "No recorder is running. Start one for a running robot with: ippon record"


class RecordPanel:
    """Builds the part inside the current container."""

    def __init__(self, gui: Any, actions: Actions) -> None:
        self._actions = actions
        self._state = gui.add_html(recording_line(None))
        self._switch = gui.add_button_group("Record", ("On", "Off", "Mark"))
        with gui.add_form(None) as form:
            self._text = gui.add_text(
                "Note", "", hint="Stored with the recording at the current time"
            )
            note = gui.add_button("Save the note", color=QUIET)
        self._answer = gui.add_html("")
        self._switch.on_click(lambda event: self._press(event.target.value))
        note.on_click(lambda _: form.submit())
        form.on_submit(lambda _: self._note())

    def show(self, status: RecordingStatus) -> None:
        """Show what the recorder does."""
        self._state.content = recording_line(status)

    def _press(self, word: str) -> None:
        actions: dict[str, Callable[[], str]] = {
            "On": lambda: self._actions.record("start", ""),
            "Off": lambda: self._actions.record("stop", ""),
            "Mark": lambda: self._actions.record("mark", ""),
        }
        self._try(actions[word])

    def _note(self) -> None:
        text = self._text.value.strip()
        if not text:
            self._answer.content = markup.answer("The note is empty.", ok=False)
            return
        if len(text) > MAX_NOTE:
            problem = f"A note has at most {MAX_NOTE} characters; this is {len(text)}."
            self._answer.content = markup.answer(problem, ok=False)
        elif self._try(lambda: self._actions.record("note", text)):
            self._text.value = ""

    def _try(self, command: Callable[[], str]) -> bool:
        try:
            self._answer.content = markup.answer(command(), ok=True)
        except CommandError as error:
            self._answer.content = markup.answer(str(error), ok=False)
            return False
        return True


def recording_line(status: RecordingStatus | None) -> str:
    """Return the state of the recording and any warning, as HTML."""
    if status is None:
        return f'<p class="ip-muted">{NOBODY}</p>'
    minutes, seconds = divmod(int(status.seconds), 60)
    figures = f"{minutes}:{seconds:02d}, {status.written_bytes / 1e6:.0f} MB"
    lost = f", {status.dropped} messages lost" if status.dropped else ""
    head = f"Recording: {figures}{lost}" if status.state == "recording" else escape(status.text)
    warning = f'<p class="ip-muted">{escape(status.warning)}</p>' if status.warning else ""
    where = escape(status.session.rsplit("/", 1)[-1])
    return f'<p class="ip-recording"><b>{head}</b><span>{where}</span></p>{warning}'
