"""Workers on a Ray cluster, of many machines or of this one.

This program must be installed on every machine, and folders of homes must have the same path there.
"""

import importlib
import os
import socket
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from app.evaluation.errors import EvaluationError
from app.evaluation.workers.worker import WorkerSetup, start_worker

Item = TypeVar("Item")
Result = TypeVar("Result")
_PATIENCE_S = 5.0
_HOOK = "app.process.environment.prepare_process"
"""Runs first in every worker, because threads and caches must be set before numba is imported."""


class RayWorkers:
    """Ray actors, one per processor; each is started once, as late as possible."""

    def __init__(self, address: str | None, count: int | None, setup: WorkerSetup) -> None:
        """Join a cluster, or start one on this machine.

        Args:
            address: Address of the cluster; None starts one.
            count: Number of actors; None for one per processor.
            setup: Setup of every worker.

        Raises:
            EvaluationError: Ray is not installed, or no cluster answers.
        """
        # Disables Ray's usage reports.
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        try:
            ray: Any = importlib.import_module("ray")
        except ImportError as error:
            raise EvaluationError('--ray needs Ray: pip install "ippon[ray]"') from error
        self._ray = ray
        if address is not None:
            _check_answers(address)
        local = {"include_dashboard": False, "num_cpus": count or os.cpu_count()}
        try:
            ray.init(
                address=address or "local",
                log_to_driver=False,
                logging_level="ERROR",
                runtime_env={"worker_process_setup_hook": _HOOK},
                **({} if address else local),
            )
        except (ConnectionError, ValueError, RuntimeError) as error:
            raise _no_cluster(address or "this machine", error) from error
        self._setup = setup
        self._actor = ray.remote(num_cpus=1, max_restarts=0)(_Worker)
        processors = int(ray.cluster_resources().get("CPU", 1))
        self._count = max(1, min(count or processors, processors))
        self._idle: list[Any] = []

    def each(
        self, work: Callable[[Item], Result], items: Sequence[Item]
    ) -> Iterator[tuple[Item, Result | BaseException]]:
        """See `Workers.each`; an actor that died is replaced."""
        ray = self._ray
        queue = list(reversed(items))
        busy: dict[Any, tuple[Any, Item]] = {}

        def hand_out(free: Any | None) -> None:
            if queue:
                item = queue.pop()
                actor = self._actor.remote(self._setup) if free is None else free
                busy[actor.call.remote(work, item)] = (actor, item)
            elif free is not None:
                self._idle.append(free)

        for _ in range(min(self._count, len(items))):
            hand_out(self._idle.pop() if self._idle else None)
        while busy:
            (done, *_), _ = ray.wait(list(busy))
            actor, item = busy.pop(done)
            try:
                outcome: Result | BaseException = ray.get(done)
            except ray.exceptions.RayTaskError as error:
                outcome = error
            except ray.exceptions.RayError as error:
                outcome = error
                actor = None
            hand_out(actor)
            yield item, outcome

    def close(self) -> None:
        """Disconnect from the cluster; a cluster started here ends."""
        self._idle.clear()
        self._ray.shutdown()


def _check_answers(address: str) -> None:
    """Check host:port at once, because Ray retries for minutes; accept names like "auto".

    Raises:
        EvaluationError: Nothing answers at host:port.
    """
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not colon or not port.isdecimal():
        return
    try:
        socket.create_connection((host, int(port)), timeout=_PATIENCE_S).close()
    except (OSError, OverflowError) as error:
        raise _no_cluster(address, error) from error


def _no_cluster(address: str, error: Exception) -> EvaluationError:
    return EvaluationError(
        f"no Ray cluster answers at {address}: {error}; give the address that `ray start --head` "
        "prints, or --ray alone for this machine"
    )


class _Worker:
    """Actor in a process of the cluster."""

    def __init__(self, setup: WorkerSetup) -> None:
        start_worker(setup)

    def call(self, work: Callable[[Any], Any], item: Any) -> Any:
        return work(item)
