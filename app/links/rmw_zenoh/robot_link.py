"""The link to a robot whose nodes have rmw_zenoh: what a bridge on the robot would do."""

import logging
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any, Final

import zenoh

from app.links.network.sender import Sender
from app.links.network.session import LinkError, open_robot_client
from app.links.network.subscription import subscribe
from app.links.rmw_zenoh.command_output import CommandOutput
from app.links.rmw_zenoh.goal_action import GoalAction
from app.links.rmw_zenoh.goal_topic import GoalTopic
from app.links.rmw_zenoh.graph import Graph
from app.links.rmw_zenoh.matching import Match
from app.links.rmw_zenoh.participant import Participant
from app.links.rmw_zenoh.streams import Streams
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.navigation import decode_pose
from app.ros2.ippon_ros2.goals import Goals
from app.ros2.ippon_ros2.serialized import goal_status
from app.ros2.ippon_ros2.settings import GOALS, Ros2Error, Settings
from app.ros2.ippon_ros2.zenoh_side import claim

logger = logging.getLogger(__name__)

DISCOVER_S: Final = 0.5
TICK_S: Final = 0.02
MISSING_AFTER_S: Final = 5.0
"""Time without a publisher or subscription after which it is reported."""
LOSSES_S: Final = 10.0
"""Interval over which lost messages are counted."""
MUCH_LOST: Final = 0.2
RETRY_S: Final = 1.0
CONNECT_S: Final = 3.0
END_S: Final = 5.0


