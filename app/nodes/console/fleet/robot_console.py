"""The console of one robot: its link, its scene, and what its pages are told."""

from app.links.network.inbox import Inbox
from app.nodes.console.calls.call_log import CallLog
from app.nodes.console.camera.camera_feed import CAMERA_ONLY
from app.nodes.console.critical_thread import OnFailure
from app.nodes.console.link.navigator_link import NavigatorLink
from app.nodes.console.scene.scene_thread import EVERY, SceneThread
from app.nodes.console.scene.state_feed import StateFeed
from app.nodes.console.web.browsers import Browsers
from app.nodes.console.web.viser_server import start_viser
from app.view.model.scene_model import SceneModel
from app.view.model.scene_reader import SceneReader
from app.view.words import ENGLISH, Words


class RobotConsole:
    """Owns the threads and sockets behind the pages of one robot.

    Args:
        endpoint: Of the router.
        robot: Key prefix of the robot.
        on_failure: Told when a part of it fails.
        calls: Where people are called.
        say: The words.
        is_awaited: The command that started the console starts the navigator as well.
    """

    def __init__(
        self,
        endpoint: str,
        robot: str,
        on_failure: OnFailure,
        calls: CallLog | None = None,
        say: Words = ENGLISH,
        *,
        is_awaited: bool = False,
    ) -> None:
        self.robot = robot
        self.browsers = Browsers()
        """The browsers of its pages, each with its standing at this robot."""
        self.state_feed = StateFeed()
        inbox = Inbox(EVERY, self.state_feed.camera.takers, CAMERA_ONLY)
        topics = (*SceneReader(SceneModel()).keys, *CAMERA_ONLY)
        self.link = NavigatorLink(
            endpoint, robot, topics, inbox, on_failure, say, is_awaited=is_awaited
        )
        self.viser_server = start_viser(self.browsers)
        self._scene_thread = SceneThread(
            self.viser_server, self.link, inbox, self.state_feed, on_failure, calls or CallLog(say)
        )

    def start(self) -> None:
        """Open the link and draw."""
        self.link.start()
        self._scene_thread.start()

    def close(self) -> None:
        """End its threads and close its sockets."""
        self._scene_thread.stop()
        self.link.close()
        self.viser_server.close()
