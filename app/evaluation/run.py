"""Runs an evaluation: many episodes in several processes, one row each; resumable."""

import traceback
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from app.evaluation.config import EvaluationConfig
from app.evaluation.errors import EvaluationError
from app.evaluation.observer import EvaluationObserver
from app.evaluation.results_folder import EvaluationFolder
from app.evaluation.setup import (
    catalogue_of,
    check_request,
    expand_methods,
    settings_of,
    trial_of,
)
from app.evaluation.version import code_of, program_of, version_text
from app.evaluation.workers.process_workers import ProcessWorkers, Workers
from app.evaluation.workers.ray_workers import RayWorkers
from app.evaluation.workers.worker import Job, WorkerSetup, list_home, run_job
from app.homes import expand_homes
from ippon.evaluation.episode_generation import (
    EpisodeSpec,
    ExcludedEpisode,
    draw_episodes,
    home_name,
)
from ippon.evaluation.methods.method_table import method_named
from ippon.evaluation.methods.rule_share import MOSTLY, rule_note, unruled_shares
from ippon.evaluation.row import EpisodeRow
from ippon.evaluation.trial import TrialConfig, config_hash


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluationResult:
    """The outcome of a run."""

    rows: int
    """Rows in the folder, including earlier runs."""
    failed: int
    """Homes and episodes that failed with an error."""


def run_evaluation(
    config: EvaluationConfig,
    observer: EvaluationObserver,
    mission_changes: Mapping[str, Any] | None = None,
) -> EvaluationResult:
    """Run every episode without a row in the folder.

    Args:
        config: The evaluation.
        observer: Receives the progress.
        mission_changes: Fields of `MissionConfig` that differ from their defaults.

    Raises:
        UsageError: The evaluation cannot be run; the text says what would work.
    """
    homes = expand_homes(config.homes)
    methods = expand_methods(config.methods)
    try:
        trial = trial_of(config, mission_changes=mission_changes)
        catalogue = catalogue_of(config)
    except ValueError as error:
        raise EvaluationError(str(error)) from error
    check_request(config, methods)
    version = version_text(methods)
    folder = EvaluationFolder(config.out)
    folder.check_homes(homes)
    _check_code(folder, methods)
    _tell_other_program(folder, version, observer)
    folder.open_for(settings_of(config, trial, methods, version, mission_changes))
    workers = _workers(config, WorkerSetup(trial=trial, catalogue=catalogue, version=version))
    try:
        episodes, failed_homes = _list(workers, homes, folder, observer)
        episodes = draw_episodes(episodes, config.limit)
        jobs = _jobs(folder, episodes, methods, trial)
        failed = failed_homes + _run(workers, folder, jobs, observer)
    finally:
        workers.close()
    if not folder.has_rows():
        return EvaluationResult(rows=0, failed=failed)
    _tell_unruled(folder, methods, observer)
    return EvaluationResult(rows=folder.merge(), failed=failed)


def _tell_unruled(
    folder: EvaluationFolder, methods: Sequence[str], observer: EvaluationObserver
) -> None:
    """Say for each method of the run how often its rule gave no target, as the report does."""
    shares = unruled_shares(row for row in folder.rows() if row.method in methods)
    for method, share in shares.items():
        if share > 0.0:
            observer.tell(rule_note(method, share), error=share > MOSTLY)


def _check_code(folder: EvaluationFolder, methods: Sequence[str]) -> None:
    """Refuse to mix rows of an installed method before and after its code was changed.

    Raises:
        EvaluationError: The folder has rows that other code has made.
    """
    now = {name: code for name in methods if (code := code_of(name)) is not None}
    if not now or not folder.has_rows():
        return
    for row in folder.rows():
        if row.method in now and now[row.method] not in row.version.split(", "):
            raise EvaluationError(
                f"the code of {row.method} has changed since the rows in {folder.path} were made; "
                "take another --out, or give the changed method another name"
            )


