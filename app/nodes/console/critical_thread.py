"""Threads without which the console is of no use: when one fails, the console ends."""

import logging
import threading
from collections.abc import Callable

logger = logging.getLogger(__name__)

OnFailure = Callable[[Exception], None]


def critical_thread(name: str, work: Callable[[], None], on_failure: OnFailure) -> threading.Thread:
    """Return a thread, not started, that logs and hands over what its work raises.

    A page that goes on without its link or its drawing would show "live" for ever.
    """

    def run() -> None:
        try:
            work()
        except Exception as error:  # Whatever it is, nothing may look alive after it.
            logger.exception("the %s of the console has failed", name)
            on_failure(error)

    return threading.Thread(target=run, name=name, daemon=True)
