"""The ROS 2 node: finds the robot's topics, carries streams to the navigator and commands back."""

# pyright: reportMissingImports=false
from __future__ import annotations

import logging
import time
from typing import Any

import zenoh
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from .commands import Commands
from .driver import Driver
from .goal_clients import GoalAction, GoalTopic
from .goals import Goals, with_pose
from .interfaces import package_of
from .serialized import goal_status
from .settings import GOALS, Ros2Error, Settings
from .streams import Streams

logger = logging.getLogger(__name__)

DISCOVER_S = 0.5
MISSING_AFTER_S = 5.0
"""Time without a publisher after which a topic is reported."""


class BridgeNode(Node):  # type: ignore[misc]
    """Carries a robot's topics to zenoh and commands back.

    Args:
        session: Connected to the navigator's router.
        robot: Key prefix.
        settings: Topics and limits.
    """

    def __init__(self, session: zenoh.Session, robot: str, settings: Settings) -> None:
        super().__init__("ippon_ros2")
        self._session, self._robot = session, robot
        self._settings = settings
        self._started = time.monotonic()
        self._reported: set[str] = set()
        self._commands = Commands(self, settings, self._report)
        self.driver = Driver(
            self._commands.send_velocity, settings.max_linear_m_s, settings.max_yaw_rate_rad_s
        )
        self.streams = Streams(self, session, robot, settings, self.driver.saw_image)
        self.goals, self.navigation = self._find_navigation()
        if "cmd_vel" in settings.topics:
            self._subscribe_zenoh("cmd_vel", lambda p: self.driver.take(p, time.monotonic()))
        self._subscribe_zenoh("camera/cmd_tilt", self._commands.send_tilt)
        if self.navigation is not None:
            logger.info("goals go to %s (%s)", self.navigation.name, self.navigation.kind)
        # By a clock that goes on while a simulation is paused.
        self.create_timer(DISCOVER_S, self.discover, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def discover(self) -> None:
        """Subscribe to topics that have appeared, and report those that do not."""
        types = dict(self.get_topic_names_and_types())
        self.streams.follow(types)
        self._commands.follow(types)
        navigation = self.navigation
        if self.goals and isinstance(navigation, GoalTopic) and navigation.problem():
            self.goals.lost()
        if time.monotonic() - self._started > MISSING_AFTER_S:
            self._report_missing(types)

    def command_topics(self) -> list[tuple[str, str, str, str]]:
        """Return key, topic, problem (empty for none) and type of each command."""
        rows = self._commands.rows()
        if self.navigation is not None:
            key = next(key for key in GOALS if key in self._settings.topics)
            name, problem = self._settings.topics[key].name, self.navigation.problem()
            rows.append((key, name, problem, self.navigation.kind))
        return rows

    def _report_missing(self, types: dict[str, list[str]]) -> None:
        for key, text in (
            *self.streams.problems(types).items(),
            *self._commands.problems().items(),
        ):
            self._report(key, text)
        if self.count_publishers("/clock") and not self.get_parameter("use_sim_time").value:
            self._report(
                "clock", "/clock is published, and this node goes by another clock: commands would "
                "have stamps of another time; start it with --ros-args -p use_sim_time:=true"
            )  # fmt: skip
        if self.navigation is not None and self.navigation.problem():
            self._report("goals", f"{self.navigation.problem()}: the robot will not move")

    def _subscribe_zenoh(self, topic: str, take: Any) -> None:
        def receive(sample: zenoh.Sample) -> None:
            take(sample.payload.to_bytes())

        handler = zenoh.handlers.Callback(receive, indirect=False)
        self._session.declare_subscriber(f"{self._robot}/{topic}", handler)

    def _find_navigation(self) -> tuple[Goals | None, GoalTopic | GoalAction | None]:
        """Return what carries goals to a robot that navigates by itself; None for others.

        Raises:
            Ros2Error: ROS 2 has no such message or action.
        """
        key = next((key for key in GOALS if key in self._settings.topics), None)
        if key is None:
            return None, None
        kind = GoalAction if key == "navigate" else GoalTopic

        def ended(goal: bytes, code: int) -> None:
            goals.ended(goal, code)

        try:
            navigation = kind(self, self._settings.topics[key], ended)
        except ImportError as error:
            raise Ros2Error(
                f"`ros2: {key}` needs the package {package_of(kind.kind)}: {error}"
            ) from error
        status = self._session.declare_publisher(f"{self._robot}/navigation/status")
        goals = Goals(navigation, lambda stamp, code: status.put(goal_status(stamp, code)))

        def take(payload: bytes) -> None:
            self.driver.release()
            goals.take_goal(payload, time.monotonic())

        def keep(payload: bytes) -> None:
            goals.take_active(payload, time.monotonic())

        self._subscribe_zenoh("navigation/goal", with_pose(take))
        self._subscribe_zenoh("navigation/active", with_pose(keep))
        return goals, navigation

    def tick(self) -> None:
        """Stop the robot where the navigator has fallen silent."""
        self.driver.tick(time.monotonic())
        if self.goals is not None:
            self.goals.tick(time.monotonic())

    def stop(self) -> None:
        """Stop the robot now."""
        self.driver.stop()
        if self.goals is not None:
            self.goals.stop()

    def _report(self, key: str, text: str) -> None:
        if key not in self._reported:
            self._reported.add(key)
            logger.warning("%s", text)
