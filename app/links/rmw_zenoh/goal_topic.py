"""Goals as messages of a topic, for a robot that navigates by itself without an action."""

from collections.abc import Callable, Iterable
from dataclasses import replace

from app.links.rmw_zenoh.command_output import CommandOutput
from app.links.rmw_zenoh.protocol.tokens import Entity
from app.messages.navigation import decode_pose, encode_pose
from app.ros2.ippon_ros2.goals import ACCEPTED, Ended
from app.ros2.ippon_ros2.settings import Topic


class GoalTopic:
    """A topic of PoseStamped. Its robot says nothing: a cancelled goal is one where it stands.

    Args:
        commands: Publishes where somebody subscribes.
        topic: Of the goals, with the frame in which they are.
        ended: Takes a goal with its status.
        entities: Returns the robot's graph of now: who subscribes.
    """

    def __init__(
        self,
        commands: CommandOutput,
        topic: Topic,
        ended: Ended,
        entities: Callable[[], Iterable[Entity]],
    ) -> None:
        self._commands, self._frame, self._ended = commands, topic.frame, ended
        self._entities = entities

    def send(self, goal: bytes) -> bool:
        """See `Navigation.send`."""
        if not self._commands.reaches("goal", self._entities()):
            return False
        self._commands.put("goal", in_frame(goal, self._frame))
        self._ended(goal, ACCEPTED)
        return True

    def cancel(self, here: bytes) -> None:
        """See `Navigation.cancel`."""
        if here:
            self._commands.put("goal", in_frame(here, self._frame))

    def cancel_every(self, here: bytes) -> bool:
        """See `Navigation.cancel_every`."""
        if not here or not self._commands.reaches("goal", self._entities()):
            return False
        self.cancel(here)
        return True


def in_frame(goal: bytes, frame: str) -> bytes:
    """Return a serialized PoseStamped with another frame; an empty one leaves it.

    Raises:
        MessageError: It is none, or no pose.
    """
    pose = decode_pose(goal)
    return encode_pose(replace(pose, frame_id=frame) if frame else pose)
