"""When a search of the demo is over."""

import dataclasses
import json
import queue
from types import SimpleNamespace
from typing import Any

import pytest

from app.demo import result
from app.demo.result import RESULT_FILE, await_outcome, end_recording, judge_of
from app.errors import DemoError
from app.messages.control import encode
from app.messages.status import GoalStatus, Status, Timings
from ippon.robot import ZED
from ippon.simulation.homes.config import MUG_COLORS
from tests.boxes import boxes_scene


def report(goal=None, history=()):
    """The navigator's report with an active goal and some that are over."""
    return encode(
        Status(
            robot="r", version="1", stamp_ns=0, wall_ns=0, state="starting", why="", goal=goal,
            queue=[], history=list(history), find=None, streams=[], timings=Timings(), frames=3,
            elapsed_s=2.0, path_length_m=0.0, best_ooi=0.0, explored_m2=0.0, surface_voxels=0,
            voxel_size_m=0.1, map_revision=0,
        )
    )  # fmt: skip


def part(name: str, status: int | None = None) -> Any:
    return SimpleNamespace(name=name, ended=lambda: status)


def goal(outcome: Any, goal_id: int = 7):
    return GoalStatus(goal_id=goal_id, object="hat", outcome=outcome)


def heard(*reports):
    updates = queue.SimpleQueue()
    for content in reports:
        updates.put(content)
    return updates


@pytest.mark.parametrize(
    "last",
    [report(goal("found")), report(goal("exhausted")), report(None, [goal("cancelled")])],
    ids=["found", "exhausted", "cancelled"],
)
def test_the_search_is_over(last):
    others = report(goal("found", 6), [goal("cancelled", 5)])
    updates = heard(others, report(goal("queued")), report(goal("active")), last)
    status, ended = await_outcome([part("navigator"), part("robot")], updates, 7)
    assert ended.goal_id == 7
    assert encode(status) == last


def test_the_result_does_not_need_the_page():
    parts = [part("navigator"), part("console", -9), part("robot")]
    assert await_outcome(parts, heard(report(goal("found"))), 7)[1].outcome == "found"


@pytest.mark.parametrize("name", ["navigator", "robot"])
def test_the_result_needs_navigator_and_robot(name):
    parts = [part("navigator"), part("console"), part("robot")]
    parts = [part(name, -9) if p.name == name else p for p in parts]
    with pytest.raises(DemoError, match=f"the {name} ended with status -9"):
        await_outcome(parts, heard(), 7)


class Late:
    """Reports that come after a silence, by a clock that goes ten seconds with each question."""

    def __init__(self, silent_s: float, last: bytes) -> None:
        self.silent_s, self.now_s, self.last = silent_s, 0.0, last

    def monotonic(self) -> float:
        return self.now_s

    def get(self, timeout: float) -> bytes:
        self.now_s += 10.0
        if self.now_s <= self.silent_s:
            raise queue.Empty
        return self.last


@pytest.mark.parametrize("silent_s", [60.0, 180.0])
def test_a_navigator_that_runs_may_be_silent_for_a_minute_on_a_busy_machine(monkeypatch, silent_s):
    late: Any = Late(silent_s, report(goal("found")))
    monkeypatch.setattr(result, "time", late)
    parts = [part("navigator"), part("robot")]
    if silent_s < 120.0:
        assert await_outcome(parts, late, 7)[1].outcome == "found"
        return
    with pytest.raises(DemoError, match="the navigator has been silent for 120 s"):
        await_outcome(parts, late, 7)


def test_a_result_that_cannot_be_stored_is_still_printed(tmp_path, caplog):
    recorder = SimpleNamespace(stop=lambda: None)
    assert end_recording(recorder, str(tmp_path), {"found": True}) == str(tmp_path)
    assert json.loads((tmp_path / RESULT_FILE).read_text("utf-8")) == {"found": True}
    (tmp_path / RESULT_FILE).unlink()
    (tmp_path / RESULT_FILE).mkdir()
    assert end_recording(recorder, str(tmp_path), {"found": True}) == str(tmp_path)
    assert "the result is not stored in" in caplog.text


@pytest.mark.parametrize(
    ("display", "counted"),
    [
        ("red mug", {"red"}),
        ("my big red mug", {"red"}),
        ("mug", {"red", "white"}),
        ("broken mug", {"red", "white"}),
        ("green mug", set()),
    ],
)
def test_only_a_mug_of_the_colour_that_was_said_counts(display, counted):
    floor = ("floor", "floor", (-0.1, -0.1, -0.1), (8.1, 6.1, 0.0))
    mugs = [("objects", "mug", (x, 3.0, 0.0), (x + 0.2, 3.2, 0.4)) for x in (2.0, 6.0)]
    scene = boxes_scene([floor, *mugs], ((1.0, 1.0),))
    colors = scene.face_colors.copy()
    colors[scene.face_instance == 1] = MUG_COLORS["red"]
    colors[scene.face_instance == 2] = MUG_COLORS["white"]
    scene = dataclasses.replace(scene, face_colors=colors)
    wanted = GoalStatus(goal_id=1, object="mug", display=display, outcome="found")
    judge = judge_of(wanted, ZED, scene)
    assert {("red", "white")[row - 1] for row in judge.instances} == counted
    assert judge.is_success((2.1, 2.2)) is ("red" in counted)
    assert judge.is_success((6.1, 2.2)) is ("white" in counted)
