"""Outcome and measures of a demo's search."""

import json
import logging
import queue
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import zenoh

from app.demo.processes import OPTIONAL
from app.errors import DemoError
from app.links.network.requests import last_message
from app.messages import keys
from app.messages.control import decode
from app.messages.status import GoalStatus, Status, goal_of, name_of
from app.nodes.robot_sim import GroundTruth
from app.process.children import Child, wait_for_end
from ippon.atomic_file import replace_file
from ippon.evaluation.metrics import Judge
from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.language.requests.sentence import goal_named
from ippon.mission.finds.attributes.colour_regions import region_of
from ippon.robot import RobotProfile
from ippon.simulation.scene import Scene

logger = logging.getLogger(__name__)

SILENT_S: Final = 120.0
"""Time without a status after which the navigator hangs; that it has ended is noticed at once. On
an overloaded machine a step, or a kernel that is compiled, takes long."""
RESULT_FILE: Final = "result.json"
"""File beside a recording with the measures of the search."""


def await_outcome(
    children: Sequence[Child], updates: "queue.SimpleQueue[bytes]", goal_id: int
) -> tuple[Status, GoalStatus]:
    """Wait for the end of a search.

    Raises:
        DemoError: Navigator or robot ended, or the navigator is silent.
    """
    needed = [child for child in children if child.name not in OPTIONAL]
    heard = time.monotonic()
    while True:
        ended = wait_for_end(needed, 0.0)
        if ended is not None:
            raise DemoError(
                f"the {ended.name} ended with status {ended.ended()}; see its log above"
            )
        try:
            status = decode(updates.get(timeout=0.2), Status)
        except queue.Empty:
            if time.monotonic() - heard > SILENT_S:
                raise DemoError(f"the navigator has been silent for {SILENT_S:g} s") from None
            continue
        heard = time.monotonic()
        goal = goal_of(status, goal_id)
        if goal is not None and goal.outcome not in {"queued", "active"}:
            return status, goal


def end_recording(
    recorder: Child | None, session: str | None, result: dict[str, Any]
) -> str | None:
    """End the recording and store the result beside it; return its folder, None without one."""
    if recorder is None or session is None:
        return None
    recorder.stop()
    folder = Path(session)
    if not folder.is_dir():
        return None
    try:
        replace_file(folder / RESULT_FILE, json.dumps(result).encode())
    except OSError as error:
        # The command still prints the result.
        logger.error("the result is not stored in %s: %s", folder, error.strerror)  # noqa: TRY400
    return session


def measured_result(
    session: zenoh.Session,
    robot: str,
    profile: RobotProfile,
    status: Status,
    goal: GoalStatus,
    scene: Scene,
) -> dict[str, Any]:
    """Return the measures of a search from the trajectory of the simulated robot.

    Raises:
        DemoError: The robot does not answer.
    """
    payload = last_message(session, f"{robot}/{keys.SIM_TRUTH}", 5.0)
    if payload is None:
        raise DemoError("the simulated robot does not report its trajectory")
    truth = msgspec.json.decode(payload, type=GroundTruth)
    found = goal.outcome == "found"
    judge = judge_of(goal, profile, scene)
    metrics = judge.metrics(np.array(truth.trajectory, np.float64), stopped=found)
    return {
        "found": found,
        "correct": metrics.success,
        "time_s": round(status.elapsed_s, 3),
        "path_length_m": round(metrics.path_length_m, 4),
        "spl": round(metrics.spl, 4),
        "soft_spl": round(metrics.soft_spl, 4),
        "frames": status.frames,
        "out_of_reach_m": None if status.find is None else status.find.out_of_reach_m,
        "session": None,
    }


def judge_of(goal: GoalStatus, profile: RobotProfile, scene: Scene) -> Judge:
    """Return what tells whether a search ended at its object: of "red mug" at a red one.

    Other attributes, and colours that were denied, are not judged.
    """
    named = goal_named(name_of(goal))
    colours = [one.value for one in named.attributes if _is_colour(one)] if named else []
    return Judge(scene, profile, goal.object, colour=next(iter(colours), ""))


def _is_colour(attribute: Attribute) -> bool:
    wanted = attribute.kind == "colour" and not attribute.negated
    return wanted and region_of(attribute.value) is not None
