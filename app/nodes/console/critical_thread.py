"""Threads whose failure ends the console."""

import logging
import threading
from collections.abc import Callable

logger = logging.getLogger(__name__)

OnFailure = Callable[[Exception], None]


def critical_thread(name: str, work: Callable[[], None], on_failure: OnFailure) -> threading.Thread:
    """Return a thread, not started, that logs an exception of `work` and passes it to `on_failure`.

    Without it the page would keep showing "live" after its link or its drawing has failed.
    """

    def run() -> None:
        try:
            work()
        except Exception as error:  # Every failure ends the console.
            logger.exception("the %s of the console has failed", name)
            on_failure(error)

    return threading.Thread(target=run, name=name, daemon=True)
