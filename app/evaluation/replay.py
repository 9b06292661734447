"""`ippon eval replay`: one episode again, as a recording for `ippon review`."""

import dataclasses
import sys
import time
from pathlib import Path
from typing import Any

import msgspec

from app.cli.options.evaluation import EvalReplay, EvalRun
from app.errors import UsageError
from app.evaluation.episode_recorder import EpisodeRecorder
from app.evaluation.results_folder import SESSIONS, EvaluationFolder
from app.evaluation.run import trial_of
from app.evaluation.version import version_text
from app.homes import load_home
from app.robot_file import read_profile
from ippon.evaluation.catalogue import EpisodeSpec
from ippon.evaluation.methods.method_table import method_named
from ippon.evaluation.row import TIMING_COLUMNS, EpisodeRow
from ippon.evaluation.search import Clocks
from ippon.evaluation.trial import Trial, TrialConfig, config_hash
from ippon.guidance.prior import EmbeddedPrior
from ippon.robot import RobotProfile
from ippon.simulation.scene import Scene, StartPose


def run_replay(command: EvalReplay) -> int:
    """Run the episode, say whether it went as before, and print the recording's folder."""
    folder = EvaluationFolder(command.folder)
    row = _row(folder.rows(), command.episode, command.method)
    trial = _trial(folder.settings(), row)
    scene = load_home(row.home)
    spec = _spec(row, scene)
    prior, method, version = EmbeddedPrior(), method_named(row.method), version_text()
    clocks = Clocks(wall=time.perf_counter, cpu=time.process_time)
    guidance = Trial(trial, scene, version, clocks, prior).guidance(spec, method)
    root = command.folder / SESSIONS / f"{row.episode_id}.{row.method}"
    try:
        recorder = EpisodeRecorder(root, time.time_ns(), version, guidance)
        print(f"searching for up to {trial.limits.max_time_s:.0f} simulated s", file=sys.stderr)
        again = Trial(trial, scene, version, clocks, prior, recorder.witness).run(spec, method)
        session = recorder.close()
    except OSError as error:
        raise UsageError(f"cannot write to {root}: {error.strerror}") from error
    odd = differences(row, again)
    if odd:
        print(
            f"ippon: not the search of the row: {', '.join(odd)} differ; the row was made by "
            f"{row.version}, this is {version}",
            file=sys.stderr,
        )
    print(session)
    return 0


def differences(before: EpisodeRow, now: EpisodeRow) -> tuple[str, ...]:
    """Return the columns in which two rows of one episode differ, but for times and names."""
    left_out = {*TIMING_COLUMNS, "version", "episode_id", "kind", "after"}
    names = (f.name for f in dataclasses.fields(EpisodeRow) if f.name not in left_out)
    return tuple(name for name in names if getattr(before, name) != getattr(now, name))


def _row(rows: tuple[EpisodeRow, ...], episode: str, method: str) -> EpisodeRow:
    found = [row for row in rows if row.episode_id == episode]
    mine = next((row for row in found if row.method == method), None)
    if mine is None:
        known = [r.method for r in found] or sorted({r.episode_id for r in rows})[:5]
        what = f"{episode!r} by {method}" if found else repr(episode)
        raise UsageError(f"no episode {what}; there is {', '.join(known)}")
    if mine.kind == "second":
        raise UsageError(
            f"{episode} begins on the map of the search before it; replay that one, "
            f"{episode.removesuffix(f'.{mine.goal}.second')}, or {episode[: -len('second')]}fresh"
        )
    return mine


def _trial(settings: dict[str, Any], row: EpisodeRow) -> TrialConfig:
    """Return the set-up of a row, checked against its hash."""
    fixed = settings.get("fixed", {})
    command = EvalRun(
        out=Path(),
        image_width=row.image_width,
        voxel_size_m=float(fixed.get("voxel_size_m", 0.1)),
        max_time_s=fixed.get("max_time_s"),
    )
    trial = trial_of(command, _profile(settings, row))
    present = config_hash(trial, method_named(row.method))
    if present != row.config_hash:
        print(
            f"ippon: the row was made with configuration {row.config_hash}, this is {present}",
            file=sys.stderr,
        )
    return trial


def _profile(settings: dict[str, Any], row: EpisodeRow) -> RobotProfile:
    """Return the robot as it was, whatever has become of its file."""
    kept = settings.get("configurations", {}).get(row.method, {}).get("trial", {}).get("robot")
    try:
        return read_profile(row.robot) if kept is None else msgspec.convert(kept, RobotProfile)
    except (ValueError, msgspec.DecodeError) as error:
        raise UsageError(f"the robot of {row.episode_id} is not known any more: {error}") from error


def _spec(row: EpisodeRow, scene: Scene) -> EpisodeSpec:
    z = scene.start_poses[row.start_index].z
    start = StartPose(x=row.start_x_m, y=row.start_y_m, z=z, yaw=row.start_yaw_rad)
    return EpisodeSpec(
        home=row.home,
        start_index=row.start_index,
        start=start,
        goal=row.goal,
        context=row.context,
        seed=row.seed,
        shortest_path_m=row.shortest_path_m,
    )
