"""The list of most likely places after a search without a find."""

from collections.abc import Callable
from typing import Any

from app.messages.status import Status
from app.nodes.console.link.commands import Actions, CommandError
from app.nodes.console.panels import markup
from app.nodes.console.scene.find_picture import crop
from app.view.model.candidates import LISTED, Candidate
from app.view.model.scene_model import SceneModel

Try = Callable[[Callable[[], str]], None]
Search = Callable[[str, str], str]


class CandidatesPanel:
    """Builds this list inside the Search tab."""

    def __init__(self, gui: Any, actions: Actions, attempt: Try, search: Search) -> None:
        self._actions = actions
        self._search = search
        self._shown: tuple[Candidate, ...] | None = None
        self._goal = ("", "")
        """Object and context of the finished search."""
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

    @property
    def is_shown(self) -> bool:
        """Whether places are listed now."""
        return bool(self._shown)

    def show(self, model: SceneModel, status: Status) -> None:
        """List the places after a search that ended without a find."""
        goal = status.goal
        is_over = status.state == "exhausted" and goal is not None
        shown = model.candidates() if is_over else None
        if goal is not None:
            self._goal = (goal.object, goal.context)
        if shown is self._shown:
            return
        self._shown = shown
        self._head.visible = is_over
        self._head.content = markup.not_found(len(shown or ()), self._words)
        start_ns = status.stamp_ns - int(status.elapsed_s * 1e9)
        labels = [row.label for row in model.proximity.rows] if model.proximity is not None else []
        for n, (text, buttons) in enumerate(self._rows):
            is_listed = shown is not None and n < len(shown)
            text.visible = is_listed
            buttons.visible = is_listed and not self._actions.recorded
            if shown is not None and is_listed:
                place = shown[n]
                picture = None if place.picture is None else crop(place.picture)
                label = labels[place.label] if place.label < len(labels) else ""
                text.content = markup.candidate(n + 1, place, picture, label, start_ns, self._words)

    def _act(self, n: int, word: str) -> str:
        if self._shown is None or n >= len(self._shown):
            raise CommandError(self._words("panel.places.gone"))
        x, y, _ = self._shown[n].point_world
        if word == self._words("panel.places.go"):
            return self._actions.go_to(x, y)
        wanted, context = self._goal
        asked, going = self._search(wanted, context), self._actions.go_to(x, y)
        return self._words("panel.places.first", asked=asked, n=n + 1, going=going)
