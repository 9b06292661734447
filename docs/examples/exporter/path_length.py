"""An export for `ippon export SESSION length`: how far the robot went, each minute."""

from pathlib import Path

import numpy as np

from app.export.session_data import SessionData


def write(session: SessionData, path: Path) -> None:
    """Write one line a minute: minute and metres."""
    trajectory = session.trajectory
    seconds = (trajectory.time_ns - trajectory.time_ns[0]) / 1e9
    steps = np.linalg.norm(np.diff(trajectory.T_world_base[:, :2, 3], axis=0), axis=1)
    minutes = (seconds[1:] // 60).astype(int)
    lines = [f"{m} {steps[minutes == m].sum():.2f}\n" for m in range(minutes.max(initial=-1) + 1)]
    path.write_text("".join(lines), "ascii")


EXPORT = ("path-length.txt", write)
