"""Publishes events: what happens once and concerns the operator or a reviewer."""

import logging
from functools import partial

import zenoh

from app.links.network.sender import Sender
from app.messages import keys
from app.messages.control import encode
from app.messages.status import Event
from app.nodes.navigator.state.goal_queue import GoalQueue

logger = logging.getLogger(__name__)


class EventPublisher:
    """Publishes and logs events with the current stamp and goal; safe from any thread."""

    def __init__(
        self, session: zenoh.Session, robot: str, goals: GoalQueue, sender: Sender
    ) -> None:
        self.stamp_ns = 0
        """Stamp of the latest step, on the robot's clock."""
        self._goals = goals
        self._sender = sender
        self._publisher = session.declare_publisher(
            f"{robot}/{keys.EVENT}", congestion_control=zenoh.CongestionControl.BLOCK
        )

    def report(
        self, kind: str, text: str, goal_id: int | None = None, find: int | None = None
    ) -> None:
        """Publish and log one event, of the leading goal unless another number is given.

        Args:
            kind: One of those of `Event`.
            text: One line for the operator.
            goal_id: Number of a goal that does not lead.
            find: Number of the find that was judged.
        """
        lead, _, _ = self._goals.statuses()
        event = Event(
            stamp_ns=self.stamp_ns,
            kind=kind,  # pyright: ignore[reportArgumentType]
            text=text,
            goal_id=goal_id if goal_id is not None or lead is None else lead.goal_id,
            find=find,
        )
        payload = encode(event)
        self._sender.put(len(payload), partial(self._publisher.put, payload))
        logger.info("%s: %s", kind, text)

    def report_bad_message(self, text: str) -> None:
        """Report a message of the robot that was skipped."""
        logger.warning("message skipped: %s", text)
        self.report("bad_message", text)
