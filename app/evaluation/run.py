"""`ippon eval run`: many episodes in many processes, one row each, resumable."""

import dataclasses
import sys
import traceback
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape

from app.cli.options.evaluation import EvalRun
from app.errors import UsageError
from app.evaluation.process_workers import ProcessWorkers, Workers
from app.evaluation.progress import progress_bar
from app.evaluation.results_folder import EvaluationFolder
from app.evaluation.version import version_text
from app.evaluation.worker import Job, WorkerSetup, list_home, run_job
from app.homes import expand_homes
from app.robot_file import PROFILES, map_config, read_profile
from ippon.evaluation.catalogue import (
    CatalogueConfig,
    Dropped,
    EpisodeSpec,
    draw_episodes,
    goals_of,
    home_name,
)
from ippon.evaluation.episode import EpisodeLimits
from ippon.evaluation.methods.method_table import ABLATIONS, BASELINES, METHODS, method_named
from ippon.evaluation.row import EpisodeRow
from ippon.evaluation.trial import TrialConfig, config_hash, habitat_trial
from ippon.mapping.config import MapConfig
from ippon.mission.config import MissionConfig
from ippon.robot import HABITAT, RobotProfile

EXIT_FAILED = 1
ZED_IMAGE_WIDTH = 320


def run_evaluation(command: EvalRun) -> int:
    """Run every episode that the folder lacks."""
    homes = expand_homes(command.homes)
    methods = expand_methods(command.methods)
    try:
        trial, catalogue = trial_of(command), catalogue_of(command)
    except ValueError as error:
        raise UsageError(str(error)) from error
    _check(command, methods)
    version = version_text()
    folder = EvaluationFolder(command.out)
    folder.check_homes(homes)
    folder.open_for(_settings(command, trial, methods, version))
    screen = Console(file=sys.stderr)
    workers = _workers(command, WorkerSetup(trial=trial, catalogue=catalogue, version=version))
    try:
        episodes, broken = _list(workers, homes, folder, screen)
        episodes = draw_episodes(episodes, command.limit)
        failed = broken + _run(workers, folder, _jobs(folder, episodes, methods, trial), screen)
    except KeyboardInterrupt:
        screen.print(f"interrupted; to go on, start again with --out {command.out}")
        raise
    finally:
        workers.close()
    count = folder.merge() if folder.has_rows() else 0
    screen.print(f"{count} rows in {command.out}; see `ippon eval report {command.out}`")
    return EXIT_FAILED if failed else 0


def _check(command: EvalRun, methods: tuple[str, ...]) -> None:
    """Refuse what cannot be run; raises UsageError."""
    for name, value in (("workers", command.workers), ("limit", command.limit)):
        if value is not None and value < 1:
            raise UsageError(f"--{name} is at least 1; got {value}")
    single = [name for name in methods if not method_named(name).goes_on]
    if command.second_object and single:
        raise UsageError(
            f"{', '.join(single)} cannot go on to a second object; leave them out of --methods, or "
            "leave --second-object out"
        )
    if command.ray is not None and len(command.ray) > 1:
        raise UsageError(f"--ray takes one address; got {', '.join(command.ray)}")


def _workers(command: EvalRun, setup: WorkerSetup) -> Workers:
    if command.ray is None:
        return ProcessWorkers(command.workers or 1, setup)
    from app.evaluation.ray_workers import RayWorkers

    return RayWorkers(next(iter(command.ray), None), command.workers, setup)


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


def trial_of(command: EvalRun, profile: RobotProfile | None = None) -> TrialConfig:
    """Return the set-up that all methods share.

    Args:
        command: What was asked for.
        profile: In place of the one that `command.robot` names.

    Raises:
        ValueError: It cannot be used.
    """
    if command.image_width is not None and not 32 <= command.image_width <= 4096:
        raise ValueError(f"--image-width lies in 32 to 4096; got {command.image_width}")
    robot = profile or read_profile(command.robot)
    if robot == HABITAT:
        trial = habitat_trial(command.image_width or 240)
    else:
        trial = TrialConfig(
            robot=robot,
            image_width=command.image_width or ZED_IMAGE_WIDTH,
            limits=EpisodeLimits(time_step_s=0.2, max_time_s=300.0),
        )
    if command.max_time_s is not None:
        limits = dataclasses.replace(trial.limits, max_time_s=command.max_time_s)
        trial = dataclasses.replace(trial, limits=limits)
    voxels = MapConfig(voxel_size_m=command.voxel_size_m)
    if robot not in PROFILES.values():
        voxels = map_config(robot, command.voxel_size_m)
    return dataclasses.replace(trial, mission=MissionConfig(map=voxels))


