"""Access to the console: open on this machine, or by login."""

import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol
from urllib.parse import urlsplit

import msgspec
from itsdangerous import BadData, URLSafeSerializer
from starlette.datastructures import Headers
from starlette.requests import cookie_parser

from app.messages.lease import SessionText
from app.nodes.console.web.browsers import Browser, Browsers, Role, new_session

COOKIE: Final = "ippon"
SECURE_COOKIE: Final = "__Host-ippon"
LOGIN_S: Final = 12 * 3600.0

Clock = Callable[[], float]


class Access(Protocol):
    """Identifies the browser of a request."""

    has_login: bool

    def browser_of(self, headers: Headers) -> Browser | None:
        """Return the browser of the request's cookie, None without a valid one."""
        ...


class OpenAccess:
    """Access for browsers of this machine: no login, each identified by a cookie."""

    has_login = False

    def __init__(self, browsers: Browsers) -> None:
        self._browsers = browsers

    def browser_of(self, headers: Headers) -> Browser | None:
        """Return the browser that holds this cookie, None without a valid one."""
        try:
            session = msgspec.convert(cookie_of(headers, COOKIE), SessionText)
        except msgspec.ValidationError:
            return None
        return self._browsers.get_or_add(session)

    def new_browser(self) -> Browser:
        """Return a new browser for a client without a cookie."""
        return self._browsers.get_or_add(new_session())

    def one_request_browser(self) -> Browser:
        """Return a browser for a single request, which is not remembered."""
        return Browser(new_session(), "a program on this machine", "operator")


class _Pass(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    session: str
    name: str
    role: Role
    expires_s: float


@dataclass(frozen=True, slots=True)
class IssuedPass:
    """Cookie of a login."""

    cookie: str
    value: str
    max_age_s: int
    is_secure: bool


class LoginAccess:
    """Access by login, with signed cookies that expire and that a logout revokes."""

    has_login = True

    def __init__(
        self, browsers: Browsers, *, is_secure: bool, clock: Clock = time.monotonic
    ) -> None:
        self._browsers = browsers
        self._clock = clock
        self.is_secure = is_secure
        """Whether the pages are served over TLS."""
        # A new key at every start: a restarted console requires a new login, so that a monotonic
        # clock will do; a robot's clock is set when it finds a network.
        self._signer = URLSafeSerializer(secrets.token_bytes(32), salt="ippon console login")
        self._revoked: dict[str, float] = {}

    @property
    def cookie(self) -> str:
        """Name of the cookie; over TLS a name that other hosts and unencrypted pages cannot set."""
        return SECURE_COOKIE if self.is_secure else COOKIE

    def issue(self, name: str, role: Role) -> IssuedPass:
        """Issue a cookie to a user with the right password."""
        granted = _Pass(new_session(), name, role, self._clock() + LOGIN_S)
        value = self._signer.dumps(msgspec.to_builtins(granted))
        assert isinstance(value, str)
        return IssuedPass(self.cookie, value, round(LOGIN_S), self.is_secure)

    def browser_of(self, headers: Headers) -> Browser | None:
        """Return the browser of the login's cookie, None without a valid one."""
        granted = self._read(cookie_of(headers, self.cookie))
        if granted is None:
            return None
        browser = self._browsers.get_or_add(granted.session, granted.name, granted.role)
        browser.expires_s = granted.expires_s
        return browser

    def revoke(self, browser: Browser) -> None:
        """Revoke a browser's login and end its connections."""
        now = self._clock()
        self._revoked = {s: until for s, until in self._revoked.items() if until > now}
        self._revoked[browser.session] = browser.expires_s or now + LOGIN_S
        browser.disconnect()

    def _read(self, value: str) -> _Pass | None:
        try:
            granted = msgspec.convert(self._signer.loads(value), _Pass)
        except (BadData, msgspec.ValidationError):
            return None
        valid = granted.expires_s > self._clock() and granted.session not in self._revoked
        return granted if valid else None


def cookie_of(headers: Headers, name: str) -> str:
    """Return the value of a request's cookie, "" if it is missing."""
    return cookie_parser(headers.get("cookie", "")).get(name_here(name, headers), "")


def name_here(cookie: str, headers: Headers) -> str:
    """Return a cookie's name at the port of a request: browsers share cookies of all ports."""
    try:
        port = urlsplit(f"//{headers.get('host', '')}").port
    except ValueError:
        port = None
    return cookie if port is None else f"{cookie}-{port}"
