"""The navigator's process: from compiling to the last message."""

import logging
import os
from collections.abc import Callable

from app.links.language_model.interface import LanguageModelInterface
from app.links.network.registry import RunningNavigator, register
from app.links.network.session import open_router
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.node import Navigator
from app.nodes.navigator.state.persistence import SavedState
from app.nodes.navigator.warm_up import warm_up
from app.process.stop_signal import ProcessStopSignal

logger = logging.getLogger(__name__)


def run_navigator(
    config: NavigatorConfig,
    progress: Callable[[float], None],
    model: LanguageModelInterface | None = None,
    saved: SavedState | None = None,
) -> None:
    """Compile, listen, and navigate until SIGINT or SIGTERM.

    Args:
        config: Where to listen and how to search.
        progress: Called with the fraction of the preparation that is done; 1 means ready.
        model: Asked for levels beside the embedded prior; closed at the end.
        saved: State of an earlier navigator: its map is continued, and its goals are restored
            with the robot stopped until the operator resumes.

    Raises:
        LinkError: The endpoint is taken.
    """
    stop = ProcessStopSignal()
    session = open_router(config.listen)
    entry = None
    try:
        warm_up(config, lambda fraction: progress(0.98 * fraction))
        navigator = Navigator(config, session, model, saved)
        entry = register(
            RunningNavigator(pid=os.getpid(), robot=config.robot, endpoint=config.listen)
        )
        progress(1.0)
        logger.info("navigator ready at %s, prefix %s", config.listen, config.robot)
        try:
            navigator.run(stop)
        finally:
            navigator.close()
    finally:
        if entry is not None:
            entry.unlink(missing_ok=True)
        session.close()  # pyright: ignore[reportUnknownMemberType]
