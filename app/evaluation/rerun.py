"""Rerun and recording of one episode of an evaluation."""

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from app.evaluation.config import EvaluationConfig
from app.evaluation.episode_recorder import EpisodeRecorder
from app.evaluation.errors import EvaluationError
from app.evaluation.results_folder import SESSIONS, EvaluationFolder
from app.evaluation.setup import trial_of
from app.evaluation.version import version_text
from app.homes import load_home
from app.robot_file import read_profile
from ippon.evaluation.episode_generation import EpisodeSpec
from ippon.evaluation.episode_record import Clocks
from ippon.evaluation.methods.method_table import method_named
from ippon.evaluation.row import ATTAINABLE_COLUMNS, TIMING_COLUMNS, EpisodeRow
from ippon.evaluation.trial import Trial, TrialConfig, config_hash
from ippon.guidance.prior import EmbeddedPrior
from ippon.robot import RobotProfile
from ippon.simulation.scene import Scene, StartPose


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """Result of a rerun."""

    session: Path
    """Folder of the recording."""
    differences: tuple[str, ...]
    """Columns of its row that differ, except times and versions."""
    row_version: str
    """Version of the original row."""
    version: str
    """Version of the rerun."""


def rerun_episode(
    path: Path, episode: str, method_name: str, tell: Callable[[str], None]
) -> Replay:
    """Run an episode again and record it.

    Args:
        path: Folder of the evaluation.
        episode: Name of the episode.
        method_name: Method of the row.
        tell: Called with each note for the user.

    Raises:
        UsageError: There is no such row, or it cannot be rerun; the text says what would work.
    """
    folder = EvaluationFolder(path)
    row = _row(folder.rows(), episode, method_name)
    trial = trial_of_row(folder.settings(), row)
    try:
        method = method_named(row.method)
    except ValueError as error:
        raise EvaluationError(f"the method of {row.episode_id}: {error}") from error
    present = config_hash(trial, method)
    if present != row.config_hash:
        tell(f"the row was made with configuration {row.config_hash}, this is {present}")
    scene = load_home(row.home, coloured_mugs=_has_attributes(folder.settings()))
    spec = _spec(row, scene)
    prior, version = EmbeddedPrior(), version_text([row.method])
    clocks = Clocks(wall=time.perf_counter, cpu=time.process_time)
    guidance = Trial(trial, scene, version, clocks, prior).guidance(spec, method)
    root = path / SESSIONS / f"{row.episode_id}.{row.method}"
    try:
        recorder = EpisodeRecorder(root, time.time_ns(), version, guidance)
        tell(f"searching for up to {trial.limits.max_time_s:.0f} simulated s")
        try:
            again = Trial(trial, scene, version, clocks, prior, recorder.observe).run(spec, method)
        finally:
            session = recorder.close()
    except OSError as error:
        raise EvaluationError(f"cannot write to {root}: {error.strerror}") from error
    return Replay(
        session=session,
        differences=differences(row, again),
        row_version=row.version,
        version=version,
    )


def differences(before: EpisodeRow, now: EpisodeRow) -> tuple[str, ...]:
    """Return the columns in which two rows of one episode differ, except times and names."""
    left_out = {*TIMING_COLUMNS, *ATTAINABLE_COLUMNS, "version", "episode_id", "kind", "after"}
    names = (f.name for f in dataclasses.fields(EpisodeRow) if f.name not in left_out)
    return tuple(name for name in names if getattr(before, name) != getattr(now, name))


def trial_of_row(settings: dict[str, Any], row: EpisodeRow) -> TrialConfig:
    """Return the setup of a row.

    Args:
        settings: Settings of the evaluation's folder.
        row: Row of the folder.

    Raises:
        EvaluationError: The setup is of another version.
    """
    fixed = settings.get("fixed", {})
    config = EvaluationConfig(
        out=Path(),
        image_width=row.image_width,
        voxel_size_m=float(fixed.get("voxel_size_m", 0.1)),
        max_time_s=fixed.get("max_time_s"),
        segmentation_errors=fixed.get("segmentation_errors", "paper"),
        attributes=_has_attributes(settings),
        attribute_error_rate=float(fixed.get("attribute_error_rate", 0.0)),
    )
    try:
        return trial_of(config, _profile(settings, row), fixed.get("mission"))
    except ValueError as error:
        raise EvaluationError(f"the setup of {row.episode_id}: {error}") from error


def _has_attributes(settings: dict[str, Any]) -> bool:
    """Return whether the run was one with --attributes."""
    return "attribute_error_rate" in settings.get("fixed", {})


def _row(rows: tuple[EpisodeRow, ...], episode: str, method: str) -> EpisodeRow:
    found = [row for row in rows if row.episode_id == episode]
    mine = next((row for row in found if row.method == method), None)
    if mine is None:
        known = [r.method for r in found] or sorted({r.episode_id for r in rows})[:5]
        what = f"{episode!r} by {method}" if found else repr(episode)
        raise EvaluationError(f"no episode {what}; there is {', '.join(known)}")
    if mine.kind == "second":
        raise EvaluationError(
            f"{episode} starts with the map of the search before it; replay that one, "
            f"{episode.removesuffix(f'.{mine.goal}.second')}, or {episode[: -len('second')]}fresh"
        )
    return mine


def _profile(settings: dict[str, Any], row: EpisodeRow) -> RobotProfile:
    """Return the recorded profile, which may differ from its present file."""
    kept = settings.get("configurations", {}).get(row.method, {}).get("trial", {}).get("robot")
    try:
        return read_profile(row.robot) if kept is None else msgspec.convert(kept, RobotProfile)
    except (ValueError, msgspec.DecodeError) as error:
        raise EvaluationError(f"the robot of {row.episode_id} cannot be read: {error}") from error


def _spec(row: EpisodeRow, scene: Scene) -> EpisodeSpec:
    z = scene.start_poses[row.start_index].z
    start = StartPose(x=row.start_x_m, y=row.start_y_m, z=z, yaw=row.start_yaw_rad)
    return EpisodeSpec(
        home=row.home,
        start_index=row.start_index,
        start=start,
        goal=row.goal,
        context=row.context,
        colour=row.colour,
        seed=row.seed,
        shortest_path_m=row.shortest_path_m,
    )
