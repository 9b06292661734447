"""Worker processes on this machine."""

import concurrent.futures
import multiprocessing
import os
import pickle
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from typing import Final, Protocol, TypeVar

from app.evaluation.errors import EvaluationError
from app.evaluation.workers.worker import WorkerSetup, start_worker
from app.process.parent_watch import end_with_parent

MOST_DEATHS: Final = 3
"""Pieces of work in a row that end a process of their own, from which it is not their fault.

In a row: no other is done between them, alone or beside others."""
Item = TypeVar("Item")
Result = TypeVar("Result")


class WorkerDiedError(Exception):
    """The process of a piece of work ended during it."""


class Workers(Protocol):
    """Runs work items in other processes; `close` ends them."""

    def each(
        self, work: Callable[[Item], Result], items: Sequence[Item]
    ) -> Iterator[tuple[Item, Result | BaseException]]:
        """Yield every item with its result or its error, in order of completion.

        Raises:
            EvaluationError: Workers are killed again and again.
        """
        ...

    def close(self) -> None:
        """End the processes, even during work."""
        ...


class ProcessWorkers:
    """Workers that are processes of this machine."""

    def __init__(self, count: int, setup: WorkerSetup) -> None:
        self._count, self._setup = count, setup
        self._pool = self._new_pool()

    def each(
        self, work: Callable[[Item], Result], items: Sequence[Item]
    ) -> Iterator[tuple[Item, Result | BaseException]]:
        """See `Workers.each`.

        Where a process dies, what may have ended it is done again alone; what ends that process,
        too, has an error, and the others go on: from the other end, because work that fails for one
        reason, such as the size of a home, stands together.
        """
        left, deaths = list(items), 0
        while left:
            lost: set[int] = set()
            waiting = {self._pool.submit(_restorable, work, item): item for item in left}
            for done in concurrent.futures.as_completed(waiting):
                error = done.exception()
                if isinstance(error, BrokenProcessPool):
                    lost.add(id(waiting[done]))
                else:
                    deaths = 0
                    yield waiting[done], done.result() if error is None else error
            if not lost:
                return
            if deaths >= MOST_DEATHS:
                raise EvaluationError(
                    "worker processes are killed again and again, perhaps because memory ran "
                    "out: finished episodes are kept; start again with more free memory"
                )
            # Work is begun in its order.
            left = [item for item in left if id(item) in lost]
            begun, left = left[: self._count], left[self._count :]
            for item in begun:
                outcome = self._alone(work, item)
                deaths = deaths + 1 if isinstance(outcome, WorkerDiedError) else 0
                yield item, outcome
            left.reverse()

    def _alone(self, work: Callable[[Item], Result], item: Item) -> Result | BaseException:
        """Do one piece of work in new processes, of which it starts one."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        self._pool = self._new_pool()
        future = self._pool.submit(_restorable, work, item)
        error = future.exception()
        if isinstance(error, BrokenProcessPool):
            self._pool = self._new_pool()
            return WorkerDiedError(
                "its process ended twice: it crashed, or was killed, perhaps because memory ran out"
            )
        return future.result() if error is None else error

    def close(self) -> None:
        """See `Workers.close`."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        for process in multiprocessing.active_children():
            process.terminate()
            process.join()

    def _new_pool(self) -> concurrent.futures.ProcessPoolExecutor:
        # Forked children of a process that ran numba's threads would hang.
        return concurrent.futures.ProcessPoolExecutor(
            max_workers=self._count,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_start,
            initargs=(self._setup, os.getpid()),
        )


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
