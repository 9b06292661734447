"""The console process."""

import logging
import os
import socket
import ssl
from functools import partial

import uvicorn
from starlette.types import ASGIApp

from app.links.network.session import LinkError, check_endpoint
from app.nodes.console.calls.call_log import CallLog
from app.nodes.console.calls.webhook import Webhook, place_of, read_secret
from app.nodes.console.config import (
    LOOPBACK,
    PASSWORD_VARIABLE,
    ConsoleConfig,
    ConsoleError,
)
from app.nodes.console.fleet.robot_console import RobotConsole
from app.nodes.console.fleet.robot_consoles import RobotConsoles
from app.nodes.console.web.access import LoginAccess, OpenAccess
from app.nodes.console.web.accounts import AccountError, Accounts, load_accounts, one_account
from app.nodes.console.web.assets import Assets
from app.nodes.console.web.connections import BoundedProtocol, TlsProtocol
from app.nodes.console.web.gateway import Gateway
from app.nodes.console.web.guard import Hosts
from app.nodes.console.web.login import LoginPages
from app.nodes.console.web.viser_proxy import MAX_CLIENT_MESSAGE
from app.view.drawing.viser_client import PackingError
from app.view.words import Words

logger = logging.getLogger(__name__)


def run_console(config: ConsoleConfig, *, is_awaited: bool = False) -> None:
    """Serve the page until SIGINT or SIGTERM.

    Args:
        config: Of the page.
        is_awaited: The command that started this process starts the navigator as well.

    Raises:
        ConsoleError: The endpoint is none, the port is taken, or a part of the console has failed.
        LanguageError: There are no words in the language.
    """
    _check_endpoint(config)
    say = Words(config.language)
    accounts, tls = _accounts(config), _tls(config)
    calls, webhook = _calls(config, say)
    listener = listen_on(config)
    failures: list[Exception] = []

    def fail(error: Exception) -> None:
        failures.append(error)
        server.should_exit = True

    console = RobotConsole(config.connect, config.robot, fail, calls, say, is_awaited=is_awaited)
    try:
        gateway = _gateway(config, console, accounts, say)
    except PackingError as error:
        console.viser_server.close()
        listener.close()
        raise ConsoleError(f"{error}; install the viser that constraints.txt names") from error
    robots = RobotConsoles(config.connect, config.robot, gateway, say)
    app = gateway.app()
    app.router.routes += robots.routes()
    server = uvicorn.Server(server_settings(app, tls=tls, proxy=config.tls_proxy))
    console.start()
    robots.start()
    if webhook is not None:
        webhook.start()
    scheme = "http" if tls is None else "https"
    # Who reads the address may open it at once: the server listens a little later.
    listener.listen()
    logger.info("console at %s://%s:%d", scheme, *listener.getsockname()[:2])
    if config.host not in LOOPBACK and not config.is_encrypted:
        logger.warning(
            "passwords are sent unencrypted: give --tls-cert and --tls-key, or put a TLS proxy "
            "in front of the console and name it with --tls-proxy"
        )
    try:
        server.run(sockets=[listener])
    finally:
        robots.close()
        console.close()
        if webhook is not None:
            webhook.close()
        listener.close()
    if failures:
        raise ConsoleError(
            f"the console has ended because a part of it failed ({failures[0]!r}); its log says "
            "where. The robot continues on its own: restart the console with ippon console"
        ) from failures[0]


def _check_endpoint(config: ConsoleConfig) -> None:
    try:
        check_endpoint(config.connect)
    except LinkError as error:
        raise ConsoleError(str(error)) from error


def _calls(config: ConsoleConfig, say: Words) -> tuple[CallLog, Webhook | None]:
    """Return the log of calls, and the webhook that they are sent to.

    Raises:
        ConsoleError: There is an address, and no secret to sign with.
    """
    calls = CallLog(say)
    if config.notify is None:
        return calls, None
    secret = read_secret(os.environ, config.notify_secret)
    webhook = Webhook(config.notify, secret, config.robot, calls.note, say=say)
    calls.send_to(webhook.send, place_of(config.notify))
    return calls, webhook


def _gateway(
    config: ConsoleConfig, console: RobotConsole, accounts: Accounts | None, say: Words
) -> Gateway:
    hosts = Hosts(config.host, config.names)
    assets = Assets(say)
    parts = (console.viser_server, console.state_feed, console.link)
    if accounts is None:
        return Gateway(*parts, OpenAccess(console.browsers), hosts, assets=assets)
    access = LoginAccess(console.browsers, is_secure=config.is_encrypted)
    return Gateway(*parts, access, hosts, LoginPages(access, accounts, say), assets)


def _accounts(config: ConsoleConfig) -> Accounts | None:
    try:
        if config.users is not None:
            return load_accounts(config.users)
        password = os.environ.get(PASSWORD_VARIABLE, "")
        return one_account("operator", password, "supervisor") if password else None
    except AccountError as error:
        raise ConsoleError(str(error)) from error


def _tls(config: ConsoleConfig) -> ssl.SSLContext | None:
    certificate, key = config.tls_cert, config.tls_key
    if certificate is None or key is None:
        return None
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        # A key with a passphrase would prompt on a terminal that may not exist.
        context.load_cert_chain(certificate, key, password=lambda: "")
    except (OSError, ssl.SSLError, ValueError) as error:
        raise ConsoleError(
            f"TLS cannot use the certificate {certificate} with the key {key} ({error}); both "
            f"must be PEM files that belong together, the key without a passphrase"
        ) from error
    return context


def listen_on(config: ConsoleConfig) -> socket.socket:
    """Return a socket that listens where the page is served.

    Raises:
        ConsoleError: The port is taken.
    """
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


def server_settings(
    app: ASGIApp, port: int = 0, tls: ssl.SSLContext | None = None, proxy: str | None = None
) -> uvicorn.Config:
    """Return the server's settings for an application; the socket gives the address."""
    protocol = BoundedProtocol if tls is None else partial(TlsProtocol, tls)
    return uvicorn.Config(
        app,
        port=port,
        log_level="warning",
        access_log=False,
        server_header=False,
        http=protocol,  # pyright: ignore[reportArgumentType] - called like the type
        proxy_headers=proxy is not None,
        forwarded_allow_ips=proxy,
        timeout_keep_alive=20,
        ws="websockets-sansio",
        ws_max_size=MAX_CLIENT_MESSAGE,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=1,
    )
