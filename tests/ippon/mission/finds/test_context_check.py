"""What is not where the operator said must look more like the object."""

import numpy as np
import pytest

from ippon.mission.config import MissionConfig
from ippon.mission.finds.context_check import ContextCheckConfig, contradicts_context
from ippon.mission.finds.image_check import ImageCheckConfig
from ippon.mission.goal import Goal
from ippon.mission.snapshot import Find, MissionState
from tests.ippon.mission.conftest import Searcher, boxed_room

TABLE = ("table", "table", (3.0, 2.6, 0.0), (4.2, 3.4, 0.7))
ON_TABLE = ("hat", "objects", (3.2, 2.7, 0.7), (3.5, 3.0, 0.85))
BED = ("bed", "bed", (5.4, 1.0, 0.0), (7.4, 2.6, 0.5))
ON_BED = ("hat", "objects", (5.7, 1.5, 0.5), (6.0, 1.8, 0.65))


@pytest.fixture
def searching(searcher, room):
    """Search for a hat that never looks as much like one as it would have to elsewhere."""

    def search(boxes, context, seconds=200.0):
        # At outlines pixels mix: no find looks like itself in all of its voxels.
        config = MissionConfig(image_check=ImageCheckConfig(elsewhere_share=1.0))
        robot = searcher([*room(8.0, 4.0), *boxes], 1.0, 2.0, config=config)
        robot.ask("hat", context=context)
        results = robot.search(seconds)
        return robot, [event for r in results for event in r.snapshot.events]

    return search


def _at(robot):
    assert robot.last.state is MissionState.FOUND
    return np.array(robot.last.find.position_world[:2])


@pytest.mark.slow
@pytest.mark.parametrize("context", ["", "I left it on the table."])
def test_what_is_where_the_operator_said_is_found_as_ever(searching, context):
    robot, events = searching([TABLE, ON_TABLE, BED, ON_BED], context)
    assert _at(robot) == pytest.approx([3.35, 2.85], abs=0.2)
    assert "doubted" not in [event.kind for event in events]


@pytest.mark.slow
def test_what_is_elsewhere_is_passed_by_for_what_is_where_the_operator_said(searching):
    robot, events = searching([TABLE, ON_TABLE, BED, ON_BED], "I left it on the bed.")
    assert _at(robot) == pytest.approx([5.85, 1.65], abs=0.2)
    doubts = [event.text for event in events if event.kind == "doubted"]
    assert doubts == ["what seemed to be hat is not where you said: going on"]


@pytest.mark.slow
def test_an_operator_who_errs_gets_it_when_nothing_better_is_left(searching):
    robot, events = searching([TABLE, ON_TABLE, BED], "I left it on the bed.")
    assert _at(robot) == pytest.approx([3.35, 2.85], abs=0.2)
    kinds = [event.kind for event in events]
    assert kinds.index("doubted") < kinds.index("reconsidered") < kinds.index("found")
    assert "perhaps: nothing looks more like it" in robot.last.why


@pytest.fixture(scope="module")
def mapped():
    """A room whose table at x = 3.6 m and bed at x = 6.4 m the robot has seen."""
    robot = Searcher([*boxed_room(8.0, 4.0), TABLE, BED], 4.6, 1.2)
    robot.ask("umbrella")
    robot.search(12.0)
    return robot.mission.voxel_map


@pytest.mark.slow
@pytest.mark.parametrize(
    ("context", "elsewhere"),
    [
        ("I left it on the bed.", True),
        ("I left it on the table.", False),
        ("It is near the table.", False),
        ("It is on the table or on the bed.", False),
        ("", False),
        ("It is not on the bed.", False),
        ("I looked on the table already.", False),
        ("It is in the bedroom.", False),
        ("It is on the bed or in the kitchen.", False),
        ("It is perhaps on the bed.", False),
        ("It is old and grey.", False),
    ],
)
def test_only_a_stated_thing_that_is_not_there_speaks_against_a_find(mapped, context, elsewhere):
    find = Find(
        position_world=(3.4, 2.8, 0.8), size_m=(0.3, 0.3, 0.2), probability=1.0, voxels=6,
        box_px=None,
    )  # fmt: skip
    goal = Goal(goal_id=1, object="hat", display="hat", context=context, category=None)
    assert contradicts_context(ContextCheckConfig(), find, goal, context, mapped) is elsewhere


def test_gaps_that_contradict_each_other_are_refused():
    with pytest.raises(ValueError, match="gaps must grow: 0 <= touching_m <= beside_m"):
        ContextCheckConfig(touching_m=2.0)
