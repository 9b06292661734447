"""A look at the floor straight ahead before a way round."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ippon.geometry import make_transform
from ippon.guidance.levels import Level
from ippon.mission.behaviors.config import FloorCheckConfig
from ippon.mission.behaviors.floor_check import FloorCheck
from ippon.mission.snapshot import MissionState
from ippon.planning.plan import NodeKind, Plan, TreeView, Viewpoint
from ippon.robot import HABITAT

DT_S = 0.2


def plan_to(x: float, y: float, cost_s: float, unseen_m: float) -> Plan:
    none, counts = np.zeros(0, np.float32), np.zeros(0, np.uint8)
    tree = TreeView(
        positions_world=np.zeros((0, 3), np.float32), parents=np.zeros(0, np.int32),
        yaws_rad=none, tilts_rad=none, gains=none, terminations=none, path_costs_s=none,
        levels=counts, kinds=counts,
    )  # fmt: skip
    target = Viewpoint(
        position_world=(x, y, 0.0), yaw_rad=0.0, tilt_rad=0.0, gain=1.0, termination=0.0,
        level=Level.AVERAGE, kind=NodeKind.EXPLORING, path_gain=1.0, path_cost_s=cost_s,
    )  # fmt: skip
    return Plan(
        target=target, path_world=np.array([[0.0, 0.0, 0.0], [x, y, 0.0]]), tree=tree,
        exhausted=False, evaluated=0, unseen_shortcut_m=unseen_m,
    )  # fmt: skip


def base(yaw: float, x: float = 0.0) -> np.ndarray:
    c, s = math.cos(yaw), math.sin(yaw)
    return make_transform(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), (x, 0.0, 0.0))


def look(check: FloorCheck, plan: Plan, *, turns: bool = True) -> tuple[float, float, float]:
    """Carry a look out; returns heading and tilt at its end, and how long it took."""
    yaw, tilt = 0.0, 0.0
    for k in range(400):
        command = check.step(plan, base(yaw), tilt, DT_S)
        if command is None:
            return yaw, tilt, k * DT_S
        assert command.linear_m_s == 0.0
        yaw += turns * command.yaw_rate_rad_s * DT_S
        step = HABITAT.max_tilt_rate_rad_s * DT_S
        tilt += float(np.clip(command.tilt_rad - tilt, -step, step))
    raise AssertionError("the look never ended")


def test_looks_along_the_straight_way_once():
    check, plan = (
        FloorCheck(FloorCheckConfig(), HABITAT),
        plan_to(0.0, 2.0, cost_s=30.0, unseen_m=1.5),
    )
    yaw, tilt, took_s = look(check, plan)
    assert yaw == pytest.approx(0.5 * math.pi, abs=0.1)
    assert tilt == pytest.approx(-0.7, abs=0.06)
    assert took_s < 0.5 * math.pi / HABITAT.max_yaw_rate_rad_s + 2.0
    assert check.step(plan, base(0.0), 0.0, DT_S) is None
    elsewhere = plan_to(0.0, -2.0, cost_s=30.0, unseen_m=1.5)
    assert check.step(elsewhere, base(0.0), 0.0, DT_S) is not None


@pytest.mark.parametrize(
    "plan",
    [
        plan_to(0.0, 2.0, cost_s=30.0, unseen_m=0.0),
        plan_to(0.0, 2.0, cost_s=12.0, unseen_m=1.5),
        replace(plan_to(0.0, 2.0, cost_s=30.0, unseen_m=1.5), target=None),
        replace(plan_to(0.0, 2.0, cost_s=30.0, unseen_m=1.5), free_turn_rad=(math.pi, 1.0)),
    ],
    ids=["nothing unseen", "hardly a way round", "no target", "no room to turn"],
)
def test_goes_on_where_a_look_would_not_pay(plan: Plan):
    assert FloorCheck(FloorCheckConfig(), HABITAT).step(plan, base(0.0), 0.0, DT_S) is None


def test_is_given_up_where_the_robot_cannot_turn():
    check = FloorCheck(FloorCheckConfig(), HABITAT)
    _, _, took_s = look(check, plan_to(0.0, 2.0, cost_s=30.0, unseen_m=1.5), turns=False)
    assert took_s < 15.0


def test_looks_down_at_what_keeps_it_from_a_room_once():
    plan = replace(plan_to(4.0, 0.0, cost_s=14.0, unseen_m=0.0), floor_gap=(0.0, -1.2))
    check = FloorCheck(FloorCheckConfig(), HABITAT)
    assert check.step(plan, base(0.0), 0.0, DT_S) is not None
    frame = SimpleNamespace(T_world_base=base(0.0), tilt_rad=0.0)
    action = FloorCheck(FloorCheckConfig(), HABITAT).act(
        SimpleNamespace(plan=plan, frame=frame, dt_s=DT_S, searches=())
    )
    assert action.why == "looking at the floor that may lead to a room"
    assert action.state is MissionState.SEARCHING
    yaw, tilt, took_s = look(check, plan)
    assert yaw == pytest.approx(-0.5 * math.pi, abs=0.1)
    assert tilt == pytest.approx(-0.7, abs=0.06)
    assert took_s < 0.5 * math.pi / HABITAT.max_yaw_rate_rad_s + 2.0
    assert check.step(plan, base(0.0), 0.0, DT_S) is None
    assert check.step(plan, base(0.0, x=1.0), 0.0, DT_S) is not None


def test_another_search_looks_again():
    check = FloorCheck(FloorCheckConfig(), HABITAT)
    plan = plan_to(0.0, 2.0, cost_s=30.0, unseen_m=1.5)

    def begins(*goals):
        running = tuple(SimpleNamespace(goal=SimpleNamespace(goal_id=n)) for n in goals)
        frame = SimpleNamespace(T_world_base=base(0.0), tilt_rad=0.0)
        return check.act(SimpleNamespace(plan=plan, frame=frame, dt_s=DT_S, searches=running))

    assert begins(1, 2) is not None
    look(check, plan)
    assert begins(1, 2) is begins(2) is begins() is begins(2) is begins(1, 2) is None
    assert begins(3) is not None, "who stood in the way may be gone"


@pytest.mark.parametrize("closer", [True, False])
def test_what_may_be_the_object_comes_before_a_room(closer):
    plan = replace(plan_to(4.0, 0.0, cost_s=14.0, unseen_m=0.0), floor_gap=(0.0, -1.2))
    assert plan.target is not None
    ends = replace(plan.target, kind=NodeKind.TERMINATING)
    plan = replace(plan, closer_look=True) if closer else replace(plan, target=ends)
    assert FloorCheck(FloorCheckConfig(), HABITAT).step(plan, base(0.0), 0.0, DT_S) is None


def test_the_floor_of_another_storey_is_checked_too():
    check, plan = (
        FloorCheck(FloorCheckConfig(), HABITAT),
        plan_to(0.0, 2.0, cost_s=30.0, unseen_m=1.5),
    )
    look(check, plan)
    upstairs = base(0.0)
    assert check.step(plan, upstairs, 0.0, DT_S) is None
    upstairs[2, 3] = 2.8
    assert check.step(plan, upstairs, 0.0, DT_S) is not None


def test_time_without_images_is_no_look():
    check, plan = (
        FloorCheck(FloorCheckConfig(), HABITAT),
        plan_to(2.0, 0.0, cost_s=30.0, unseen_m=1.5),
    )
    assert check.step(plan, base(0.0), -0.7, DT_S) is not None
    assert check.step(plan, base(0.0), 0.0, 30.0) is not None, "the camera has still to be tilted"


def test_is_dropped_when_the_robot_was_taken_elsewhere():
    check = FloorCheck(FloorCheckConfig(), HABITAT)
    assert check.step(plan_to(0.0, 2.0, 30.0, 1.5), base(0.0), 0.0, DT_S) is not None
    assert check.step(plan_to(3.0, 0.0, 2.0, 0.0), base(0.0, x=1.0), 0.0, DT_S) is None


def test_times_without_meaning_are_refused():
    with pytest.raises(ValueError, match=r"at most 10; got 2\.0, 0\.0"):
        FloorCheckConfig(hold_s=0.0)
