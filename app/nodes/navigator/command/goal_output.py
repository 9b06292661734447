"""Sends goals to a robot that navigates by itself, and reads what it says about them.

A goal is sent once. While it is in force, `navigation/active` repeats its stamp, with the pose
where the robot stands; a stamp of 0 means that no goal is in force. The robot cancels its goal
then, and when these messages stop.
"""

import logging
import math
import threading
from collections.abc import Callable
from typing import Final

import numpy as np
import zenoh

from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.navigation import StampedPose, decode_goal_status, encode_pose
from ippon.command import GoalOutcome, NavigationGoal
from ippon.geometry import Float64Array, base_pose, invert_transform

logger = logging.getLogger(__name__)

STALE_S: Final = 2.0
"""Age of the frame from which a goal is cancelled: the robot itself looks where it drives."""
MOST_KNOWN: Final = 50

Report = Callable[[int, GoalOutcome], None]


class GoalOutput:
    """Publishes the goal in force; safe from any thread.

    Args:
        session: An open session.
        robot: Key prefix.
        report: Gets number and outcome of a goal, in a thread of zenoh.
        T_map_world: From the frame of the robot's poses to that of the map; None for the same.
    """

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        report: Report,
        T_map_world: Float64Array | None = None,
    ) -> None:
        self._T_world_map = np.eye(4) if T_map_world is None else invert_transform(T_map_world)
        self._report = report
        self._lock = threading.Lock()
        self._numbers: dict[int, int] = {}
        self._reported: tuple[int, GoalOutcome] | None = None
        self._in_force: tuple[int, int] | None = None
        self._last_ns = 0
        self._goal = command_publisher(session, f"{robot}/{keys.NAVIGATION_GOAL}")
        self._active = command_publisher(session, f"{robot}/{keys.NAVIGATION_ACTIVE}")
        subscribe(session, f"{robot}/{keys.NAVIGATION_STATUS}", self._receive)

    def send(self, goal: NavigationGoal | None, T_map_base: Float64Array, stamp_ns: int) -> None:
        """Put a goal in force, or none.

        Args:
            goal: In the map's frame; None cancels.
            T_map_base: Where the robot stands.
            stamp_ns: Stamp of the frame that the goal answers.
        """
        with self._lock:
            if goal is None:
                self._in_force = None
            elif self._in_force is None or self._in_force[0] != goal.number:
                self._begin(goal, float(T_map_base[2, 3]), stamp_ns)
            active_ns = 0 if self._in_force is None else self._in_force[1]
            here = self._T_world_map @ T_map_base
            self._active.put(encode_pose(StampedPose(stamp_ns=active_ns, T_frame_base=here)))

    def _begin(self, goal: NavigationGoal, z_m: float, stamp_ns: int) -> None:
        self._last_ns = max(self._last_ns + 1, stamp_ns)
        self._in_force = goal.number, self._last_ns
        self._numbers[self._last_ns] = goal.number
        while len(self._numbers) > MOST_KNOWN:
            del self._numbers[next(iter(self._numbers))]
        T_frame_base = self._T_world_map @ base_pose(goal.x_m, goal.y_m, z_m, goal.yaw_rad)
        pose = StampedPose(stamp_ns=self._last_ns, T_frame_base=T_frame_base)
        self._goal.put(encode_pose(pose))
        logger.info(
            "goal %d: %.2f, %.2f m, %.0f degrees", goal.number, goal.x_m, goal.y_m,
            math.degrees(goal.yaw_rad),
        )  # fmt: skip

    def _receive(self, payload: bytes) -> None:
        try:
            stamp_ns, outcome = decode_goal_status(payload)
        except MessageError as error:
            logger.debug("a status of a goal is skipped: %s", error)
            return
        with self._lock:
            number = self._numbers.get(stamp_ns)
            current = self._in_force is not None and self._in_force[1] == stamp_ns
            if self._reported == (stamp_ns, outcome):
                return
            self._reported = stamp_ns, outcome
        # What the navigator has cancelled itself is no news.
        if number is not None and (current or outcome is GoalOutcome.FAILED):
            self._report(number, outcome)


def command_publisher(session: zenoh.Session, key: str) -> zenoh.Publisher:
    """Return a publisher of what moves the robot: before all else, and none is dropped."""
    return session.declare_publisher(
        key,
        priority=zenoh.Priority.REAL_TIME,
        congestion_control=zenoh.CongestionControl.BLOCK,
        express=True,
    )
