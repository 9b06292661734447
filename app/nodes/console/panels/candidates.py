"""The list of most likely places after a search without a find."""

from typing import Any

from app.messages.control import QueueRequest
from app.messages.plain_text import as_sentence
from app.nodes.console.link.commands import Actions, CommandError
from app.nodes.console.panels.find_markup import candidate, not_found
from app.nodes.console.panels.markup import Try
from app.nodes.console.scene.find_picture import crop
from app.view.colors import QUIET
from app.view.model.candidates import LISTED
from app.view.model.scene_model import SceneModel
from app.view.model.unfound_goals import UnfoundGoal


class CandidatesPanel:
    """Builds this list inside the Search tab."""

    def __init__(self, gui: Any, actions: Actions, attempt: Try) -> None:
        self._actions = actions
        self._shown: UnfoundGoal | None = None
        self._closed: UnfoundGoal | None = None
        """The goal whose list was closed; its number may be another goal's after a restart."""
        say = self._words = actions.say
        self._head = gui.add_html("", visible=False)
        self._rows: list[tuple[Any, Any]] = []
        for n in range(LISTED):
            text = gui.add_html("", visible=False)
            buttons = gui.add_button_group(
                say("panel.places.place", n=n + 1),
                (say("panel.places.again"), say("panel.places.go")),
                visible=False,
            )
            buttons.on_click(lambda event, n=n: attempt(lambda: self._act(n, event.target.value)))
            self._rows.append((text, buttons))
        self._close = gui.add_button(say("panel.places.close"), color=QUIET, visible=False)
        self._close.on_click(lambda _: self._hide())

    @property
    def is_shown(self) -> bool:
        """Whether places are listed now."""
        return self._shown is not None and bool(self._shown.places)

    def show(self, model: SceneModel) -> None:
        """List the places of what was not found last, also while the next search runs."""
        if self._closed is not None:
            model.unfound.dismiss(self._closed)
        lost = model.unfound.latest
        if lost is self._shown:
            return
        self._shown = lost
        places = (lost and lost.places) or ()
        self._head.visible = self._close.visible = lost is not None
        if lost is not None:
            count = None if lost.places is None else len(places)
            names = ", ".join(map(self._words.goal, lost.goals))
            self._head.content = not_found(names, count, self._words)
        labels = [row.label for row in model.proximity.rows] if model.proximity is not None else []
        for n, (text, buttons) in enumerate(self._rows):
            is_listed = n < len(places)
            text.visible = is_listed
            buttons.visible = is_listed and not self._actions.recorded
            if lost is not None and is_listed:
                place = places[n]
                picture = None if place.picture is None else crop(place.picture)
                label = labels[place.label] if place.label < len(labels) else ""
                text.content = candidate(n + 1, place, picture, label, lost.start_ns, self._words)

    def _hide(self) -> None:
        """Close the list; the next goal that is not found opens it again."""
        lost = self._shown
        if lost is None:
            return
        self._closed = lost
        for part in (self._head, self._close, *(part for row in self._rows for part in row)):
            part.visible = False

    def _act(self, n: int, word: str) -> str:
        places = (self._shown and self._shown.places) or ()
        if self._shown is None or n >= len(places):
            raise CommandError(self._words("panel.places.gone"))
        x, y, _ = places[n].point_world
        if word == self._words("panel.places.go"):
            return self._actions.go_to(x, y)
        again = QueueRequest(goal_id=self._shown.goal.goal_id, action="repeat")
        asked = self._actions.change_queue(again)
        try:
            going = self._actions.go_to(x, y)
        except CommandError as error:
            # The search has begun all the same.
            return f"{asked} {as_sentence(str(error))}"
        return self._words("panel.places.first", asked=asked, n=n + 1, going=going)
