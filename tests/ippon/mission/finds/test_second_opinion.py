"""A second opinion is weighed, shown, waited for briefly, and asked for once."""

from types import SimpleNamespace

import numpy as np
import pytest

from ippon.frame import NANOSECONDS
from ippon.mission.config import MissionConfig
from ippon.mission.finds.second_opinion import (
    Opinion,
    SecondOpinionConfig,
    SecondOpinions,
    crop_of,
)
from ippon.mission.snapshot import Find, MissionState

BED = ("bed", "bed", (4.0, 1.2, 0.0), (5.9, 3.0, 0.55))


@pytest.fixture
def robot(searcher, room):
    robot = searcher([*room(6.0, 4.5), BED], 1.0, 2.0)
    robot.requests = []
    robot.mission.opinions.ask = robot.requests.append
    robot.ask("bed")
    return robot


def answering(robot, opinion):
    def ask(request):
        robot.requests.append(request)
        assert robot.mission.opinions.answer(request.number, opinion)

    robot.mission.opinions.ask = ask


def said(robot, kind):
    return [e.text for r in robot.results for e in r.snapshot.events if e.kind == kind]


@pytest.mark.slow
def test_a_yes_is_asked_for_once_shown_and_raises_the_find(robot):
    answering(robot, Opinion(verdict="yes", text="a made bed", by="tiny"))
    robot.search(90.0)
    assert robot.last.state is MissionState.FOUND
    assert len(robot.requests) == 1
    (request,) = robot.requests
    assert request.object == "bed"
    assert request.crop.ndim == 3
    assert min(request.crop.shape[:2]) > 8
    assert said(robot, "opinion") == ["tiny agrees: a made bed"]
    assert robot.last.why.endswith("; tiny agrees: a made bed")


@pytest.mark.slow
def test_a_no_that_outweighs_the_map_sets_the_find_aside_and_says_why(searcher, room):
    config = MissionConfig(second_opinion=SecondOpinionConfig(no_nats=-12.0))
    robot = searcher([*room(6.0, 4.5), BED], 1.0, 2.0, config=config)
    robot.requests = []
    answering(robot, Opinion(verdict="no", text="a pile of boxes", by="tiny"))
    robot.ask("bed")
    robot.search(90.0, until=lambda r: any(e.kind == "doubted" for e in r.snapshot.events))
    (text,) = said(robot, "doubted")
    assert text.startswith("what seemed to be bed is probably not one (p = 0.")
    assert text.endswith("tiny disagrees: a pile of boxes: going on")
    assert robot.last.state is not MissionState.FOUND


@pytest.mark.slow
def test_a_no_is_weighed_not_obeyed(robot):
    """The map is surer of this bed than a no can undo."""
    answering(robot, Opinion(verdict="no", by="tiny"))
    robot.search(90.0)
    assert robot.last.state is MissionState.FOUND
    assert robot.last.why.endswith("; tiny disagrees")


@pytest.mark.slow
def test_unsure_changes_nothing(robot):
    answering(robot, Opinion(verdict="unsure", by="tiny"))
    robot.search(90.0)
    assert robot.last.state is MissionState.FOUND
    before = max(c.probability for c in robot.last.candidates)
    assert robot.last.find.probability == pytest.approx(before, abs=0.01)


@pytest.mark.slow
def test_a_find_without_an_answer_is_announced_in_the_end(robot):
    robot.search(120.0)
    assert robot.last.state is MissionState.FOUND
    (text,) = said(robot, "opinion")
    assert text == "no second opinion: no answer within 8 s"
    waited = [r.snapshot for r in robot.results if "waiting for a second opinion" in r.snapshot.why]
    assert 7.0 < (waited[-1].stamp_ns - waited[0].stamp_ns) * 1e-9 < 9.5
    assert not robot.mission.opinions.answer(robot.requests[0].number, Opinion(verdict="no"))
    assert len(robot.requests) == 1


@pytest.mark.slow
def test_an_answer_for_another_goal_is_ignored(robot):
    robot.search(90.0, until=lambda _: bool(robot.requests))
    old = robot.requests[0]
    robot.ask("bed", goal_id=2)
    robot.search(60.0, until=lambda _: len(robot.requests) == 2)
    assert len(robot.requests) == 2
    assert not robot.mission.opinions.answer(old.number, Opinion(verdict="no"))
    assert robot.mission.opinions.answer(robot.requests[1].number, Opinion(verdict="yes"))


def test_goals_of_a_tour_are_asked_about_once_each():
    opinions, requests = SecondOpinions(SecondOpinionConfig()), []
    opinions.ask = requests.append
    mug, plate = (
        Find(
            position_world=(x, 1.0, 0.8), size_m=(0.1, 0.1, 0.1), probability=0.9, voxels=3,
            box_px=(10, 10, 30, 30),
        )
        for x in (1.0, 1.2)
    )  # fmt: skip
    for n in range(4):
        frame = SimpleNamespace(stamp_ns=n * NANOSECONDS, color=np.zeros((60, 100, 3), np.uint8))
        for goal_id, find in ((1, mug), (2, plate)):
            weighed = opinions.weigh(find, goal_id, "", frame, running=(1, 2))
            assert weighed.waiting
    assert len(requests) == 2
    assert opinions.answer(requests[0].number, Opinion(verdict="yes"))
    weighed = opinions.weigh(mug, 1, "", frame, running=(1, 2))
    assert weighed.opinion is not None
    assert opinions.weigh(plate, 2, "", frame, running=(2,)).waiting
    assert opinions.weigh(mug, 1, "", frame, running=(1,)).waiting, "another search asks again"


@pytest.mark.slow
def test_without_a_model_nothing_is_asked_or_said(searcher, room):
    robot = searcher([*room(6.0, 4.5), BED], 1.0, 2.0)
    robot.ask("bed")
    robot.search(90.0)
    assert robot.last.state is MissionState.FOUND
    assert said(robot, "opinion") == []


@pytest.mark.parametrize(
    "wrong", [{"wait_s": 100.0}, {"yes_nats": -1.0}, {"no_nats": 1.0}, {"wait_s": float("nan")}]
)
def test_answers_that_would_say_the_opposite_are_refused(wrong):
    with pytest.raises(ValueError, match="yes_nats is 0 or more"):
        SecondOpinionConfig(**wrong)


def test_a_crop_without_pixels_is_refused():
    with pytest.raises(ValueError, match="min_crop_px must be at least 1"):
        SecondOpinionConfig(min_crop_px=0)


@pytest.mark.parametrize("box", [(0, 0, 5, 5), (90, 50, 100, 60), (-20, -20, 300, 200)])
def test_a_crop_stays_in_the_image(box):
    crop = crop_of(SecondOpinionConfig(), np.zeros((60, 100, 3), np.uint8), box)
    assert 0 < crop.shape[0] <= 60
    assert 0 < crop.shape[1] <= 100
