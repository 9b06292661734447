"""The Search tab: start a search, follow it, and confirm or reject a find.

What is typed is each browser's own (`QueryForm`); answers are common to all.
"""

import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal

import numpy as np

from app.messages.cdr import MessageError
from app.messages.plain_text import as_sentence
from app.messages.status import FindReport, MissionState, Status, awaited_find
from app.nodes.console.link.commands import Actions, CommandError
from app.nodes.console.panels import markup
from app.nodes.console.panels.candidates import CandidatesPanel
from app.nodes.console.panels.counted_finds import CountedFindsPanel, VerdictButtons, find_name
from app.nodes.console.panels.find_markup import find_card
from app.nodes.console.panels.last_questions import LastQuestions, Question
from app.nodes.console.panels.proximity import ProximityPanel
from app.nodes.console.panels.query_form import QueryForm
from app.nodes.console.scene.find_picture import FindPictures
from app.view.camera.picture_encoding import encoded_picture
from app.view.camera.stream_budget import Rung
from app.view.drawing.viser_private import show_jpeg_in_panel
from app.view.model.scene_model import Part, SceneModel
from app.view.words import Words
from ippon.guidance.language.goals.goal import Attribute, Goal
from ippon.guidance.language.requests.sentence import MAX_OBJECT_CHARS, is_name, search_name

MAX_CONTEXT: Final = 2000
MAX_SCENARIO: Final = 200
MAX_TYPED: Final = 2100
_PICTURE: Final = Rung(longest_px=400, quality=60)
_OUTDATES: Final = ("found", "exhausted", "stopped", "manual")
"""States in which the answer to what was pressed before is no news."""
_GOING: Final = ("pause", "end")
_HELD: Final = ("resume", "end")
_STOPPED: Final = ("end",)
"""After a stop the bar has Resume."""


@dataclass(frozen=True, slots=True)
class _Asking:
    """A question while it is answered; several browsers may ask at once."""

    form: QueryForm
    question: Question
    accepted: list[int] = field(default_factory=list)
    """Numbers of its goals that the navigator has accepted."""
    replies: list[str] = field(default_factory=list)
    """What it said of them."""


