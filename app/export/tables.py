"""Trajectory and finds as text files for other programs."""

import csv
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from app.export.session_data import SessionData, Trajectory
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.scene import FoundObject, decode_found_objects
from app.recording.session_goals import goals_of


def write_tum(session: SessionData, path: Path) -> None:
    """Write `time x y z qx qy qz qw`, the format of the TUM RGB-D benchmark.

    Raises:
        RecordingError: There is no pose.
    """
    trajectory = session.trajectory
    lines = ["# time tx ty tz qx qy qz qw\n"]
    for t, row in zip(trajectory.time_ns.tolist(), _rows(trajectory).tolist(), strict=True):
        lines.append(f"{t / 1e9:.6f} " + " ".join(f"{value:.6f}" for value in row) + "\n")
    path.write_text("".join(lines), "ascii")


def write_csv(session: SessionData, path: Path) -> None:
    """Write the trajectory as CSV with a header and the path length driven so far.

    Raises:
        RecordingError: There is no pose.
    """
    trajectory = session.trajectory
    rows = _rows(trajectory)
    driven = trajectory.driven_m()
    with path.open("w", newline="", encoding="ascii") as file:
        table = csv.writer(file)
        table.writerow(["time_s", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw", "driven_m"])
        for t, row, way in zip(
            trajectory.time_ns.tolist(), rows.tolist(), driven.tolist(), strict=True
        ):
            numbers = (f"{value:.6f}" for value in (t / 1e9, *row))
            table.writerow([*numbers, f"{way:.4f}"])


def write_finds(session: SessionData, path: Path) -> None:
    """Write the goals of the session with their finds, and the candidates, as JSON."""
    last = session.timeline.last
    detections: list[dict[str, object]] = []
    for message in session.recording.all_messages((keys.DETECTIONS,)):
        try:
            stamp_ns, found = decode_found_objects(message.payload)
        except MessageError:
            # Undecodable messages are skipped.
            continue
        detections += [{"stamp_s": stamp_ns / 1e9, **_entry(d)} for d in found]
    content = {
        "session": session.name,
        "goals": goals_of(session.timeline),
        "find": last.find if last is not None else None,
        "detections": detections,
    }
    path.write_bytes(msgspec.json.format(msgspec.json.encode(content)))


def _entry(detection: FoundObject) -> dict[str, object]:
    return {
        "label": detection.label,
        "probability": round(detection.probability, 4),
        "center_world_m": [round(x, 3) for x in detection.center_world],
        "size_m": [round(x, 3) for x in detection.size_m],
    }


def _rows(trajectory: Trajectory) -> NDArray[np.float64]:
    """Return (N, 7) x, y, z, qx, qy, qz, qw."""
    T = trajectory.T_world_base
    return np.concatenate([T[:, :3, 3], Rotation.from_matrix(T[:, :3, :3]).as_quat()], axis=1)
