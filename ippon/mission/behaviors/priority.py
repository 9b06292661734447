"""The behaviors in the order of their priority."""

from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.behaviors.behavior import Action, Behavior, StepContext
from ippon.mission.behaviors.confirmation import Confirmation
from ippon.mission.behaviors.exhaustion import Exhaustion
from ippon.mission.behaviors.floor_check import FloorCheck
from ippon.mission.behaviors.look_around import LookAround
from ippon.mission.behaviors.operator_drive import GoToPoint, ManualDrive
from ippon.mission.behaviors.pursuit import Pursuit
from ippon.mission.behaviors.recovery import Recovery
from ippon.mission.behaviors.step_closer import StepCloser
from ippon.mission.config import MissionConfig
from ippon.mission.finds.second_opinion import SecondOpinions
from ippon.mission.journal import Journal
from ippon.mission.operator_control import OperatorControl
from ippon.mission.places.room_regions import RoomRegions
from ippon.planning.interface import Planner
from ippon.robot import RobotProfile


class Behaviors:
    """Asks the behaviors in order of priority until one returns an action."""

    def __init__(
        self,
        config: MissionConfig,
        robot: RobotProfile,
        voxel_map: VoxelMap,
        planner: Planner,
        operator: OperatorControl,
        journal: Journal,
        opinions: SecondOpinions,
        rooms: RoomRegions,
    ) -> None:
        self.recovery = Recovery(config.recovery, robot)
        self.look_around = LookAround(config.look_around, robot, journal)
        self._by_priority: tuple[Behavior, ...] = (
            ManualDrive(operator),
            self.recovery,
            GoToPoint(operator, planner, journal),
            self.look_around,
            Exhaustion(config, voxel_map, planner, journal),
            FloorCheck(config.floor_check, robot),
            Confirmation(
                config,
                voxel_map,
                journal,
                opinions,
                rooms,
                StepCloser(config.step_closer, planner, robot),
            ),
            Pursuit(config.travel_pitch, robot, voxel_map),
        )

    def act(self, step: StepContext) -> Action:
        """Return the action of the first behavior that has one; else hold still."""
        actions = (behavior.act(step) for behavior in self._by_priority)
        return next((action for action in actions if action is not None), Action(step.hold))
