"""What a robot does about an object that it sees far beyond the range of its map."""

from dataclasses import replace

import numpy as np
import pytest

from ippon.guidance.levels import LabelLevel, Level
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.config import MissionConfig
from ippon.mission.snapshot import MissionState
from ippon.vocabulary import MATTERPORT_40
from tests.ippon.mission.scenarios.test_situations import toilet

START = (12.0, 2.0)
AT = np.array([20.5, 1.8])
"""In a hall of 24 m that goes on as far to the other side."""


@pytest.fixture
def hall(searcher, room):
    def make(config=None):
        robot = searcher([*room(24.0, 4.0), toilet(*AT)], *START, config=config)
        robot.ask("toilet")
        return robot

    return make


@pytest.mark.slow
def test_it_goes_straight_there_and_says_why(hall):
    robot = hall()
    robot.search(90.0)
    assert robot.last.state is MissionState.FOUND
    snapshots = [result.snapshot for result in robot.results]
    whys = [s.why for s in snapshots]
    assert any(w.startswith("going to see whether that is toilet, farther off") for w in whys)
    straight = np.hypot(*(AT - np.array(START)))
    assert robot.last.path_length_m < 1.5 * straight
    assert min(s.T_world_base[0, 3] for s in snapshots) > START[0] - 0.5, "never the other way"

    first = next(s for s in snapshots if len(s.far_evidence))
    away = np.hypot(*(first.far_evidence[:, :2] - AT).T)
    assert first.T_world_base[0, 3] < AT[0] - 6.0, "long before the map knows of it"
    assert away.min() < 1.0


def test_another_goal_begins_without_them(hall):
    robot = hall()
    robot.search(60.0, lambda r: len(r.snapshot.far_evidence) > 0)
    assert len(robot.last.far_evidence)
    robot.ask("bed", goal_id=2)
    robot.search(60.0, lambda r: r.snapshot.goal.object == "bed")
    assert len(robot.last.far_evidence) == 0


@pytest.mark.slow
def test_without_far_evidence_nothing_beyond_the_map_counts(hall):
    config = MissionConfig()
    robot = hall(replace(config, far_evidence=replace(config.far_evidence, enabled=False)))
    robot.search(60.0)
    assert all(len(result.snapshot.far_evidence) == 0 for result in robot.results)
    assert not any("farther off" in result.snapshot.why for result in robot.results)


SOFA = ("sofa", "sofa", (20.0, 1.0, 0.0), (20.9, 3.0, 0.8))


@pytest.mark.slow
def test_it_goes_to_what_may_be_the_sofa_that_the_hat_is_on(searcher, room):
    hat = ("hat", "hat", (20.3, 1.8, 0.8), (20.6, 2.1, 0.95))
    robot = searcher([*room(24.0, 4.0), SOFA, hat], *START)
    robot.ask("hat", context="I left it on the sofa")
    cue = "by what may be the sofa, farther off (certain)"
    robot.search(150.0, lambda r: cue in r.snapshot.why)
    told = EmbeddedPrior().levels("hat", "I left it on the sofa", MATTERPORT_40)
    elsewhere = LabelLevel(label="sofa", level=Level.FAR, reason="not there")
    preview = robot.mission.preview(told.changed([elsewhere]))
    assert cue in preview.now
    assert "what may be" not in preview.then
    robot.search(150.0)
    snapshots = [result.snapshot for result in robot.results]
    assert any(cue in s.why for s in snapshots)
    assert robot.last.state is MissionState.FOUND
    assert min(s.T_world_base[0, 3] for s in snapshots) > START[0] - 0.5, "never the other way"
