"""Worker processes on this machine."""

import concurrent.futures
import multiprocessing
import os
import pickle
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from typing import Protocol, TypeVar

from app.evaluation.errors import EvaluationError
from app.evaluation.workers.worker import WorkerSetup, start_worker
from app.process.parent_watch import end_with_parent

Item = TypeVar("Item")
Result = TypeVar("Result")


class Workers(Protocol):
    """Runs work items in other processes; `close` ends them."""

    def each(
        self, work: Callable[[Item], Result], items: Sequence[Item]
    ) -> Iterator[tuple[Item, Result | BaseException]]:
        """Yield every item with its result or its error, in order of completion.

        Raises:
            EvaluationError: A worker was killed.
        """
        ...

    def close(self) -> None:
        """End the processes, even during work."""
        ...


class ProcessWorkers:
    """Workers that are processes of this machine."""

    def __init__(self, count: int, setup: WorkerSetup) -> None:
        # Forked children of a process that ran numba's threads would hang.
        self._pool = concurrent.futures.ProcessPoolExecutor(
            max_workers=count,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_start,
            initargs=(setup, os.getpid()),
        )

    def each(
        self, work: Callable[[Item], Result], items: Sequence[Item]
    ) -> Iterator[tuple[Item, Result | BaseException]]:
        """See `Workers.each`."""
        waiting = {self._pool.submit(_restorable, work, item): item for item in items}
        for done in concurrent.futures.as_completed(waiting):
            error = done.exception()
            if isinstance(error, BrokenProcessPool):
                raise EvaluationError(
                    "a worker process was killed, perhaps because memory ran out; restart with "
                    "fewer --workers: finished episodes are kept"
                ) from error
            yield waiting[done], done.result() if error is None else error

    def close(self) -> None:
        """See `Workers.close`."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        for process in multiprocessing.active_children():
            process.terminate()
            process.join()


def _restorable(work: Callable[[Item], Result], item: Item) -> Result:
    """Do the work; an error that pickle cannot restore, which would end the pool, is described."""
    try:
        return work(item)
    except Exception as error:
        try:
            pickle.loads(pickle.dumps(error))  # noqa: S301 - made in this process
        except Exception:  # noqa: BLE001 - whatever the error's class raises
            described = RuntimeError(f"{type(error).__name__}: {error}")
            described.add_note("".join(traceback.format_exception(error)))
            raise described from None
        raise


def _start(setup: WorkerSetup, parent_pid: int) -> None:
    start_worker(setup)
    end_with_parent(parent_pid)
