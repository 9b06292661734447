"""A segmentation in a process of its own that dies, and one that sticks."""

import os
import signal
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("onnxruntime", reason="the extra ippon[detector] is not installed")
pytest.importorskip("onnx", reason="the development packages are not installed")

from tests.app.nodes.navigator.scenarios.standing_robot import CAMERA, seen_on_the_wall
from tests.onnx_graphs import constant_network

pytestmark = pytest.mark.process

SIDE = 64


@pytest.fixture
def network(tmp_path):
    """Options of a detector that sees a hat on the wall in every image."""
    labels = tmp_path / "labels.txt"
    labels.write_text("hat\n")
    scale = SIDE / CAMERA.width
    (hat,) = seen_on_the_wall().instances
    row = [*(scale * x for x in hat.box_px), hat.score, 0.0]
    path = constant_network(tmp_path / "hat.onnx", {"output0": np.array([[row]], np.float32)})

    return (
        "--segmentation.backend", "detector", "--segmentation.model", str(path),
        "--segmentation.labels-file", str(labels), "--segmentation.threads", "1",
    )  # fmt: skip


@pytest.fixture
def segmentation(launch, free_endpoint, network):
    """Start `ippon segment`."""
    return lambda: launch("segment", "--connect", free_endpoint, "--robot", "r", *network)


def is_told(status):
    return any("objects are not recognised" in note for note in status.notes)


def is_told_and_searches(status):
    # Without an image for a second, as from a sender that is late, it is lost for a moment.
    return is_told(status) and status.state != "lost"


def is_heard(status):
    return not is_told(status)


def test_one_that_is_killed_is_reported_and_its_successor_is_heard(robot, segmentation):
    robot.send_until(is_told, heatmap=False)
    process = segmentation()
    robot.send_until(is_heard, 120.0, heatmap=False)
    os.kill(process.child.pid, signal.SIGKILL)
    status = robot.send_until(is_told_and_searches, heatmap=False)
    assert (status.state == "lost", status.goal.outcome) == (False, "active")
    robot.send_until(lambda s: s.frames > status.frames + 5, heatmap=False)
    segmentation()
    robot.send_until(is_heard, 120.0, heatmap=False)


def test_one_that_sticks_is_reported_and_heard_again_when_it_goes_on(robot, segmentation):
    robot.send_until(is_told, heatmap=False)
    process = segmentation()
    robot.send_until(is_heard, 120.0, heatmap=False)
    os.kill(process.child.pid, signal.SIGSTOP)
    status = robot.send_until(is_told_and_searches, heatmap=False)
    assert (status.state == "lost", status.goal.outcome) == (False, "active")
    robot.send_until(lambda s: s.frames > status.frames + 5, heatmap=False)
    os.kill(process.child.pid, signal.SIGCONT)
    robot.send_until(is_heard, heatmap=False)


def _command_line(pid):
    """Return it; nothing of a process that has ended, as one that compiles kernels may."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except (FileNotFoundError, ProcessLookupError):
        return b""


def test_the_navigator_says_that_the_one_beside_it_was_killed_and_goes_on(
    launch, free_endpoint, network
):
    navigator = launch(
        "navigate", "--listen", free_endpoint, "--robot", "r", "--segmentation.where", "here",
        *network,
    )  # fmt: skip
    navigator.wait_for_log("segmenting the images of r", 240.0)
    pid = navigator.child.pid
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    (child,) = (c for c in children if b"\0segment\0" in _command_line(c))
    os.kill(int(child), signal.SIGKILL)
    navigator.wait_for_log(
        "the segmentation was ended by signal 9: objects are no longer recognised"
    )
    navigator.child.terminate()
    status, _ = navigator.finish()
    assert status == 0
