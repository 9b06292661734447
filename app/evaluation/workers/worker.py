"""Work of a worker process of `ippon eval run`: list a home's episodes, run one episode."""

import dataclasses
import functools
import signal
import time
from dataclasses import dataclass
from typing import Final

from app.homes import load_home
from ippon.evaluation.episode_generation import (
    EpisodeGenerationConfig,
    EpisodeSpec,
    ExcludedEpisode,
    list_episodes,
)
from ippon.evaluation.episode_record import Clocks
from ippon.evaluation.methods.method_table import method_named
from ippon.evaluation.row import EpisodeRow
from ippon.evaluation.summary import REFERENCE
from ippon.evaluation.trial import Trial, TrialConfig
from ippon.guidance.prior import EmbeddedPrior
from ippon.simulation.scene import Scene

WARM_UP_S: Final = 16.0
"""Longest simulated time of the search that loads the kernels: one turn, then a drive."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One episode by one method."""

    spec: EpisodeSpec
    method: str


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerSetup:
    """Setup of every worker."""

    trial: TrialConfig
    catalogue: EpisodeGenerationConfig
    version: str


_setup: WorkerSetup | None = None


def start_worker(setup: WorkerSetup) -> None:
    """Initialise this process; Ctrl-C is handled by its parent."""
    global _setup  # noqa: PLW0603 - a pool's initializer has no other way
    _setup = setup
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def list_home(home: str) -> tuple[tuple[EpisodeSpec, ...], tuple[ExcludedEpisode, ...]]:
    """List the episodes of one home."""
    setup = _given()
    return list_episodes(_scene(home), home, setup.trial.robot, setup.catalogue)


def run_job(job: Job) -> tuple[EpisodeRow, ...]:
    """Run one episode."""
    _load_kernels(job.spec)
    return _trial(job.spec.home).run_all(job.spec, method_named(job.method))


def _given() -> WorkerSetup:
    assert _setup is not None, "start_worker() comes first"
    return _setup


# Jobs are ordered by home, so that a worker mostly reuses its last home.
@functools.lru_cache(maxsize=2)
def _scene(home: str) -> Scene:
    return load_home(home, coloured_mugs=_given().catalogue.colours)


@functools.lru_cache(maxsize=2)
def _trial(home: str) -> Trial:
    setup = _given()
    clocks = Clocks(wall=time.perf_counter, cpu=time.process_time)
    return Trial(setup.trial, _scene(home), setup.version, clocks, _prior())


_kernels_are_loaded = False


def _load_kernels(spec: EpisodeSpec) -> None:
    """Run a short search once per process, so that no row's time includes compilation."""
    global _kernels_are_loaded  # noqa: PLW0603 - state of this process
    if not _kernels_are_loaded:
        setup = _given()
        limits = setup.trial.limits
        limits = dataclasses.replace(limits, max_time_s=min(WARM_UP_S, limits.max_time_s))
        trial = dataclasses.replace(setup.trial, limits=limits)
        clocks = Clocks(wall=time.perf_counter, cpu=time.process_time)
        Trial(trial, _scene(spec.home), setup.version, clocks, _prior()).run(
            spec, method_named(REFERENCE)
        )
        _kernels_are_loaded = True


@functools.lru_cache(maxsize=1)
def _prior() -> EmbeddedPrior:
    return EmbeddedPrior()
