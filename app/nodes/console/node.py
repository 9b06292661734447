"""The console process."""

import logging
import socket
from dataclasses import dataclass

import uvicorn
from starlette.types import ASGIApp

from app.nodes.console.backend import start_viser
from app.nodes.console.bulletin import Bulletin
from app.nodes.console.conductor import EVERY, Conductor
from app.nodes.console.gateway import Gateway
from app.nodes.console.guard import LOOPBACK
from app.nodes.console.inbox import Inbox
from app.nodes.console.link import NavigatorLink
from app.nodes.console.viser_proxy import MAX_CLIENT_MESSAGE
from app.view.reader import SceneReader
from app.view.scene_model import SceneModel

logger = logging.getLogger(__name__)


class ConsoleError(Exception):
    """The console cannot start; the text says what would do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConsoleConfig:
    """Where the navigator is, and where the page is served."""

    connect: str = "tcp/127.0.0.1:7447"
    """zenoh endpoint of the navigator."""
    robot: str = "ippon"
    """Key prefix of the robot."""
    host: str = "127.0.0.1"
    """Address that the page is served on; loopback only, until there is a login."""
    port: int = 8080
    """Port of the page; 0 takes any free one."""

    def __post_init__(self) -> None:
        """Reject what would serve the robot to everyone."""
        if self.host not in LOOPBACK:
            raise ConsoleError(
                f"the console listens on 127.0.0.1 only, because it has no login yet; got "
                f"{self.host!r}. From another machine: ssh -L {self.port}:127.0.0.1:{self.port}"
            )
        if not 0 <= self.port <= 65535:
            raise ConsoleError(f"a port lies in 0 to 65535; got {self.port}")
        if not self.robot or any(c in self.robot for c in "*$?# "):
            raise ConsoleError(f"a robot's key prefix has no wildcard or space; got {self.robot!r}")


def run_console(config: ConsoleConfig) -> None:
    """Serve the page until SIGINT or SIGTERM.

    Raises:
        ConsoleError: The port is taken, or a part of the console has failed.
    """
    listener = _listen(config)
    inbox, bulletin = Inbox(EVERY), Bulletin()
    topics = SceneReader(SceneModel()).keys
    failures: list[Exception] = []

    def fail(error: Exception) -> None:
        failures.append(error)
        server.should_exit = True

    link = NavigatorLink(config.connect, config.robot, topics, inbox, fail)
    backend = start_viser()
    server = uvicorn.Server(server_settings(Gateway(backend, bulletin, link).app()))
    conductor = Conductor(backend, link, inbox, bulletin, fail)
    link.start()
    conductor.start()
    logger.info("console at http://%s:%d", *listener.getsockname()[:2])
    try:
        server.run(sockets=[listener])
    finally:
        conductor.stop()
        link.close()
        backend.close()
        listener.close()
    if failures:
        raise ConsoleError(
            f"the console has ended because a part of it failed ({failures[0]!r}); its log says "
            "where. The robot goes on by itself: start the console again with ippon console"
        ) from failures[0]


def _listen(config: ConsoleConfig) -> socket.socket:
    family = socket.AF_INET6 if ":" in config.host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((config.host, config.port))
    except OSError as error:
        listener.close()
        raise ConsoleError(
            f"port {config.port} on {config.host} cannot be used ({error.strerror}); another "
            "console may be running: choose another with --port, or --port 0 for any free one"
        ) from error
    return listener


def server_settings(app: ASGIApp, port: int = 0) -> uvicorn.Config:
    """Return how the gateway's application is served; the address is that of the given socket."""
    return uvicorn.Config(
        app,
        port=port,
        log_level="warning",
        access_log=False,
        server_header=False,
        ws="websockets-sansio",
        ws_max_size=MAX_CLIENT_MESSAGE,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=1,
    )
