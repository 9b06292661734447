"""Processes of ROS 2's Python, apart from the ROS 2 of others on this machine."""

import contextlib
import fcntl
import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

from tests.locations import ROOT, ROS2_PYTHON

TYPES = ROOT / ".pytest_cache" / "d" / "nav2_msgs"
"""Where the package nav2_msgs is built for the tests."""
ENDS_WITHIN_S = 8.0
"""The middleware hangs at times as it ends, and the nodes leave it behind after 5 s."""
HAS_COMPILER = shutil.which("g++") is not None and shutil.which("gcc") is not None


def build_action_types():
    """Build nav2_msgs with the action NavigateToPose, which PyPI does not have, once."""
    script = Path(__file__).with_name("action_types.py")
    TYPES.mkdir(parents=True, exist_ok=True)
    with (TYPES / "lock").open("w") as lock:
        # Another worker may be building it.
        fcntl.flock(lock, fcntl.LOCK_EX)
        subprocess.run([str(ROS2_PYTHON), str(script), str(TYPES)], check=True, capture_output=True)


def ros2_environment(domain):
    return {
        **os.environ,
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "PYTHONPATH": f"{ROOT / 'app/ros2'}{os.pathsep}{TYPES}",
    }


class Ros2Process:
    def __init__(self, arguments, domain, log):
        self.log_file = log
        with log.open("wb") as stream:
            self.child = subprocess.Popen(
                [str(ROS2_PYTHON), *arguments],
                env=ros2_environment(domain),
                stdout=stream,
                stderr=subprocess.STDOUT,
            )

    def log(self):
        return self.log_file.read_text(errors="replace")

    def wait_for_log(self, text, timeout_s=60.0):
        deadline = time.monotonic() + timeout_s
        while text not in self.log():
            assert self.child.poll() is None, self.log()
            assert time.monotonic() < deadline, f"no {text!r} in:\n{self.log()}"
            time.sleep(0.02)

    def stop(self):
        """End it as an operator does: a killed node leaves its shared memory in /dev/shm."""
        self.child.send_signal(signal.SIGINT)
        try:
            self.child.wait(ENDS_WITHIN_S)
        except subprocess.TimeoutExpired:
            self.kill()

    def kill(self):
        with contextlib.suppress(ProcessLookupError):
            self.child.kill()
        self.child.wait()
