"""A second session in the same scene, beside the first."""

import threading
from typing import Final

import numpy as np

from app.links.network.inbox import Inbox
from app.nodes.console.critical_thread import OnFailure, critical_thread
from app.nodes.console.scene.scene_thread import DRAW_S
from app.nodes.console.web.viser_server import LoopbackViserServer
from app.view.drawing.camera_follow import CameraFollow
from app.view.drawing.subtree import Subtree
from app.view.drawing.viser_scene import ViserScene
from app.view.model.scene_model import SceneModel
from app.view.model.scene_reader import SceneReader
from app.view.view_options import ViewOptions
from app.view.words import Words

ROOT: Final = "/second"


class SideBySideScene:
    """Draws the second session to the right of the first."""

    def __init__(
        self,
        viser_server: LoopbackViserServer,
        inbox: Inbox,
        follow: CameraFollow,
        on_failure: OnFailure,
        say: Words,
    ) -> None:
        """Create the scene of the second session.

        Args:
            viser_server: Server that shows the first session.
            inbox: Messages of the second session.
            follow: Keeps both sessions in view.
            on_failure: Called when a thread has failed.
            say: The words of the page.
        """
        self.model = SceneModel()
        self._inbox = inbox
        self._follow = follow
        self._reader = SceneReader(self.model, say)
        self._root = viser_server.server.scene.add_frame(ROOT, show_axes=False)
        self._root.visible = False
        self._scene = ViserScene(Subtree(viser_server.server, ROOT), say)
        self._options = ViewOptions()
        self._stop = threading.Event()
        self._thread = critical_thread("second", self._run, on_failure)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._stop.set()
        self._inbox.wake()
        self._thread.join(timeout=5.0)

    def stand_at(self, x_m: float) -> None:
        """Place the second session at an offset along x."""
        self._root.position = (x_m, 0.0, 0.0)

    def show(self, visible: bool) -> None:
        """Show or hide the second session."""
        self._root.visible = visible
        if not visible:
            self._follow.beside = None

    def _run(self) -> None:
        while not self._stop.is_set():
            for key, payload in self._inbox.drain(DRAW_S):
                self._reader.feed(key, payload)
            changed = self.model.take_changes()
            if changed:
                self._scene.draw(self.model, changed, self._options)
            if "voxels" in changed and self._root.visible:
                self._frame()

    def _frame(self) -> None:
        bounds = self._scene.bounds()
        if bounds is not None:
            aside = np.array(self._root.position[:2], np.float64)
            self._follow.beside = (bounds[0] + aside, bounds[1] + aside)
