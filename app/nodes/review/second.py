"""A second session in the same scene, beside the first."""

import threading
from typing import Final

from app.nodes.console.backend import ViserBackend
from app.nodes.console.conductor import DRAW_S
from app.nodes.console.inbox import Inbox
from app.nodes.console.vital_thread import OnFailure, vital_thread
from app.view.options import ViewOptions
from app.view.reader import SceneReader
from app.view.scene_model import SceneModel
from app.view.subtree import Subtree
from app.view.viser_scene import ViserScene

ROOT: Final = "/second"


class SecondScene:
    """Draws the second session to the right of the first."""

    def __init__(self, backend: ViserBackend, inbox: Inbox, on_failure: OnFailure) -> None:
        self.model = SceneModel()
        self._inbox = inbox
        self._reader = SceneReader(self.model)
        self._root = backend.server.scene.add_frame(ROOT, show_axes=False)
        self._root.visible = False
        self._scene = ViserScene(Subtree(backend.server, ROOT))
        self._options = ViewOptions()
        self._stop = threading.Event()
        self._thread = vital_thread("second", self._run, on_failure)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._stop.set()
        self._inbox.wake()
        self._thread.join(timeout=5.0)

    def stand_at(self, x_m: float) -> None:
        """Move along x."""
        self._root.position = (x_m, 0.0, 0.0)

    def show(self, visible: bool) -> None:
        """Show it, or not."""
        self._root.visible = visible

    def _run(self) -> None:
        while not self._stop.is_set():
            for key, payload in self._inbox.drain(DRAW_S):
                self._reader.feed(key, payload)
            changed = self.model.take_changes()
            if changed:
                self._scene.draw(self.model, changed, self._options)
