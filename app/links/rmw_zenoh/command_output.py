"""Commands of the navigator on their way to the topics of a robot."""

import logging
import time
from collections.abc import Iterable
from functools import partial
from typing import Final

from app.links.network.sender import Sender
from app.links.rmw_zenoh.commands import encode_tilt, encode_velocity
from app.links.rmw_zenoh.matching import Match, match_topic
from app.links.rmw_zenoh.participant import Endpoint, Participant
from app.links.rmw_zenoh.protocol.tokens import Entity
from app.messages.cdr import MessageError
from app.messages.motion import decode_number
from app.ros2.ippon_ros2.driver import Driver
from app.ros2.ippon_ros2.rates import TiltSteps
from app.ros2.ippon_ros2.settings import COMMANDS, FLOAT, NAVIGATE, Settings

logger = logging.getLogger(__name__)

LAST_SECOND: Final = 2.0**31 - 2.0
"""Of the stamps of ROS 2."""


class CommandOutput:
    """Publishes velocities, tilt and goals where somebody subscribes to them.

    Velocities are limited, and zero when the navigator falls silent (`driver`).

    Args:
        participant: Of the robot's graph.
        settings: Topics and limits of the robot.
    """

    def __init__(self, participant: Participant, settings: Settings) -> None:
        self._participant, self._domain = participant, settings.domain
        self._topics = {
            key: topic
            for key, topic in settings.topics.items()
            if key in COMMANDS and NAVIGATE not in COMMANDS[key][1]
        }
        self._sender = Sender()
        self._endpoints: dict[str, Endpoint] = {}
        self._tilt_steps = TiltSteps()
        self._image: tuple[float, float] | None = None
        self.driver = Driver(
            self._send_velocity, settings.max_linear_m_s, settings.max_yaw_rate_rad_s
        )

    def follow(self, entities: Iterable[Entity]) -> dict[str, Match]:
        """Publish where subscriptions have appeared; return what was found for each command."""
        found = tuple(entities)
        matches: dict[str, Match] = {}
        for key, topic in self._topics.items():
            match = match_topic(key, topic, COMMANDS[key][1], "MS", found)
            matches[key] = match
            known = self._endpoints.get(key)
            if match.problem or (
                known is not None and known.entity.key == match.key(self._domain, topic.name)
            ):
                continue
            self._endpoints[key] = self._participant.publish(
                topic.name, match.type, match.type_hash
            )
            if known is not None:
                self._participant.withdraw(known)
            logger.info("%s: %s (%s) of %s", key, topic.name, match.type, match.nodes[0])
        return matches

    def saw_image(self, stamp_s: float, at_s: float) -> None:
        """Note the stamp of an image, and when it came (s, monotonic)."""
        self._image = stamp_s, at_s
        self.driver.saw_image(stamp_s, at_s)

    def reaches(self, key: str, entities: Iterable[Entity]) -> bool:
        """Return whether somebody subscribes now to what is published for a command."""
        topic, endpoint = self._topics[key], self._endpoints.get(key)
        match = match_topic(key, topic, COMMANDS[key][1], "MS", entities)
        return (
            not match.problem
            and endpoint is not None
            and endpoint.entity.key == match.key(self._domain, topic.name)
        )

    def put(self, key: str, payload: bytes) -> None:
        """Publish a message, the latest one only, once somebody has subscribed."""
        endpoint = self._endpoints.get(key)
        if endpoint is not None:
            self._sender.put_latest(key, partial(endpoint.put, payload))

    def take_velocity(self, payload: bytes) -> None:
        """Pass on a TwistStamped of the navigator."""
        self.driver.take(payload, time.monotonic())

    def take_tilt(self, payload: bytes) -> None:
        """Pass on a Float64 of the navigator."""
        endpoint = self._endpoints.get("cmd_tilt")
        if endpoint is None:
            return
        try:
            tilt = decode_number(payload)
        except MessageError as error:
            logger.warning("a tilt was refused: %s", error)
            return
        kind = endpoint.entity.type
        if kind != FLOAT and not self._tilt_steps.is_due(tilt, time.monotonic()):
            return
        self.put("cmd_tilt", encode_tilt(kind, tilt, self._topics["cmd_tilt"]))

    def close(self) -> None:
        """Stop the robot, and send what is queued."""
        self.driver.stop()
        self._sender.close()

    def _send_velocity(self, linear_m_s: float, yaw_rate_rad_s: float) -> None:
        endpoint = self._endpoints.get("cmd_vel")
        if endpoint is not None:
            kind, now_ns = endpoint.entity.type, self._robot_clock_ns()
            self.put("cmd_vel", encode_velocity(kind, linear_m_s, yaw_rate_rad_s, now_ns))

    def _robot_clock_ns(self) -> int:
        """Return the time of the robot's clock, by the stamp of its last image.

        It is behind by the time that images take: a command that the network delays is older for
        the robot than it is, and the robot stops early.
        """
        image = self._image
        if image is None:
            return time.time_ns()
        seconds = image[0] + time.monotonic() - image[1]
        return round(1e9 * min(max(0.0, seconds), LAST_SECOND))
