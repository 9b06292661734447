"""`ippon eval run`: many episodes on several processes, one row each, resumable."""

import concurrent.futures
import dataclasses
import multiprocessing
import os
import sys
import traceback
import zlib
from collections.abc import Iterable, Sequence
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from app.cli.errors import UsageError
from app.cli.eval_store import EvaluationFolder
from app.cli.eval_version import version_text
from app.cli.eval_work import Job, WorkerSetup, list_home, run_job, start_worker
from app.cli.homes import MAX_SEED, check_home
from app.cli.options import EvalRun
from ippon.evaluation.catalogue import CatalogueConfig, EpisodeSpec, goals_of
from ippon.evaluation.episode import EpisodeLimits
from ippon.evaluation.methods import ABLATIONS, BASELINES, METHODS, method_named
from ippon.evaluation.row import EpisodeRow
from ippon.evaluation.trial import TrialConfig, config_hash, habitat_trial
from ippon.mapping.map_config import MapConfig
from ippon.mission.mission import MissionConfig
from ippon.robot import ZED

EXIT_FAILED = 1
ZED_IMAGE_WIDTH = 320
MAX_HOMES = 100_000


def run_evaluation(command: EvalRun) -> int:
    """Run every episode that the folder lacks."""
    homes = expand_homes(command.homes)
    methods = expand_methods(command.methods)
    try:
        trial, catalogue = trial_of(command), catalogue_of(command)
    except ValueError as error:
        raise UsageError(str(error)) from error
    if command.workers < 1 or (command.limit is not None and command.limit < 1):
        raise UsageError(
            f"--workers and --limit are at least 1; got {command.workers}, {command.limit}"
        )
    version = version_text()
    folder = EvaluationFolder(command.out)
    folder.open_for(_settings(command, trial, methods, version))
    setup = WorkerSetup(trial=trial, catalogue=catalogue, version=version, parent_pid=os.getpid())
    screen = Console(file=sys.stderr)
    with _pool(command.workers, setup) as pool:
        try:
            episodes = _list(pool, homes, command.limit, screen)
            jobs = _jobs(folder, episodes, methods, trial)
            failed = _run(pool, folder, jobs, screen)
        except BrokenProcessPool as error:
            raise UsageError(
                "a worker process was killed, perhaps for want of memory; start again with fewer "
                "--workers: finished episodes are kept"
            ) from error
        except KeyboardInterrupt:
            _abandon(pool)
            screen.print(f"interrupted; to go on, start again with --out {command.out}")
            raise
    count = folder.merge() if any((command.out / "rows").glob("*.json")) else 0
    screen.print(f"{count} rows in {command.out}; see `ippon eval report {command.out}`")
    return EXIT_FAILED if failed else 0


def expand_homes(homes: Sequence[str]) -> tuple[str, ...]:
    """Write ranges of seeds out, and check every home.

    Raises:
        UsageError: With what would work.
    """
    out: list[str] = []
    for part in (p for text in homes for p in text.split(",") if p):
        first, colon, last = part.partition(":")
        if colon and first.isdigit() and last.isdigit():
            if not int(first) <= int(last) <= MAX_SEED or int(last) - int(first) >= MAX_HOMES:
                raise UsageError(f"homes go from a smaller seed to a larger one; got {part}")
            out += [str(seed) for seed in range(int(first), int(last) + 1)]
        else:
            check_home(part)
            out.append(part)
    if not out:
        raise UsageError("no homes: give seeds like 1001:1010, or folders")
    return tuple(dict.fromkeys(out))


def expand_methods(text: str) -> tuple[str, ...]:
    """Return the methods that a text names, each once.

    Raises:
        UsageError: With what would work.
    """
    groups = {"all": tuple(METHODS), "ablations": ABLATIONS, "baselines": BASELINES}
    names: list[str] = []
    for part in (p.strip() for p in text.split(",") if p.strip()):
        names += groups.get(part, (part,))
    try:
        found = tuple(dict.fromkeys(method_named(name).name for name in names))
    except ValueError as error:
        raise UsageError(f"{error}; or {', '.join(groups)}") from error
    if not found:
        raise UsageError(f"no methods; there are {', '.join(METHODS)}")
    return found


def trial_of(command: EvalRun) -> TrialConfig:
    """Return the set-up that all methods share; raises ValueError."""
    if command.image_width is not None and not 32 <= command.image_width <= 4096:
        raise ValueError(f"--image-width lies in 32 to 4096; got {command.image_width}")
    if command.robot == "habitat":
        trial = habitat_trial(command.image_width or 240)
    else:
        trial = TrialConfig(
            robot=ZED,
            image_width=command.image_width or ZED_IMAGE_WIDTH,
            limits=EpisodeLimits(time_step_s=0.2, max_time_s=300.0),
        )
    mission = MissionConfig(map=MapConfig(voxel_size_m=command.voxel_size_m))
    return dataclasses.replace(trial, mission=mission)


