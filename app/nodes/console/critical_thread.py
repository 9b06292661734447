"""Threads that the console needs: when one fails, the console ends."""

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
        except Exception as error:  # Any failure must end the console.
            logger.exception("the %s of the console has failed", name)
            on_failure(error)

    return threading.Thread(target=run, name=name, daemon=True)
