"""What the navigator says of a robot whose messages are not as they should be; in one process."""

from dataclasses import replace

import pytest

from app.messages import keys
from app.messages.control import ControlRequest, SearchRequest, encode
from app.messages.perception.detector_info import encode_detector_name, encode_label_names
from app.nodes.navigator import profile_check
from tests.app.nodes.navigator.scenarios.standing_robot import seen_on_the_wall, wait_until


@pytest.mark.slow
def test_refused_frames_are_shown_until_one_is_accepted(robot):
    rejected = {s.name: s.rejected for s in robot.statuses[-1].streams}
    # It goes on jumping, farther than any speed makes up for.
    jump = 50.0
    told = "frames are refused: the camera jumped 50"
    refused = lambda s: s.state == "lost" and s.why.startswith(told)  # noqa: E731
    status = robot.send_until(refused, jump_m=jump)
    after = {s.name: s.rejected for s in status.streams}
    assert after["pose"] > rejected["pose"]
    assert after["depth"] == rejected["depth"]
    assert robot.send_until(lambda s: s.state != "lost").state == "looking_around"


@pytest.mark.slow
def test_a_segmentation_that_stops_is_reported_and_the_search_goes_on(robot):
    told = lambda s: bool(s.notes) and s.state != "lost"  # noqa: E731
    status = robot.send_until(told, heatmap=False)
    assert status.notes == ["no heatmap: objects are not recognised; the search continues"]
    assert status.state == "looking_around"
    assert robot.send_until(lambda s: not s.notes).goal.outcome == "active"
    told = [(e.kind, e.text[:10]) for e in robot.events if "heatmap" in e.text]
    assert told == [("stream_lost", "no heatmap"), ("stream_back", "heatmap is")]


@pytest.mark.slow
def test_a_heatmap_that_comes_late_counts_once_and_its_depth_not_again(robot):
    frames = robot.send_until(lambda s: bool(s.notes), heatmap=False).frames
    robot.send_until(lambda s: s.frames > frames + 3, heatmap=False)
    # Silent for so long, it has no frame that waits.
    wait_until(lambda: robot.statuses[-1].state == "lost")
    voxel_map = robot.navigator._mission.voxel_map
    revision, weight = voxel_map.revision, voxel_map._pools.weight.copy()
    labels, odds = voxel_map.surface.energy.copy(), voxel_map.surface.log_odds.copy()
    # Another image from the same place would say the same once more.
    robot._heatmap = replace(robot._heatmap, probabilities=255 - robot._heatmap.probabilities)
    for stamp_ns in sorted(robot.navigator._intake.assembler._without)[-2:]:
        robot.send_heatmap(stamp_ns)
    wait_until(lambda: voxel_map.revision == revision + 2)
    assert (voxel_map.surface.energy != labels).any()
    assert (voxel_map.surface.log_odds != odds).any()
    assert (voxel_map._pools.weight == weight).all()


@pytest.mark.slow
def test_a_robot_that_is_not_what_its_profile_says_is_told_and_forgiven(robot, monkeypatch):
    monkeypatch.setattr(profile_check, "CHECK_EVERY_S", 0.5)
    status = robot.send_until(lambda s: bool(s.notes), lift_m=0.5)
    (note,) = status.notes
    assert note.startswith("robot profile: by tf the camera is 1.70 m above the base, the profile")
    robot.send_until(lambda s: s.frames > status.frames + 12, lift_m=0.5)
    told = [e.kind for e in robot.events if "above the base" in e.text]
    assert told == ["error"], "once, however long it lasts"
    assert robot.send_until(lambda s: not s.notes).goal.outcome == "active"


@pytest.mark.slow
def test_a_detector_on_the_robot_makes_the_map_believe(robot):
    voxel_map = robot.navigator._mission.voxel_map
    for key, request in (
        (keys.SEARCH, SearchRequest(object="crown")),
        (keys.CONTROL, ControlRequest(action="cancel")),
    ):
        list(robot._session.get(f"r/{key}", payload=encode(request), timeout=10.0))
    robot.send_until(lambda _: voxel_map.ooi == "crown", heatmap=False)
    assert voxel_map.best_ooi() < 0.5
    crown = seen_on_the_wall("crown")
    robot.send_until(lambda _: voxel_map.best_ooi() > 0.9, heatmap=False, detector=crown)


@pytest.mark.slow
def test_a_detector_that_cannot_tell_the_object_says_what_it_can(robot):
    robot._session.put(f"r/{keys.DETECTOR_NAME}", encode_detector_name("yolo11n", 0))
    robot._session.put(f"r/{keys.LABEL_NAMES}", encode_label_names(["cup", "chair"], 0))
    status = robot.send_until(
        lambda s: any("is none of them" in note for note in s.notes),
        heatmap=False, detector=seen_on_the_wall(),
    )  # fmt: skip
    note = next(note for note in status.notes if "is none of them" in note)
    assert note.startswith("this detector knows 2 kinds of thing and 'hat' is none of them")
    assert "it knows: cup, chair" in note


@pytest.mark.slow
def test_a_detector_that_stamps_its_messages_itself_is_told(robot):
    robot.send_until(
        lambda s: any("no image has the stamp" in note for note in s.notes),
        heatmap=False, detector=seen_on_the_wall(), stamp_off_ns=50_000_000,
    )  # fmt: skip
    robot.send_until(lambda s: not s.notes, heatmap=False, detector=seen_on_the_wall())


@pytest.mark.slow
def test_a_detector_that_dies_is_reported_and_the_search_goes_on(robot):
    robot.send_until(lambda s: s.frames > 6, heatmap=False, detector=seen_on_the_wall())
    said = "objects are not recognised"
    robot.send_until(
        lambda s: s.state != "lost" and any(said in note for note in s.notes), heatmap=False
    )
    robot.send_until(lambda s: not s.notes, heatmap=False, detector=seen_on_the_wall())


@pytest.mark.slow
def test_depth_at_half_the_rate_of_colour_is_told_until_it_keeps_up(robot):
    said = "25 of the last 50 colour images have no depth image within 20 ms of their stamp"
    robot.send_until(lambda s: any(said in note for note in s.notes), depth_every=2)
    robot.send_until(lambda s: not any("no depth image" in note for note in s.notes))
