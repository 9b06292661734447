"""Streams a running robot to a viewer of Rerun, or into a file of it."""

import contextlib
import logging
import os
import socket
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final, get_args
from urllib.parse import urlsplit

import rerun as rr

from app.messages.cdr import MessageError
from app.messages.status import Event
from app.nodes.viewers.errors import ViewerError
from app.nodes.viewers.live_robot import (
    CEILING_M,
    IMAGES,
    LinkState,
    LiveRobot,
    begins_again,
    clock_ns,
)
from app.nodes.viewers.rerun_blueprint import blueprint
from app.nodes.viewers.rerun_files import check_file, check_space, incomplete, next_file
from app.nodes.viewers.rerun_scene import RerunScene
from app.process.stop_signal import ProcessStopSignal
from app.view.model.scene_model import Part, SceneModel

logger = logging.getLogger(__name__)

APPLICATION: Final = "ippon"
PORT: Final = 9876
"""Rerun's own default."""
MAP_S: Final = 1.0
"""Interval between two drawings of the changed parts of the map."""
DEPTH_S: Final = 0.5
"""Interval between two depth images: five times the bytes of the colour images."""
CHECK_S: Final = 2.0
"""Interval between two checks whether viewer or file still receives."""
STALLED_S: Final = 20.0
"""How long a viewer may not keep up before it counts as lost."""
_RETRY_S: Final = 1.0
_CONNECT_S: Final = 1.0
_FLUSH_S: Final = 1.0
_EXIT_S: Final = 10.0
"""How long a viewer whose line broke may take to end."""
_SHORT_S: Final = 10.0
"""Without a display the viewer listens for a moment and ends, with status 0: one that is gone so
soon after it was reached has failed, and was not closed."""
_ENDED: Final = (
    "Rerun's viewer was started and has ended. Without a display, use --save FILE.rrd, or --url "
    "for a viewer on another machine"
)
_ALL: Final[frozenset[Part]] = frozenset(get_args(Part))


@dataclass(frozen=True, slots=True, kw_only=True)
class RerunConfig:
    """The robot, and where its scene is shown."""

    connect: str = "tcp/127.0.0.1:7447"
    robot: str = "ippon"
    url: str | None = None
    """Viewer that runs already; None starts one on this machine."""
    save: Path | None = None
    """File instead of a viewer."""
    ceiling_m: float = CEILING_M
    """Height above which no voxel is drawn."""

    def __post_init__(self) -> None:
        """Refuse what contradicts itself."""
        if self.url is not None and self.save is not None:
            raise ValueError("--url and --save exclude each other")
        if self.url is not None:
            address_of(self.url)


def address_of(url: str) -> tuple[str, int]:
    """Return host and port of a viewer.

    Raises:
        ValueError: It is no address of a viewer.
    """
    parts = urlsplit(url)
    try:
        port = parts.port or PORT
    except ValueError:
        port = 0
    if not parts.scheme.startswith("rerun") or not parts.hostname or not port:
        raise ValueError(
            f"{url!r} is not the address of a viewer, such as rerun+http://127.0.0.1:9876/proxy"
        )
    return parts.hostname, port


