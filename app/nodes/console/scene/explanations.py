"""The explanation that all browsers show: of the last click, or of the thing last flown to."""

import logging
import queue
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import msgspec

from app.messages.control import InspectReply
from app.nodes.console.link.commands import CommandError
from app.nodes.console.link.navigator_link import NavigatorLink
from app.nodes.console.scene.browser_views import BrowserViews
from app.nodes.console.scene.click_explanation import (
    ClickExplanation,
    ExplanationBuilder,
    of_thing,
    with_labels,
)
from app.nodes.console.scene.clicks import NOBODY, Question
from app.nodes.console.scene.pointed_places import ray_onto
from app.nodes.console.scene.scene_requests import Look
from app.view.drawing.camera_follow import CameraFollow
from app.view.model.scene_model import SceneModel

logger = logging.getLogger(__name__)

Show = Callable[[str, bytes], None]


class Explanations:
    """Answers clicks and looks at things; used by the scene thread."""

    def __init__(
        self,
        model: SceneModel,
        link: NavigatorLink,
        views: BrowserViews,
        follow: CameraFollow,
        show: Show,
    ) -> None:
        """Explain nothing yet.

        Args:
            model: What is explained.
            link: Asks the navigator about voxels.
            views: Where the place is marked.
            follow: Flies to things.
            show: Keeps a picture for the pages.
        """
        self.now: ClickExplanation | None = None
        self._model = model
        self._link = link
        self._views = views
        self._follow = follow
        self._builder = ExplanationBuilder(model, show, link.say)
        self._answers: queue.SimpleQueue[tuple[int, InspectReply]] = queue.SimpleQueue()
        self._asked = 0
        self._goal_id = 0
        self._forgotten = model.forgotten

    def step(
        self, questions: list[Question], looks: list[Look], worker: ThreadPoolExecutor
    ) -> None:
        """Answer clicks, fly to things, and take the navigator's replies.

        Args:
            questions: Rays of the clicks.
            looks: Things that pages want to see.
            worker: Asks the navigator.
        """
        if self._model.forgotten != self._forgotten:
            # What was explained is not there any more, or looks different at another moment.
            self._forgotten, self.now = self._model.forgotten, None
        goal = None if self._model.status is None else self._model.status.goal
        if goal is not None and goal.goal_id != self._goal_id:
            # What is said of one object of interest would be read as said of the next.
            self._goal_id, self.now = goal.goal_id, None
        for question in questions:
            self._explain(question, worker)
        for look in looks:
            self._explain(self._fly(look), worker)
            if self.now is not None:
                self.now = of_thing(self.now, look.thing, look.share, self._link.say)
        while not self._answers.empty():
            number, reply = self._answers.get()
            if number == self._asked and self.now is not None:
                wanted = self._link.say.name(goal.object) if goal is not None else ""
                self.now = with_labels(self.now, reply, wanted, self._link.say)

    def _explain(self, question: Question, worker: ThreadPoolExecutor) -> None:
        origin, direction, client_id = question
        ceiling_m = self._views.options_of(client_id).ceiling_m
        explained, highlight, voxel = self._builder.explain(origin, direction, ceiling_m)
        self._views.highlight_for_all(highlight)
        self._asked += 1
        self.now = msgspec.structs.replace(explained, number=self._asked)
        if voxel is not None:
            worker.submit(self._inspect, self._asked, voxel)

    def _fly(self, look: Look) -> Question:
        """Fly to a thing in the views of a browser, and return what to explain."""
        views = self._views.of(look.browser)
        for view in views:
            self._follow.fly(view.client, look.centre_world, look.size_m, at_once=look.at_once)
        client_id = views[0].client.client_id if views else NOBODY
        return (*ray_onto(look, self._model.voxel_size_m or 0.0), client_id)

    def _inspect(self, number: int, voxel: tuple[float, float, float]) -> None:
        try:
            self._answers.put((number, self._link.inspect(voxel)))
        except CommandError as error:
            logger.info("a voxel could not be inspected: %s", error)
