"""The navigator's process: from compiling to the last message."""

import contextlib
import logging
import os
from collections.abc import Callable, Generator
from dataclasses import replace
from pathlib import Path

import msgspec
import zenoh

from app.links.language_model.interface import LanguageModelInterface
from app.links.loopback import reachable
from app.links.network.registry import Registration, RunningNavigator, register
from app.links.network.session import is_open_to_all, open_router
from app.links.rmw_zenoh.robot_link import RobotLink
from app.messages import keys
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.localization.alignment import Alignment, said_registration
from app.nodes.navigator.node import Navigator
from app.nodes.navigator.state.map_aside import move_aside, new_map_for_tracking, without_map
from app.nodes.navigator.state.persistence import RunState, SavedState
from app.nodes.navigator.warm_up import warm_up
from app.process.stop_signal import ProcessStopSignal, StopSignal
from app.ros2.ippon_ros2.settings import Settings
from ippon.geometry import Float64Array
from ippon.memory.registration import RegistrationError

logger = logging.getLogger(__name__)


def run_navigator(
    config: NavigatorConfig,
    progress: Callable[[float], None],
    model: LanguageModelInterface | None = None,
    saved: SavedState | None = None,
    *,
    align: bool = False,
    ros2: Settings | None = None,
) -> None:
    """Compile, listen, and navigate until SIGINT or SIGTERM.

    Args:
        config: Where to listen and how to search.
        progress: Called with the fraction of the preparation that is done; 1 means ready.
        model: Asked for levels beside the embedded prior; closed at the end.
        saved: State of an earlier navigator: its map is continued, and its goals are restored
            with the robot stopped until the operator resumes.
        align: Find the robot's place in that map first; without a certain one, the map's file is
            kept aside, and another map begins.
        ros2: Topics of a robot whose nodes have rmw_zenoh; None for one that sends to the
            navigator's keys by itself.

    Raises:
        LinkError: The endpoint is taken.
        NoFrameError: No image came to align; the kept map stays as it is.
        OSError: A kept map cannot be put aside.
        KeyboardInterrupt: It was stopped while it compiled.
    """
    stop = ProcessStopSignal()
    session = open_router(config.listen)
    link = entry = None
    try:
        with stop.interrupting(), starting(session, config.robot):
            warm_up(config, lambda fraction: progress(0.98 * fraction))
        link = ros2 and RobotLink(session, config.robot, ros2)
        T_map_world = None
        saved, note = new_map_for_tracking(config, saved)
        if align and saved is not None and saved.voxel_map is not None:
            # Before the turn: who sees the robot move must be able to stop it.
            entry = _list(config)
            held = saved.interrupted is not None and saved.interrupted.held
            alignment = Alignment(session, config, saved.voxel_map, held=held)
            saved, T_map_world, note = _align(alignment, config, saved, stop)
            # What subscribed for the alignment ends with its session; robot and console come back.
            _close(session, link)
            # Until now a Stop was answered.
            saved = _after(alignment, saved)
            session = open_router(config.listen)
            link = ros2 and RobotLink(session, config.robot, ros2)
        navigator = Navigator(
            config, session, model, saved, T_map_world, link.notes if link else tuple
        )
        if note:
            navigator.report_alignment(note)
        entry = entry or _list(config)
        _serve(navigator, config, progress, stop)
    finally:
        if entry is not None:
            entry.close()
        _close(session, link)


def _close(session: zenoh.Session, link: RobotLink | None) -> None:
    if link is not None:
        link.close()
    session.close()  # pyright: ignore[reportUnknownMemberType]


@contextlib.contextmanager
def starting(session: zenoh.Session, robot: str) -> Generator[None]:
    """Show that the navigator is not ready yet, for as long as it compiles."""
    token = session.liveliness().declare_token(f"{robot}/{keys.NAVIGATOR_STARTING}")
    try:
        yield
    finally:
        token.undeclare()  # pyright: ignore[reportUnknownMemberType]


def _serve(
    navigator: Navigator,
    config: NavigatorConfig,
    progress: Callable[[float], None],
    stop: StopSignal,
) -> None:
    """Run the navigator until it is stopped."""
    try:
        progress(1.0)
        logger.info("navigator ready at %s, prefix %s", config.listen, config.robot)
        if is_open_to_all(config.listen):
            logger.warning(
                "every program that reaches %s may drive the robot: use this on a trusted network "
                "only, or with certificates (ippon certificates, IPPON_ZENOH_PROFILE)",
                config.listen,
            )
        navigator.run(stop)
    finally:
        navigator.close()


def _list(config: NavigatorConfig) -> Registration | None:
    """List the navigator among those of this machine."""
    endpoint = reachable(config.listen)
    return register(RunningNavigator(pid=os.getpid(), robot=config.robot, endpoint=endpoint))


def _align(
    alignment: Alignment, config: NavigatorConfig, saved: SavedState, stop: StopSignal
) -> tuple[SavedState, Float64Array | None, str]:
    """Find the robot's place in the kept map.

    Returns:
        The state to go on with; from the robot's frame to the map's, None for the same; and what
        to tell the operator.

    Raises:
        NoFrameError: No image came.
        OSError: The kept map cannot be put aside.
    """
    registration, problem = None, ""
    try:
        registration = alignment.run(stop)
    except RegistrationError as error:
        problem = str(error)
    if problem:
        kept = "kept"
        if config.keep_map:
            kept = f"kept as {move_aside(Path(config.keep_map)).name}"
        note = f"the kept map cannot be aligned: {problem}; it is {kept}, and a new map begins"
        saved, note = without_map(saved, note)
        return saved, None, note
    if registration is None:
        return saved, None, ""
    return saved, registration.T_map_world, said_registration(registration)


def _after(alignment: Alignment, saved: SavedState) -> SavedState:
    """Return the state in which a Stop holds until Resume, also without a goal to restore."""
    was = saved.interrupted or RunState(held=False, mode="auto", speed_limit=1.0)
    now = msgspec.structs.replace(was, held=alignment.is_stopped)
    return saved if now == was else replace(saved, interrupted=now)
