"""Searching with a robot that navigates by itself: goals in place of velocities."""

import math
from dataclasses import replace

from ippon.command import Command, NavigationGoal
from ippon.control.goal_follower import GoalFollower
from ippon.frame import Frame
from ippon.geometry import yaw_of
from ippon.mission.behaviors.behavior import Action
from ippon.mission.behaviors.look_around import LookAround
from ippon.mission.config import MissionConfig
from ippon.mission.journal import Journal
from ippon.mission.operator_control import OperatorControl
from ippon.mission.safe_motion import moves_base
from ippon.mission.search import Search
from ippon.planning.config import PlannerConfig
from ippon.planning.interface import Planner
from ippon.planning.selection.look_target import LookConfig
from ippon.robot import RobotProfile

SILENT_TEXT = "nobody answers the goal and nothing moves: start the robot's bridge, or walk there"


class SelfNavigation:
    """Turns actions into goals, and reacts to goals that failed.

    Args:
        config: Limits of the goals.
        robot: Its camera.
        planner: Gets the points that could not be reached.
        operator: Its waypoint ends when it cannot be reached.
        look_around: Is abandoned when the robot cannot turn.
        journal: Reports failures.
    """

    def __init__(
        self,
        config: MissionConfig,
        robot: RobotProfile,
        planner: Planner,
        operator: OperatorControl,
        look_around: LookAround,
        journal: Journal,
    ) -> None:
        # People stop to talk: who stands for long has not failed.
        goals = replace(config.goals, stuck_s=math.inf) if robot.is_carried else config.goals
        self._is_carried = robot.is_carried
        self._beside_m = config.planner.connection.waypoint_reach_m
        self.follower = GoalFollower(goals, robot, config.follower.angle_tolerance_rad)
        self._planner = planner
        self._operator = operator
        self._look_around = look_around
        self._journal = journal

    def react(self, search: Search | None) -> None:
        """Count the point of a goal that failed as out of reach."""
        failed = self.follower.take_failed()
        if failed is None:
            return
        text = f"the robot's navigation could not reach ({failed.x_m:.1f}, {failed.y_m:.1f})"
        self._journal.note("out_of_reach", text)
        if self._is_waypoint(failed):
            self._operator.cancel_go_to()
            # Whoever sends the robot there once more means at once.
            self.follower.forget_goal()
        elif self.follower.is_turn(failed):
            self._look_around.abandon(search)
        else:
            self._planner.mark_unreachable((failed.x_m, failed.y_m))

    def command_of(self, action: Action, frame: Frame, dt_s: float) -> Action:
        """Return an action whose velocities are replaced by a goal.

        Args:
            action: Of a behavior; its goal, if it has one, is kept.
            frame: Pose of the robot.
            dt_s: Seconds since the last frame.
        """
        command = action.command
        if command.goal is None and command.yaw_rate_rad_s != 0.0:
            ahead = math.copysign(self.follower.config.turn_ahead_rad, command.yaw_rate_rad_s)
            heading = action.heading_rad
            if heading is None:
                heading = yaw_of(frame.T_world_base) + ahead
            command = self.follower.turn(heading, frame.T_world_base, command.tilt_rad, dt_s)
        elif moves_base(command):
            command = Command(tilt_rad=command.tilt_rad)
        silent = self.follower.is_silent and not self._is_carried
        why = SILENT_TEXT if command.goal and silent else action.why
        return replace(action, command=command, why=why)

    def _is_waypoint(self, goal: NavigationGoal) -> bool:
        """Return whether a goal led to the operator's point; one from before it is another's."""
        waypoint = self._operator.waypoint
        return waypoint is not None and math.dist((goal.x_m, goal.y_m), waypoint) <= self._beside_m


def planner_config(config: MissionConfig) -> PlannerConfig:
    """Return the planner's configuration for a robot that stops only roughly at a viewpoint."""
    planner, goals = config.planner, config.goals
    selection, closer = planner.selection, planner.closer_look
    reached_m = max(selection.reached_m, goals.near_m)

    def roughly(look: LookConfig) -> LookConfig:
        """Return a look that begins wherever a goal that is kept lets the robot stop."""
        return replace(
            look,
            reached_m=max(look.reached_m, goals.near_m + goals.moved_m),
            facing_rad=max(look.facing_rad, goals.near_rad + goals.turned_rad),
        )

    passing = replace(closer.passing, look=roughly(closer.passing.look))
    return replace(
        planner,
        selection=replace(selection, reached_m=reached_m),
        closer_look=replace(closer, look=roughly(closer.look), passing=passing),
    )
