"""Configuration of the console."""

import ipaddress
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from app.errors import UsageError
from app.messages import keys

LOOPBACK: Final = frozenset({"127.0.0.1", "localhost", "::1"})
PASSWORD_VARIABLE: Final = "IPPON_CONSOLE_PASSWORD"  # noqa: S105 (a name, not a password)
"""Password of the single user "operator", used when there is no file of users."""


SECRET_VARIABLE: Final = "IPPON_NOTIFY_SECRET"  # noqa: S105 (a name, not a secret)
"""Key that signs calls to the webhook, used when there is no file of it."""


class ConsoleError(UsageError):
    """The console cannot start or continue; the text says how to fix it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConsoleConfig:
    """Endpoint of the navigator, and address, port and users of the page."""

    connect: str = "tcp/127.0.0.1:7447"
    """zenoh endpoint of the navigator."""
    robot: str = "ippon"
    """Key prefix of the robot."""
    host: str = "127.0.0.1"
    """Address that the page is served on; any except loopback requires a login."""
    port: int = 8080
    """Port of the page; 0 selects any free port."""
    users: Path | None = None
    """File of users, made by `ippon user`; with one, every browser must log in."""
    tls_cert: Path | None = None
    """PEM file with the TLS certificate and its intermediate certificates."""
    tls_key: Path | None = None
    """PEM file with the private key of the certificate."""
    tls_proxy: str | None = None
    """Address of a TLS proxy in front of the console, which is believed who connects to it
    (X-Forwarded-For): without it all browsers count as one for wrong passwords."""
    names: tuple[str, ...] = ()
    """Further host names that the console answers to, for example robot.example.org."""
    language: str = "en"
    """Language of page and panels, for all browsers: en (English) or de (German)."""
    notify: str | None = None
    """Address (http or https) that is told when a person is needed: a find, a robot that is stuck
    or lost, a full disk. It works without a browser."""
    notify_secret: Path | None = None
    """File with the secret that signs what is sent; by default the variable IPPON_NOTIFY_SECRET."""

    def __post_init__(self) -> None:
        """Reject settings that would serve the page to everyone, and invalid values."""
        if self.tls_proxy is not None:
            _check_proxy(self.tls_proxy)
        if (self.host not in LOOPBACK or self.tls_proxy is not None) and not self.has_login:
            where = f"on {self.host!r}" if self.tls_proxy is None else "behind a TLS proxy"
            raise ConsoleError(
                f"{where} the console requires a login: make a file of users with `ippon "
                f"user NAME --users FILE` and start it with --users FILE, or set "
                f"{PASSWORD_VARIABLE}. Without a login, from another machine: ssh -L "
                f"{self.port}:127.0.0.1:{self.port}"
            )
        if (self.tls_cert is None) != (self.tls_key is None):
            raise ConsoleError("TLS needs both a certificate and its key: --tls-cert and --tls-key")
        if not 0 <= self.port <= 65535:
            raise ConsoleError(f"a port lies in 0 to 65535; got {self.port}")
        if self.notify is not None:
            _check_address(self.notify)
        elif self.notify_secret is not None:
            raise ConsoleError("--notify-secret signs what --notify sends: name an address, too")
        try:
            keys.check_prefix(self.robot)
        except ValueError as error:
            raise ConsoleError(str(error)) from error

    @property
    def has_login(self) -> bool:
        """Whether a login is required."""
        return self.users is not None or bool(os.environ.get(PASSWORD_VARIABLE))

    @property
    def is_encrypted(self) -> bool:
        """Whether browsers connect over TLS, to the console or to a proxy."""
        return self.tls_cert is not None or self.tls_proxy is not None


def _check_proxy(address: str) -> None:
    try:
        ipaddress.ip_address(address)
    except ValueError as error:
        raise ConsoleError(
            f"--tls-proxy is the numeric address from which the proxy connects, such as 127.0.0.1; "
            f"got {address!r}"
        ) from error


def _check_address(url: str) -> None:
    try:
        parts = urlsplit(url)
        _ = parts.port
    except ValueError:
        parts = urlsplit("")
    if parts.scheme not in ("http", "https") or not parts.hostname:
        raise ConsoleError(
            "--notify is an address such as https://example.org/robot; what was given has no "
            "scheme http or https, or no host"
        )
    if parts.username is not None or parts.password is not None:
        raise ConsoleError(
            "--notify takes no user and password: what is sent is signed with the secret instead"
        )
