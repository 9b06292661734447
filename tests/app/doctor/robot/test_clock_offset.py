import dataclasses

import pytest

from app.doctor.robot.clock_offset import check_offset
from tests.app.links.robot_streams.turning_robot import TurningRobot


@pytest.fixture(scope="module")
def turning():
    return TurningRobot()


@pytest.mark.slow
def test_the_line_offers_the_entry_of_the_profile(turning):
    finding = check_offset(turning.depths, turning.camera, turning.pose_at(0.12))
    assert finding.verdict == "warning"
    assert "`clock_offset_ms: 12" in finding.do or "`clock_offset_ms: 11" in finding.do
    assert "degrees" in finding.detail
    corrected = turning.pose_at(0.12)
    known = check_offset(turning.depths, turning.camera, lambda s: corrected(s + 120_000_000), 0.12)
    assert known.verdict == "ok", known


@pytest.mark.slow
def test_a_robot_that_stands_tells_nothing():
    standing = dataclasses.replace(
        check_offset((still := TurningRobot(yaw_rate=0.0)).depths, still.camera, still.pose_at()),
        do="",
    )
    assert standing.verdict == "ok"
    assert "not compared" in standing.detail