def catalogue_of(command: EvalRun) -> CatalogueConfig:
    """Return which episodes the homes give; raises ValueError."""
    return CatalogueConfig(
        goals=goals_of([g.strip() for g in command.objects.split(",") if g.strip()]),
        starts_per_goal=command.starts,
        small_per_home=command.small_per_home,
        context=command.context,
        second_object=command.second_object,
        min_shortest_path_m=command.min_path_m,
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
            "max_time_s": command.max_time_s,
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


def _list(
    workers: Workers, homes: Sequence[str], folder: EvaluationFolder, screen: Console
) -> tuple[list[EpisodeSpec], int]:
    """Ask every home for its episodes; returns them, and how many homes could not be read."""
    found: dict[str, tuple[EpisodeSpec, ...]] = {}
    dropped: list[Dropped] = []
    broken: dict[str, BaseException] = {}
    with progress_bar(screen) as progress:
        task = progress.add_task("listing episodes", total=len(homes), last="")
        for home, listed in workers.each(list_home, homes):
            name = f"home {home_name(home)}"
            if isinstance(listed, BaseException):
                broken[home] = listed
                folder.write_error(name, trace_of(listed))
            else:
                folder.forget_error(name)
                found[home] = listed[0]
                dropped += listed[1]
            progress.advance(task)
    for home, error in broken.items():
        screen.print(f"[red]{escape(home)}: {escape(str(error))}[/red]", soft_wrap=True)
    left_out = [d for d in dropped if d.reason != "absent"]
    if left_out:
        screen.print(
            f"{len(left_out)} starts left out: too near to a viewpoint, without a way, or upstairs"
        )
    episodes = [spec for home in homes for spec in found.get(home, ())]
    if not episodes:
        raise UsageError(_nothing(dropped, broken))
    return episodes, len(broken)


def _nothing(dropped: Sequence[Dropped], broken: Mapping[str, BaseException]) -> str:
    """Say why no home gives an episode."""
    if broken:
        home, error = next(iter(broken.items()))
        return f"no home could be searched; the first, {home}: {error}"
    absent = sorted({d.goal for d in dropped if d.reason == "absent"})
    why = f"; absent: {', '.join(absent)}" if absent else ""
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
        if not all(folder.has(row_id, name, hashes[name]) for row_id in spec.row_ids)
    )


def _run(workers: Workers, folder: EvaluationFolder, jobs: Sequence[Job], screen: Console) -> int:
    """Run the jobs and write their rows; returns how many could not be run to their end."""
    failed = 0
    with progress_bar(screen) as progress:
        task = progress.add_task("searching", total=len(jobs), last="")
        for job, outcome in workers.each(run_job, jobs):
            name = f"{job.spec.episode_id}.{job.method}"
            if isinstance(outcome, BaseException):
                failed += 1
                text = f"{name}: {outcome}"
                folder.write_error(name, trace_of(outcome))
            else:
                for row in outcome:
                    folder.write(row)
                text = "; ".join(_one_line(row) for row in outcome)
            progress.update(task, advance=1, last=text)
            if not screen.is_terminal:
                screen.print(text, soft_wrap=True, highlight=False)
    if failed:
        where = folder.path / "errors"
        screen.print(f"[red]{failed} episodes could not be run; see {where}[/red]")
    return failed


def trace_of(error: BaseException) -> str:
    """Return an error as Python prints it."""
    return "".join(traceback.format_exception(error))


def _one_line(row: EpisodeRow) -> str:
    how = "found" if row.success else row.failure
    return f"{row.episode_id} {row.method}: {how}, SPL {row.spl:.2f}, {row.time_s:.0f} s"
