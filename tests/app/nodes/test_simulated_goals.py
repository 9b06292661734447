import numpy as np

from app.messages.navigation import StampedPose, encode_pose
from app.nodes.simulated_goals import WATCHDOG_S, SimulatedGoals
from ippon.geometry import base_pose


def pose(stamp_ns, T=None):
    return encode_pose(StampedPose(stamp_ns=stamp_ns, T_frame_base=np.eye(4) if T is None else T))


def test_a_goal_holds_while_the_navigator_says_so():
    goals = SimulatedGoals()
    assert goals.in_force(0.0) is None
    goals.take_goal(pose(7, base_pose(1.0, 2.0, 0.0, 0.5)))
    began = goals._at
    goal = goals.in_force(began)
    assert (goal.number, goal.x_m, goal.y_m) == (7, 1.0, 2.0)
    assert goals.in_force(began + WATCHDOG_S + 0.1) is None
    goals.take_active(pose(7))
    assert goals.in_force(goals._at) is not None
    goals.take_active(pose(0))
    assert goals.in_force(goals._at) is None