class RobotLink:
    """Carries a robot's topics to the navigator's keys and commands back, in threads of its own.

    Args:
        session: Of the navigator; with no `router` in the settings also that of the robot's nodes.
        robot: Key prefix.
        settings: Topics, domain and router of the robot.
    """

    def __init__(self, session: zenoh.Session, robot: str, settings: Settings) -> None:
        self._session, self._robot, self._settings = session, robot, settings
        self._ended = threading.Event()
        self._notes: dict[str, str] = {}
        self._token: Any = None
        self._started = time.monotonic()
        self._losses_at = self._started
        self._commands: CommandOutput | None = None
        self._goals: Goals | None = None
        self._statuses: Sender | None = None
        self._thread = threading.Thread(target=self._run, name="robot link", daemon=True)
        self._thread.start()
        self._watchdog = threading.Thread(target=self._watch, name="watchdog", daemon=True)
        self._watchdog.start()

    def notes(self) -> tuple[str, ...]:
        """Return what is missing now, for the operator."""
        return tuple(self._notes.values())

    def close(self) -> None:
        """Stop the robot, and leave its graph."""
        self._ended.set()
        self._watchdog.join(END_S)
        self._thread.join(END_S)

    # -- in the link's thread ----------------------------------------------------------------

    def _run(self) -> None:
        robot_session = self._open()
        if robot_session is None:
            return
        try:
            if self._claim():
                self._carry(robot_session)
        finally:
            if robot_session is not self._session:
                robot_session.close()  # pyright: ignore[reportUnknownMemberType]

    def _carry(self, robot_session: zenoh.Session) -> None:
        """Carry streams and commands until the end."""
        self._started = time.monotonic()
        settings = self._settings
        participant = Participant(robot_session, settings.domain, settings.namespace)
        graph = Graph(robot_session, settings.domain)
        self._commands = commands = CommandOutput(participant, settings)
        streams = Streams(participant, self._session, self._robot, settings, commands.saw_image)
        action = self._find_navigation(participant, commands, graph)
        self._subscribe(commands)
        while not self._ended.is_set():
            entities = graph.entities()
            try:
                matches = commands.follow(entities)
                self._report(matches | streams.follow(entities))
                if self._goals is not None and "goal" in matches and matches["goal"].problem:
                    self._goals.lost()
                if action is not None:
                    self._report({"navigate": Match(problem=action.follow(entities))})
                self._note("link", "")
            except Exception as error:  # noqa: BLE001 - the operator is told, and it is tried again
                self._note("link", f"the link to the robot's nodes fails: {error!r}")
            self._count_losses(streams)
            self._ended.wait(DISCOVER_S)
        if self._goals is not None:
            self._goals.stop()
        if action is not None:
            action.close()
        if self._statuses is not None:
            self._statuses.close()
        commands.close()
        streams.close()
        graph.close()
        participant.close()
        self._token.undeclare()

    def _open(self) -> zenoh.Session | None:
        """Return the session of the robot's nodes, waiting for it; None once ended."""
        router = self._settings.router
        if not router:
            return self._session
        while not self._ended.is_set():
            try:
                session = open_robot_client(router, CONNECT_S)
            except LinkError as error:
                self._note("router", f"waiting for the robot: {error}")
                self._ended.wait(RETRY_S)
            else:
                self._note("router", "")
                logger.info("connected to the robot's router %s", router)
                return session
        return None

    def _claim(self) -> bool:
        """Wait until no bridge serves this robot; return False once ended."""
        while not self._ended.is_set():
            try:
                self._token = claim(self._session, self._robot)
            except Ros2Error as error:
                self._note("bridge", str(error))
                self._ended.wait(RETRY_S)
            else:
                self._note("bridge", "")
                return True
        return False

    def _find_navigation(
        self, participant: Participant, commands: CommandOutput, graph: Graph
    ) -> GoalAction | None:
        """Pass goals on to a robot that navigates by itself; return its action if it has one."""
        topics = self._settings.topics
        key = next((key for key in GOALS if key in topics), None)
        if key is None:
            return None
        status = self._session.declare_publisher(f"{self._robot}/{keys.NAVIGATION_STATUS}")

        def ended(goal: bytes, code: int) -> None:
            goals.ended(goal, code)

        action = GoalAction(participant, topics[key], ended) if key == "navigate" else None
        navigation = action or GoalTopic(commands, topics[key], ended, graph.entities)
        # zenoh delivers what is put in the navigator's session to the navigator in this thread,
        # which may hold a lock that the navigator waits for: a status is sent from another one.
        self._statuses = statuses = Sender()

        def report(stamp: bytes, code: int) -> None:
            statuses.put(0, partial(status.put, goal_status(stamp, code)))

        self._goals = goals = Goals(navigation, report)
        return action

    def _subscribe(self, commands: CommandOutput) -> None:
        takes: dict[str, Callable[[bytes], None]] = {
            keys.CMD_VEL: commands.take_velocity,
            keys.CMD_TILT: commands.take_tilt,
        }
        goals = self._goals
        if goals is not None:

            def take_goal(payload: bytes) -> None:
                commands.driver.release()
                goals.take_goal(payload, time.monotonic())

            def take_active(payload: bytes) -> None:
                goals.take_active(payload, time.monotonic())

            takes[keys.NAVIGATION_GOAL] = _with_pose(take_goal)
            takes[keys.NAVIGATION_ACTIVE] = _with_pose(take_active)
        for key, take in takes.items():
            subscribe(self._session, f"{self._robot}/{key}", take)

    def _report(self, matches: dict[str, Match]) -> None:
        early = time.monotonic() - self._started < MISSING_AFTER_S
        for key, match in matches.items():
            text = match.problem or match.note
            if match.reason == "absent" and self._settings.topics[key].is_optional:
                text = ""
            self._note(key, "" if early or not text else f"{key}: {text}")

    def _count_losses(self, streams: Streams) -> None:
        now = time.monotonic()
        if now - self._losses_at < LOSSES_S:
            return
        self._losses_at = now
        for key, count in streams.losses.items():
            share = count.take_share()
            text = (
                f"{key}: {share:.0%} of its messages are lost on their way: the network is too "
                "slow for them; publish compressed images, or fewer"
            )
            self._note(f"{key} lost", text if share > MUCH_LOST else "")

    def _note(self, key: str, text: str) -> None:
        """Set or clear what is wrong with something, and log what is new."""
        known = self._notes.get(key, "")
        if text and key not in self._notes:
            logger.warning("%s", text)
        elif known and not text:
            logger.info("%s: found", key)
        # A copy: another thread reads it.
        kept = {k: t for k, t in self._notes.items() if k != key}
        self._notes = {**kept, key: text} if text else kept

    def _watch(self) -> None:
        """Stop the robot where the navigator has fallen silent, whatever else is going on."""
        while not self._ended.wait(TICK_S):
            if self._commands is not None:
                self._commands.driver.tick(time.monotonic())
            if self._goals is not None:
                self._goals.tick(time.monotonic())


def _with_pose(take: Callable[[bytes], None]) -> Callable[[bytes], None]:
    """Return what passes on a PoseStamped that can be read: the watchdog sends it to the robot."""

    def check(payload: bytes) -> None:
        try:
            decode_pose(payload)
        except MessageError as error:
            logger.warning("a goal was refused: %s", error)
            return
        take(payload)

    return check
