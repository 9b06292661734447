"""How a search of the demo ended, and how good it was."""

import json
import queue
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import msgspec
import numpy as np
import zenoh

from app.cli.tools.ask import known_goal
from app.errors import DemoError
from app.links.network.requests import last_message
from app.messages import keys
from app.messages.control import decode
from app.messages.status import GoalStatus, Status
from app.process.children import Child, wait_for_end

if TYPE_CHECKING:
    from ippon.robot import RobotProfile
    from ippon.simulation.scene import Scene

SILENT_S: Final = 20.0
RESULT_FILE: Final = "result.json"
"""Beside a recording: how good the search was, where the truth is known."""


def await_outcome(
    children: Sequence[Child], updates: "queue.SimpleQueue[bytes]", goal_id: int
) -> tuple[Status, GoalStatus]:
    """Wait for the end of a search, also by another's order.

    Raises:
        DemoError: Navigator or robot ended, or the navigator fell silent.
    """
    needed = [child for child in children if child.name not in {"console", "recorder"}]
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
        goal = known_goal(status, goal_id)
        if goal is not None and goal.outcome not in {"queued", "active"}:
            return status, goal


def end_recording(
    recorder: Child | None, session: str | None, result: dict[str, Any]
) -> str | None:
    """End the recording, put the result beside it, and return its folder, None without one."""
    if recorder is None or session is None:
        return None
    recorder.stop()
    folder = Path(session)
    if not folder.is_dir():
        return None
    (folder / RESULT_FILE).write_text(json.dumps(result), "utf-8")
    return session


def measured_result(
    session: zenoh.Session,
    robot: str,
    profile: "RobotProfile",
    status: Status,
    goal: GoalStatus,
    scene: "Scene",
) -> dict[str, Any]:
    """Judge a search by the way that the simulated robot went.

    Raises:
        DemoError: The robot does not say it.
    """
    from app.nodes.robot_sim import GroundTruth
    from ippon.evaluation.metrics import Judge

    payload = last_message(session, f"{robot}/{keys.SIM_TRUTH}", 5.0)
    if payload is None:
        raise DemoError("the simulated robot does not say where it went")
    truth = msgspec.json.decode(payload, type=GroundTruth)
    found = goal.outcome == "found"
    judge = Judge(scene, profile, goal.object)
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
