"""A roadmap over a map whose every voxel is known, for tests of how it is joined and entered."""

from ippon.geometry import base_pose
from ippon.planning.deadline import Deadline
from ippon.planning.roadmap.connection import ConnectionConfig, Connector
from ippon.planning.roadmap.local_planner import LocalPlanner, LocalPlannerConfig
from ippon.planning.roadmap.roadmap import Roadmap
from ippon.planning.roadmap.root_connection import RootConnector
from ippon.planning.terrain.traversability import Traversability, TraversabilityConfig
from ippon.robot import ZED
from tests.ippon.planning.test_deadline import Clock


def late() -> Deadline:
    """A deadline that has passed."""
    return Deadline(1.0, Clock(jump_s=10.0))


class Joined:
    """Floor and roadmap over one map, and what joins its nodes and leads the robot into it."""

    def __init__(self, volume, pose=None, robot=ZED, **local):
        self.volume = volume
        self.pose = base_pose(1.3, 1.3, 0.0, 0.0) if pose is None else pose
        self.floor = Traversability(TraversabilityConfig(), robot)
        self.floor.update(volume.arrays(), self.pose)
        self.roadmap = Roadmap(30)
        self.local_planner = LocalPlanner(LocalPlannerConfig(**local), self.floor, 5)
        self.connector = Connector(
            ConnectionConfig(), self.roadmap, self.floor, self.local_planner, robot
        )
        self.root = RootConnector(
            ConnectionConfig(), self.roadmap, self.floor, self.local_planner, robot
        )

    def add(self, x, y):
        node = self.roadmap.add_node(x, y)
        self.connector.connect(node)
        return node

    def tree(self, yaw=0.0, target=None, path=None):
        x, y = self.pose[0, 3], self.pose[1, 3]
        root_edges = self.root.edges(x, y, yaw, target, path)
        return root_edges, self.roadmap.shortest_tree(root_edges, yaw, ZED.max_yaw_rate_rad_s)