def catalogue_of(command: EvalRun) -> CatalogueConfig:
    """Return which episodes the homes give; raises ValueError."""
    return CatalogueConfig(
        goals=goals_of([g.strip() for g in command.objects.split(",") if g.strip()]),
        starts_per_goal=command.starts,
        small_per_home=command.small_per_home,
        context=command.context,
        seed=command.seed,
    )


def _settings(
    command: EvalRun, trial: TrialConfig, methods: tuple[str, ...], version: str
) -> dict[str, Any]:
    """Return what is stored beside the rows: enough to run the same again."""
    return {
        "fixed": {
            "seed": command.seed,
            "robot": command.robot,
            "image_width": trial.image_width,
            "voxel_size_m": command.voxel_size_m,
        },
        "command": {
            k: [str(p) for p in v] if isinstance(v, tuple) else str(v)
            for k, v in dataclasses.asdict(command).items()
            if k != "out"
        },
        "version": version,
        "configurations": {
            name: {
                "hash": config_hash(trial, method_named(name)),
                "trial": dataclasses.asdict(
                    dataclasses.replace(trial, mission=method_named(name).configure(trial.mission))
                ),
            }
            for name in methods
        },
    }


def _pool(workers: int, setup: WorkerSetup) -> concurrent.futures.ProcessPoolExecutor:
    # Forked children of a process that ran numba's threads would hang.
    return concurrent.futures.ProcessPoolExecutor(
        max_workers=workers,
        mp_context=multiprocessing.get_context("spawn"),
        initializer=start_worker,
        initargs=(setup,),
    )


def _abandon(pool: concurrent.futures.ProcessPoolExecutor) -> None:
    """End the workers in the middle of their episodes: a row is written whole or not at all."""
    pool.shutdown(wait=False, cancel_futures=True)
    for process in multiprocessing.active_children():
        process.terminate()


def _progress(screen: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[last]}"),
        console=screen,
    )


def _list(
    pool: concurrent.futures.ProcessPoolExecutor,
    homes: Sequence[str],
    limit: int | None,
    screen: Console,
) -> tuple[EpisodeSpec, ...]:
    """Ask every home for its episodes, and draw from them where there is a limit."""
    episodes: list[EpisodeSpec] = []
    dropped = 0
    with _progress(screen) as progress:
        task = progress.add_task("listing episodes", total=len(homes), last="")
        for specs, gone in pool.map(list_home, homes):
            episodes += specs
            dropped += len([d for d in gone if d.reason != "absent"])
            progress.advance(task)
    if dropped:
        screen.print(f"{dropped} starts left out: at a viewpoint already, or without a way")
    if not episodes:
        raise UsageError("these homes have none of these objects within reach")
    if limit is None or limit >= len(episodes):
        return tuple(episodes)
    # A draw that mixes homes and objects, and that a larger limit only adds to.
    drawn = sorted(episodes, key=lambda e: zlib.crc32(e.episode_id.encode()))[:limit]
    chosen = {e.episode_id for e in drawn}
    return tuple(e for e in episodes if e.episode_id in chosen)


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
        if not folder.has(spec.episode_id, name, hashes[name])
    )


def _run(
    pool: concurrent.futures.ProcessPoolExecutor,
    folder: EvaluationFolder,
    jobs: Sequence[Job],
    screen: Console,
) -> int:
    """Run the jobs and write their rows; returns how many could not be run to their end."""
    failed = 0
    with _progress(screen) as progress:
        task = progress.add_task("searching", total=len(jobs), last="")
        waiting = {pool.submit(run_job, job): job for job in jobs}
        for done in concurrent.futures.as_completed(waiting):
            job = waiting[done]
            error = done.exception()
            if isinstance(error, BrokenProcessPool):
                raise error
            if error is None:
                row = done.result()
                folder.write(row)
                text = _one_line(row)
            else:
                failed += 1
                text = f"{job.spec.episode_id} {job.method}: {error}"
                trace = "".join(traceback.format_exception(error))
                folder.write_error(job.spec.episode_id, job.method, trace)
            progress.update(task, advance=1, last=text)
            if not screen.is_terminal:
                screen.print(text, soft_wrap=True, highlight=False)
    if failed:
        screen.print(f"[red]{failed} episodes could not be run; see {_errors(folder)}[/red]")
    return failed


def _errors(folder: EvaluationFolder) -> Path:
    return folder.path / "errors"


def _one_line(row: EpisodeRow) -> str:
    how = "found" if row.success else row.failure
    return f"{row.episode_id} {row.method}: {how}, SPL {row.spl:.2f}, {row.time_s:.0f} s"