def _tell_other_program(
    folder: EvaluationFolder, version: str, observer: EvaluationObserver
) -> None:
    """Say that the folder keeps rows that another version of the program has made."""
    if not folder.has_rows():
        return
    now = program_of(version)
    others = [made for row in folder.rows() if (made := program_of(row.version)) != now]
    if others:
        observer.tell(
            f"{len(others)} rows in {folder.path} were made by another version of the program and "
            f"are kept ({others[0]}; this is {now}); take another --out for rows of one version"
        )


def _workers(config: EvaluationConfig, setup: WorkerSetup) -> Workers:
    if config.ray is None:
        return ProcessWorkers(config.workers or 1, setup)
    return RayWorkers(next(iter(config.ray), None), config.workers, setup)


def _list(
    workers: Workers, homes: Sequence[str], folder: EvaluationFolder, observer: EvaluationObserver
) -> tuple[list[EpisodeSpec], int]:
    """List the episodes of every home; return them and the number of failed homes."""
    found: dict[str, tuple[EpisodeSpec, ...]] = {}
    dropped: list[ExcludedEpisode] = []
    failed: dict[str, BaseException] = {}
    observer.begin("listing episodes", len(homes))
    for home, listed in workers.each(list_home, homes):
        name = f"home {home_name(home)}"
        if isinstance(listed, BaseException):
            failed[home] = listed
            folder.write_error(name, trace_of(listed))
        else:
            folder.forget_error(name)
            found[home] = listed[0]
            dropped += listed[1]
        observer.advance()
    for home, error in failed.items():
        observer.tell(f"{home}: {error}", error=True)
    left_out = [d for d in dropped if d.start_index is not None]
    if left_out:
        observer.tell(
            f"{len(left_out)} start poses left out: too close to a viewpoint of the object, no "
            "path to one, or on another floor"
        )
    episodes = [spec for home in homes for spec in found.get(home, ())]
    if not episodes:
        raise EvaluationError(_why_no_episodes(dropped, failed))
    return episodes, len(failed)


def _why_no_episodes(
    dropped: Sequence[ExcludedEpisode], failed: Mapping[str, BaseException]
) -> str:
    if failed:
        home, error = next(iter(failed.items()))
        return f"no home could be searched; the first, {home}: {error}"
    absent = sorted({d.goal for d in dropped if d.reason == "absent"})
    alike = sorted({d.goal for d in dropped if d.reason == "one colour"})
    why = f"; absent: {', '.join(absent)}" if absent else ""
    why += f"; of one colour: {', '.join(alike)}" if alike else ""
    return f"these homes have none of these objects within reach{why}"


def _jobs(
    folder: EvaluationFolder,
    episodes: Iterable[EpisodeSpec],
    methods: Sequence[str],
    trial: TrialConfig,
) -> tuple[Job, ...]:
    hashes = {name: config_hash(trial, method_named(name)) for name in methods}
    return tuple(
        Job(spec=spec, method=name)
        for spec in episodes
        for name in methods
        if not all(
            # Later searches of an episode are without a context.
            folder.has(row_id, name, hashes[name], "" if k else spec.context)
            for k, row_id in enumerate(spec.row_ids)
        )
    )


def _run(
    workers: Workers,
    folder: EvaluationFolder,
    jobs: Sequence[Job],
    observer: EvaluationObserver,
) -> int:
    """Run the jobs and write their rows; return the number of failed jobs."""
    failed = 0
    observer.begin("searching", len(jobs))
    for job, outcome in workers.each(run_job, jobs):
        name = f"{job.spec.episode_id}.{job.method}"
        if isinstance(outcome, BaseException):
            failed += 1
            folder.write_error(name, trace_of(outcome))
            observer.advance(f"{name}: {type(outcome).__name__}: {outcome}")
            continue
        for row in outcome:
            folder.write(row)
        observer.advance("; ".join(_one_line(row) for row in outcome))
    if failed:
        where = folder.path / "errors"
        observer.tell(f"{failed} episodes could not be run; see {where}", error=True)
    return failed


def trace_of(error: BaseException) -> str:
    """Return an error as Python prints it."""
    return "".join(traceback.format_exception(error))


def _one_line(row: EpisodeRow) -> str:
    how = "found" if row.success else row.failure
    return f"{row.episode_id} {row.method}: {how}, SPL {row.spl:.2f}, {row.time_s:.0f} s"