class RerunViewer:
    """A viewer that a scene is drawn into; one that goes away gets everything when it is back.

    Nothing is kept for a viewer that does not answer.
    """

    def __init__(self, config: RerunConfig) -> None:
        """Open the file, or start the viewer.

        Raises:
            ViewerError: The file cannot be written, or the viewer cannot be started.
        """
        self._robot = config.robot
        self._first_file = self._save = config.save
        self._ceiling_m = config.ceiling_m
        self._process: subprocess.Popen[bytes] | None = None
        """The viewer that this program started."""
        self._url = config.url or f"rerun+http://127.0.0.1:{PORT}/proxy"
        self._scene: RerunScene | None = None
        self._stream: rr.RecordingStream | None = None
        self._told = False
        self._tried_at = self._checked_at = self._mapped_at = self._deep_at = 0.0
        self._received_at = self._opened_at = 0.0
        self.closed = False
        """Whether the viewer that this program started was closed."""
        self._now_ns = 0
        self._past: Event | None = None
        """Last event before the robot's clock began again."""
        if config.save is not None:
            self._open_file(config.save)
        elif config.url is None and not _answers(self._url):
            self._process = start_viewer()

    def take(self, key: str, payload: bytes) -> None:
        """Draw depth images; all else is drawn with the scene."""
        now = time.monotonic()
        if self._scene is None or key not in IMAGES or now - self._deep_at < DEPTH_S:
            return
        self._deep_at = now
        try:
            self._scene.draw_depth(key, payload)
        except MessageError as error:
            logger.debug("depth image skipped: %s", error)

    def draw(self, scene: SceneModel, changed: frozenset[Part]) -> None:
        """Draw what changed; everything for a viewer that has just been reached.

        Raises:
            ViewerError: The file cannot be written any more, or the viewer cannot be shown.
        """
        if self.closed:
            return
        now = time.monotonic()
        # A navigator that was started again has no time before its first frame.
        now_ns, before_ns = clock_ns(scene) or self._now_ns, self._now_ns
        self._now_ns = now_ns
        if begins_again(now_ns, before_ns):
            self._begin_again(scene)
            changed = _ALL
        if self._scene is None:
            if now - self._tried_at < _RETRY_S or not self._try_to_open(now):
                return
            changed = _ALL
        if self._scene is None:
            return
        if self._process is not None and self._process.poll() is not None:
            self._end(now)
            return
        self._scene.draw(scene, changed)
        if now - self._mapped_at >= MAP_S:
            self._mapped_at = now
            self._scene.draw_map(scene)
        if now - self._checked_at >= CHECK_S:
            self._checked_at = now
            self._check(now)

    def show_link(self, state: LinkState, text: str) -> None:
        """Write to the log whether the robot is heard."""
        if self._scene is not None:
            self._scene.write_line(text, "INFO" if state == "live" else "WARN")

    def close(self) -> None:
        """Send what is left and end.

        Raises:
            ViewerError: Not all of the file was written.
        """
        self._scene = None
        stream, self._stream = self._stream, None
        if stream is None:
            return
        if self._save is not None:
            try:
                stream.flush(timeout_sec=STALLED_S)
            except RuntimeError as error:
                raise incomplete(self._save, error) from error
        stream.disconnect()

    def _open_file(self, path: Path) -> None:
        check_file(path)
        stream = self._new_stream()
        try:
            stream.save(path, default_blueprint=blueprint())
        except RuntimeError as error:
            raise ViewerError(f"{path} cannot be written: {error}") from error
        self._save, self._stream = path, stream
        self._scene = RerunScene(stream, self._ceiling_m, self._past)

    def _begin_again(self, scene: SceneModel) -> None:
        """Begin another recording: one whose time steps back shows two sessions at once."""
        events = reversed(scene.events)
        self._past = next((e for e in events if begins_again(self._now_ns, e.stamp_ns)), None)
        if self._scene is None:
            return
        logger.info("the robot's clock began again: a new recording begins")
        self.close()
        if self._first_file is None:
            self._connect()
        else:
            self._open_file(next_file(self._first_file))
            logger.info("writing %s", self._save)

    def _try_to_open(self, now: float) -> bool:
        self._tried_at = now
        if not _answers(self._url):
            if self._process is not None and self._process.poll() is not None:
                raise ViewerError(_ENDED)
            if not self._told:
                self._told = True
                logger.info("no viewer at %s; waiting", self._url)
            return False
        self._connect()
        self._told = False
        self._checked_at = self._received_at = self._opened_at = now
        logger.info("drawing into the viewer at %s", self._url)
        return True

    def _connect(self) -> None:
        stream = self._stream = self._new_stream()
        stream.connect_grpc(self._url, default_blueprint=blueprint())
        self._scene = RerunScene(stream, self._ceiling_m, self._past)

    def _new_stream(self) -> rr.RecordingStream:
        stream = rr.RecordingStream(APPLICATION)
        stream.send_recording_name(f"{self._robot} {time.strftime('%H:%M:%S')}")
        return stream

    def _check(self, now: float) -> None:
        """Notice a viewer that is gone, or a full disk: the SDK neither raises nor tries again."""
        if self._stream is None:
            return
        if self._save is not None:
            check_space(self._save)
            return
        try:
            self._stream.flush(timeout_sec=_FLUSH_S)
        except RuntimeError as error:
            is_slow = "timed out" in str(error)
            if is_slow and now - self._received_at < STALLED_S:
                return
            logger.warning("the viewer at %s does not receive any more: %s", self._url, error)
            self.close()
            if self._process is not None:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    self._process.wait(_EXIT_S)
                self._end(now)
            return
        self._received_at = now

    def _end(self, now: float) -> None:
        """Note that the viewer that this program started is gone."""
        self.close()
        if now - self._opened_at < _SHORT_S:
            raise ViewerError(_ENDED)
        self.closed = True


def start_viewer() -> subprocess.Popen[bytes]:
    """Start Rerun's viewer, which stays when this program ends.

    The SDK's own function lets the viewer listen on every network; this one is for this machine.
    """
    command = [sys.executable, "-m", "rerun_cli", "--port", str(PORT), "--bind", "127.0.0.1"]
    environment = {**os.environ, "RERUN_APP_ONLY": "true"}
    return subprocess.Popen(  # noqa: S603 - our own arguments
        [*command, "--expect-data-soon"],
        env=environment,
        stdin=subprocess.DEVNULL,
        start_new_session=True,
    )


def _answers(url: str) -> bool:
    try:
        socket.create_connection(address_of(url), _CONNECT_S).close()
    except OSError:
        return False
    return True


class _StopOrClosed:
    """Ends with the process, or when the viewer that it started is closed."""

    def __init__(self, viewer: RerunViewer) -> None:
        self._viewer = viewer
        self._stop = ProcessStopSignal()

    def is_set(self) -> bool:
        """Return whether to stop."""
        return self._viewer.closed or self._stop.is_set()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the process is told to stop or the time has passed."""
        self._stop.wait(timeout)
        return self.is_set()


def run_rerun(config: RerunConfig) -> None:
    """Stream until SIGINT or SIGTERM, or until a viewer that was started is closed.

    Raises:
        ViewerError: The file cannot be written, or no viewer can be started.
    """
    robot = LiveRobot(config.connect, config.robot)
    viewer = RerunViewer(config)
    try:
        robot.run(viewer, _StopOrClosed(viewer))
    finally:
        viewer.close()
