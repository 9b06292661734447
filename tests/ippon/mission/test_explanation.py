"""The line that says why the robot goes where it goes."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ippon.guidance.levels import BY_OPERATOR, LabelLevel, Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission import inspection
from ippon.mission.explanation import explain
from ippon.mission.goal import Goal
from ippon.mission.inspection import inspect_voxel
from ippon.planning.plan import NodeKind, Plan, TreeView, Viewpoint
from ippon.vocabulary import MATTERPORT_40

KITCHEN = [
    ("counter", "counter", (1.0, 3.4, 0.0), (3.0, 4.0, 0.9)),
    ("sink", "sink", (3.1, 3.4, 0.0), (3.7, 4.0, 0.9)),
    ("cabinet", "cabinet", (0.5, 0.0, 0.0), (4.5, 0.4, 2.0)),
    ("wall", "wall", (5.0, 0.0, 0.0), (5.1, 1.5, 2.5)),
    ("wall", "wall", (5.0, 2.4, 0.0), (5.1, 4.0, 2.5)),
]


@pytest.fixture
def made_up_plan():
    target = Viewpoint(
        position_world=(1.0, 2.0, 0.0), yaw_rad=0.0, tilt_rad=0.0, gain=0.25, termination=0.0,
        level=Level.AVERAGE, kind=NodeKind.EXPLORING, path_gain=0.25, path_cost_s=3.0,
    )  # fmt: skip
    none = np.zeros(0, np.float32)
    tree = TreeView(
        positions_world=np.zeros((0, 3), np.float32), parents=np.zeros(0, np.int32), yaws_rad=none,
        tilts_rad=none, gains=none, terminations=none, path_costs_s=none,
        levels=np.zeros(0, np.uint8), kinds=np.zeros(0, np.uint8),
    )  # fmt: skip
    path = np.zeros((2, 3))
    return Plan(target=target, path_world=path, tree=tree, exhausted=False, evaluated=0)


def test_a_target_of_a_rule_has_a_worth_and_no_gain(made_up_plan):
    told = explain(replace(made_up_plan, by_rule=True), None, None, None)
    assert told == "going where the method's rule leads: worth 0.25, 3.0 s away"
    reasoned = replace(made_up_plan, by_rule=True, rule_reason="the room is left alone for 20 s")
    told = explain(reasoned, None, None, None)
    assert told == ("by the method's rule, the room is left alone for 20 s: worth 0.25, 3.0 s away")


@pytest.mark.slow
def test_the_object_that_a_level_comes_from_is_named_and_so_is_its_room(searcher, room):
    robot = searcher([*room(9.0, 4.0), *KITCHEN], 1.5, 2.0)
    robot.ask("mug")
    mission = robot.mission
    wanted = "by the counter (near)"
    results = robot.search(60.0, lambda r: wanted in r.snapshot.why)
    assert wanted in results[-1].snapshot.why

    front = np.array([2.2, 3.45, 0.6])
    report = inspect_voxel(mission.voxel_map, front, mission.floor_z_m)
    assert report.labels[0][0] == "counter"
    assert (report.level, report.room()) == (Level.NEAR, "kitchen")

    mug = EmbeddedPrior().levels("mug", "", MATTERPORT_40)
    far = LabelLevel(label="counter", level=Level.FAR, reason=BY_OPERATOR)
    preview = mission.preview(mug.changed([far]))
    assert wanted in preview.now
    assert "counter (near)" not in preview.then


class Steered(SimpleNamespace):
    """A planner that another set of levels leads elsewhere."""

    def __getattr__(self, name):
        return lambda *_: None

    def preview(self, map_arrays, *, cues):
        return self.target


@pytest.mark.parametrize(
    ("look", "kind", "then"),
    [
        ({"closer_look": True}, NodeKind.EXPLORING, "going closer to what may be hat, 3.0 s away"),
        ({"out_of_reach_m": 1.0}, NodeKind.EXPLORING, "no way leads close to hat"),
        ({"closer_look": True}, NodeKind.TERMINATING, "going to where hat can be seen from close"),
        ({"by_rule": True}, NodeKind.TERMINATING, "going to where hat can be seen from close"),
    ],
)
def test_other_levels_change_a_look_only_where_the_object_shows(
    made_up_plan, monkeypatch, look, kind, then
):
    monkeypatch.setattr(inspection, "with_levels", lambda *_: None)
    target = replace(made_up_plan.target, position_world=(5.0, 5.0, 0.0), kind=kind)
    plan, guidance = replace(made_up_plan, **look), EmbeddedPrior().levels("hat", "", ["sofa"])
    goal = Goal(goal_id=1, object="hat", display="hat")
    search = SimpleNamespace(goal=goal, guidance=guidance)
    found = inspection.preview(Steered(target=target), plan, None, search, guidance)
    assert found.then.startswith(then)
    assert (found.after == target) is (kind is NodeKind.TERMINATING)
    assert (found.after == plan.target) is (kind is not NodeKind.TERMINATING)
