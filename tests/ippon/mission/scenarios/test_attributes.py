"""Which of two mugs is found: the one that was asked for."""

import dataclasses

import numpy as np
import pytest

from ippon.guidance.language.requests.sentence import goal_named
from ippon.mission.snapshot import MissionState
from ippon.simulation.homes.config import MUG_COLORS

MUGS = {"white": (3.0, 1.0), "red": (3.0, 3.9)}
"""Colours and places of the mugs; the white one is nearer."""


@pytest.fixture
def robot(searcher, room):
    """A robot in a room with a red and a white mug, each on a box of its own."""
    return _among(searcher, room, MUGS)


def _among(searcher, room, colours):
    boxes = list(room(6.0, 4.5))
    for x, y in (MUGS[name] for name in colours):
        boxes.append(("counter", "counter", (x - 0.25, y - 0.25, 0.0), (x + 0.25, y + 0.25, 0.5)))
        boxes.append(("objects", "mug", (x - 0.08, y - 0.08, 0.5), (x + 0.08, y + 0.08, 0.7)))
    robot = searcher(boxes, 1.0, 1.2)
    robot.paint("mug", [MUG_COLORS[name] for name in colours])
    return robot


def _search(robot, text):
    goal, guidance = robot.ask(text)
    told = dataclasses.replace(goal, attributes=goal_named(text).attributes)
    robot.mission.goals.set_goal(told, guidance)
    results = robot.search(180.0)
    return [event for one in results for event in one.snapshot.events]


def _distance(find, colour):
    return float(np.linalg.norm(np.array(find.position_world[:2]) - MUGS[colour]))


@pytest.mark.slow
def test_the_red_one_of_two_mugs_is_found_and_the_other_announced(robot):
    events = _search(robot, "red mug")
    find = robot.last.find
    assert robot.last.state is MissionState.FOUND
    assert _distance(find, "red") < 0.3
    (red,) = find.attributes
    assert (red.value, red.verdict, red.by) == ("red", "right", "images")
    doubted = [event.text for event in events if event.kind == "doubted"]
    assert "a mug, but it is white: continuing the search for red mug" in doubted
    (found,) = [event.text for event in events if event.kind == "found"]
    assert found.endswith("red: checked")


@pytest.mark.slow
def test_a_mug_of_another_colour_is_looked_at_once(searcher, room):
    robot = _among(searcher, room, ["white"])
    kinds = [event.kind for event in _search(robot, "red mug")]
    assert kinds.count("doubted") == 1
    assert "reconsidered" not in kinds
    assert robot.last.state is MissionState.EXHAUSTED


@pytest.mark.slow
def test_what_cannot_be_judged_is_found_and_said_to_be_unchecked(robot):
    events = _search(robot, "Anna's mug")
    assert robot.last.state is MissionState.FOUND
    assert [one.verdict for one in robot.last.find.attributes] == ["unchecked"]
    (found,) = [event.text for event in events if event.kind == "found"]
    assert found.endswith("“Anna” not checked")