class SearchPanel:
    """Builds the tab inside the current container and updates it from the model."""

    def __init__(self, gui: Any, actions: Actions) -> None:
        self._actions = actions
        say = self._words = actions.say
        self._find: FindReport | None = None
        self._pictures = FindPictures()
        self._is_pictured = False
        """Whether a find is shown with its picture; without one the camera is shown."""
        self._find_waits = False
        """Whether the find that is shown waits for a verdict."""
        self._state = ""
        self._fades = False
        """Whether the shown reply is removed when the search ends."""
        self._questions = threading.Lock()
        """Held for what is asked: each press of Search has its own thread."""
        self._last = LastQuestions()
        self._answering: set[Question] = set()
        """What is being answered: a second press of Search is no second question."""
        self._next = ""
        """Names of the goals that come after the present ones; empty for none."""
        self._forms: list[QueryForm] = []
        self._queries = None if actions.recorded else gui.add_folder(None)
        """Container of each browser's fields; none for a recording."""
        self._understood = gui.add_html("")
        self._answer = gui.add_html("")
        self._now = gui.add_html(markup.now(None, say))
        self._steer = {words: self._build_steer(gui, words) for words in (_GOING, _HELD, _STOPPED)}
        self._build_find(gui)
        self._counted = CountedFindsPanel(gui, actions, self._try)
        self._candidates = CandidatesPanel(gui, actions, self._try)
        self._camera = gui.add_image(np.zeros((2, 2, 3), np.uint8), format="jpeg", visible=False)
        self._goals = gui.add_html("")
        self._common_sense = ProximityPanel(gui, actions)

    def open_form(
        self, client: Any, draft: Question | None, keep: Callable[[Question], None]
    ) -> QueryForm | None:
        """Add the fields of a browser; None for a recording. Called by the scene thread.

        Args:
            client: viser's, of the browser.
            draft: What the browser has typed before; None for nothing.
            keep: Told what is typed.
        """
        if self._queries is None:
            return None
        with self._queries:
            form = QueryForm(client, self._words, draft, self._ask, keep)
        self._forms.append(form)
        return form

    def close_form(self, form: QueryForm) -> None:
        """Forget the fields of a browser that has disconnected. Called by the scene thread."""
        self._forms.remove(form)

    def update(self, model: SceneModel, changed: frozenset[Part]) -> None:
        """Show what changed."""
        if "status" in changed and model.status is not None:
            self._show_status(model.status, model)
        if "image" in changed and model.image is not None and not self._is_pictured:
            self._show_camera(model.image.encoded)
        if "proximity" in changed and model.proximity is not None:
            self._common_sense.show(model.proximity)

    def _build_steer(self, gui: Any, words: tuple[str, ...]) -> Any:
        """Build the buttons that steer a search in one state; one group is visible at a time."""
        say = self._words
        labels = tuple(say(f"panel.search.{word}") for word in words)
        group = gui.add_button_group(say("panel.search.steer"), labels, visible=False)
        group.on_click(lambda event: self._control(event.target.value))
        return group

    def _build_find(self, gui: Any) -> None:
        with gui.add_folder(None, visible=False) as self._find_box:
            self._found = gui.add_html("")
            self._crop = gui.add_image(np.zeros((2, 2, 3), np.uint8), format="jpeg", visible=False)
        self._verdict = VerdictButtons(gui, self._find_box, self._actions, self._try)

    def _ask(self, form: QueryForm) -> None:
        asking = _Asking(form, form.asked())
        typed, _, _ = question = asking.question
        if len(typed) > MAX_TYPED:
            self._say(self._words("panel.search.long", most=MAX_TYPED, n=len(typed)), ok=False)
            return
        with self._questions:
            if question in self._answering:
                return
            repeats = self._last.repeats(question)
            if not repeats:
                self._answering.add(question)
        if repeats:
            self._say(self._words("panel.search.repeats"), ok=False)
            return
        try:
            text, ok = self._answer_question(asking)
        finally:
            with self._questions:
                self._answering.remove(question)
                if asking.accepted:
                    self._last.accepted(question, set(asking.accepted), form.question[:2])
        # Last: whoever has read it may press again.
        self._say(text if ok else " ".join((*asking.replies, text)), ok=ok)

    def _answer_question(self, asking: _Asking) -> tuple[str, bool]:
        """Return the answer, and whether all went well."""
        self._understood.content = ""
        typed, context, _ = asking.question
        ready = asking.form.take_held(typed, context)
        if ready:
            return _answer_of(lambda: self._search_all(asking, ready, ""))
        if is_name(typed):
            return _answer_of(lambda: self._search(asking, typed, context))
        self._say(self._words("panel.search.reading"), ok=True)
        return _answer_of(lambda: self._read(asking))

    def _read(self, asking: _Asking) -> str:
        """Read a sentence, show what was understood, and search; a doubtful reading waits."""
        form, (sentence, context, _) = asking.form, asking.question
        reading = self._actions.read(sentence)
        if not reading.goals:
            raise CommandError(as_sentence(reading.because))
        understood = markup.understood(reading, self._words)
        if not reading.doubtful:
            self._understood.content = understood
            return self._search_all(asking, reading.goals, context)
        ready = [replace(goal, context=_both(goal.context, context)) for goal in reading.goals]
        if len(ready) == 1:
            form.propose(search_name(ready[0]), ready[0].context)
        form.hold(ready)
        # Last: whoever has read it may correct the fields.
        self._understood.content = understood
        return self._words("panel.search.read_by", provider=reading.provider)

    def _search_all(self, asking: _Asking, goals: Sequence[Goal], context: str) -> str:
        """Search for goals: for those named with "and" in one tour, else one after the other."""
        return " ".join(
            self._search(
                asking,
                search_name(goal),
                _both(goal.context, context),
                joins=asking.accepted[-1] if place > 0 and goal.order == "and" else None,
                attributes=goal.attributes,
                count=goal.count,
                other=goal.refers_to == "other",
            )
            for place, goal in enumerate(goals)
        )

    def _search(
        self,
        asking: _Asking,
        wanted: str,
        context: str,
        *,
        joins: int | None = None,
        attributes: Sequence[Attribute] = (),
        count: int | Literal["all"] = 1,
        other: bool = False,
    ) -> str:
        _, _, scenario = asking.question
        problem = _problem(wanted, context, scenario, self._words)
        if problem is not None:
            raise CommandError(problem)
        started = self._actions.search(
            wanted,
            context,
            scenario,
            joins=joins,
            attributes=attributes,
            count=count,
            other=other,
        )
        asking.accepted.append(started.goal_id)
        asking.replies.append(started.text)
        return started.text

    def _control(self, word: str) -> None:
        actions, say = self._actions, self._words
        done = {"pause": actions.pause, "resume": actions.resume, "end": self._end}
        self._try({say(f"panel.search.{name}"): act for name, act in done.items()}[word])

    def _end(self) -> str:
        """End the search, and say what the robot goes on with."""
        names = self._next
        ended = self._actions.cancel()
        return f"{ended} {self._words('panel.search.next', names=names)}" if names else ended

    def _try(self, command: Callable[[], str]) -> None:
        text, ok = _answer_of(command)
        self._say(text, ok=ok)

    def _say(self, text: str, *, ok: bool) -> None:
        self._answer.content = markup.answer(text, ok=ok)
        self._fades = ok

    def _show_status(self, status: Status, model: SceneModel) -> None:
        with self._questions:
            self._last.follow(status)
            outdated = self._last.take_outdated()
        for words in outdated:
            self._forget_question(words)
        self._next = _next_names(status, self._words)
        self._now.content = markup.now(status, self._words)
        self._goals.content = markup.goals(
            [*status.tour, *status.queue],
            status.history,
            self._words,
            recorded=self._actions.recorded,
        )
        has_search = status.goal is not None and status.state != "exhausted"
        is_steered = has_search and not self._actions.recorded
        for words, group in self._steer.items():
            group.visible = is_steered and words == _steering(status.state)
        if status.state != self._state and status.state in _OUTDATES and self._fades:
            self._answer.content = ""
        self._state = status.state
        self._candidates.show(model)
        self._counted.show(status)
        find, waits = status.find, awaited_find(status) is not None
        if find is None:
            self._is_pictured = False
        elif find != self._find or not self._is_pictured:
            self._show_picture(find, status, model)
        has_picture = self._is_pictured or (find is None and self._candidates.is_shown)
        self._camera.visible = model.image is not None and not has_picture
        if (find, waits) == (self._find, self._find_waits):
            return
        self._find, self._find_waits = find, waits
        name = "" if find is None else find_name(find, status, self._words)
        self._found.content = "" if find is None else find_card(find, self._words, name=name)
        self._find_box.visible = find is not None
        self._verdict.show(find, waits=waits)

    def _show_picture(self, find: FindReport, status: Status, model: SceneModel) -> None:
        """Show the picture of a find as soon as there is one."""
        image = model.image
        picture = None if image is None else self._pictures.picture_of(find, status, image)
        self._is_pictured = picture is not None
        self._crop.visible = self._is_pictured
        if picture is not None:
            show_jpeg_in_panel(self._crop, picture)

    def _forget_question(self, words: tuple[str, str]) -> None:
        """The words of a search that is over do not stand beside another one."""
        forms = [form for form in self._forms if form.question[:2] == words]
        for form in forms:
            form.write("", "")
        if forms:
            self._understood.content = ""

    def _show_camera(self, encoded: bytes) -> None:
        with suppress(MessageError):
            show_jpeg_in_panel(self._camera, encoded_picture(encoded, _PICTURE, turns=0))


def _steering(state: MissionState) -> tuple[str, ...]:
    return {"paused": _HELD, "stopped": _STOPPED}.get(state, _GOING)


def _next_names(status: Status, say: Words) -> str:
    first = status.queue[0] if status.queue else None
    if first is None:
        return ""
    tour = [one for one in status.queue if one is first or (one.tour and one.tour == first.tour)]
    return ", ".join(map(say.goal, tour))


def _both(one: str, other: str) -> str:
    return ", ".join(part for part in (one, other) if part)


def _problem(wanted: str, context: str, scenario: str, say: Words) -> str | None:
    if not wanted:
        return say("panel.search.empty")
    limits = (
        ("object", wanted, MAX_OBJECT_CHARS),
        ("context", context, MAX_CONTEXT),
        ("scenario", scenario, MAX_SCENARIO),
    )
    for name, text, most in limits:
        if len(text) > most:
            return say(f"panel.search.long.{name}", most=most, n=len(text))
    return None


def _answer_of(command: Callable[[], str]) -> tuple[str, bool]:
    """Return the answer to a command, and whether it was carried out."""
    try:
        return command(), True
    except CommandError as error:
        return str(error), False
