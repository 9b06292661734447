"""What one viewpoint takes, all its orientations at once, wherever searches evaluate one.

Processor time of single evaluations, so that other work on the machine weighs little; it still
shows in the longest, since it throws the map out of the cache.
"""

import dataclasses
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from ippon.evaluation.methods.method_table import METHODS
from ippon.evaluation.trial import habitat_trial
from ippon.planning.visibility.viewpoint_store import ViewpointStore
from ippon.simulation.homes.generator import generate_home
from tests.benchmarks.exploring import explore
from tests.benchmarks.rows import Row

HOMES = (3, 2303, 2305)
SEARCH_S = 150.0
WARM = 50
"""Evaluations that are not counted: the first load compiled code."""
NAME = "one viewpoint, every orientation"


def viewpoint_rows() -> Iterator[Row]:
    """Explore homes for something that is not there, and time what is evaluated on the way."""
    config = habitat_trial()
    limits = dataclasses.replace(config.limits, max_time_s=SEARCH_S)
    config = dataclasses.replace(config, limits=limits)
    with timed_evaluations() as seconds:
        for seed in HOMES:
            explore(config, generate_home(seed), METHODS["ippon"], seed)
    yield from evaluation_rows(seconds, f"{len(HOMES)} homes, {config.robot.max_depth_m:g} m")


def evaluation_rows(seconds: Sequence[float], where: str) -> Iterator[Row]:
    """Return median, 95th percentile and longest of single evaluations."""
    milliseconds = 1e3 * np.array(seconds[WARM:])
    data = f"{where}, {len(milliseconds)} evaluations"
    median = float(np.median(milliseconds))
    yield Row(name=NAME, data=data, voxel_size_m=0.1, median_ms=median)
    for name, share in (("95th percentile", 95), ("longest", 100)):
        value = float(np.percentile(milliseconds, share))
        yield Row(name=f"{NAME}, {name}", data=data, voxel_size_m=0.1, value=value, unit="ms")


@contextmanager
def timed_evaluations() -> Iterator[list[float]]:
    """Collect the processor time of every evaluation of a viewpoint, seconds."""
    seconds: list[float] = []
    plain = ViewpointStore.evaluate

    def timed(*arguments, **named) -> None:
        began = time.process_time()
        plain(*arguments, **named)
        seconds.append(time.process_time() - began)

    ViewpointStore.evaluate = timed
    try:
        yield seconds
    finally:
        ViewpointStore.evaluate = plain
