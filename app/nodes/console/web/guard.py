"""Headers and checks that every request to the console passes."""

import ipaddress
import socket
from collections.abc import Iterable
from typing import Final
from urllib.parse import quote, urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.nodes.console.config import LOOPBACK
from app.nodes.console.fleet.robot_paths import page_path
from app.nodes.console.web.access import COOKIE, Access, OpenAccess, name_here
from app.nodes.console.web.browsers import Browser

SHELL_POLICY: Final = (
    "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; frame-src 'self'; frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'self'; object-src 'none'"
)
"""Policy of the console's pages: no inline code, nothing from other servers."""

VIEW_POLICY: Final = (
    "default-src 'self'; script-src 'self' 'wasm-unsafe-eval' blob:; "
    "worker-src 'self' blob:; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self' data: blob:; font-src 'self' data:; frame-ancestors 'self'; "
    "base-uri 'none'; form-action 'none'; object-src 'none'"
)
"""Policy of viser's client: it may connect to this server only, whatever `?websocket=` says; it may
not evaluate text as code, and runs no inline script."""

_COMMON: Final = {
    "X-Content-Type-Options": "nosniff",
    # Not "no-referrer": with it Chromium sends "Origin: null" with a form.
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
}
_YEAR_S: Final = 31_536_000
PUBLIC: Final = frozenset({"/login", "/assets/login.css", "/assets/icon.svg"})
"""Paths that are served before a login."""


class Hosts:
    """Host names that the console answers to.

    A page of another site may reach the console through the operator's browser by a host name that
    resolves to this address (DNS rebinding); numeric addresses cannot be used for this.
    """

    def __init__(self, host: str, names: Iterable[str] = ()) -> None:
        self._loopback_only = host in LOOPBACK
        own = socket.gethostname().lower()
        self._names = LOOPBACK | {name.lower() for name in names}
        if not self._loopback_only:
            self._names |= {own, f"{own}.local", host.lower()}

    def allow(self, host: str) -> bool:
        """Return whether a Host header names this console."""
        name = host_name(host)
        return name in self._names or (not self._loopback_only and _is_address(name))

    def __str__(self) -> str:
        """Return the names for an error text."""
        if self._loopback_only:
            return "127.0.0.1 and localhost"
        return f"{', '.join(sorted(self._names))} and its addresses"


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _authority(origin: str) -> str:
    """Return the host and port of an Origin header; "" if it is invalid."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return ""


def host_name(host: str) -> str:
    """Return the name in a Host header, without the port; "" if it is invalid."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


class Guard:
    """Refuses foreign hosts, foreign origins and browsers without access; adds security headers.

    A page of another site may reach a loopback port through the operator's browser, by a host name
    that resolves to 127.0.0.1 or by a WebSocket; neither has the console's Host and Origin.
    """

    def __init__(self, app: ASGIApp, access: Access, hosts: Hosts) -> None:
        self._app = app
        self._access = access
        self._hosts = hosts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request or WebSocket."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        problem = self._problem(scope, headers)
        if problem is not None:
            await refuse(problem, 403, scope, receive, send)
            return
        send = _with_headers(scope, send)
        browser = self._access.browser_of(headers)
        if browser is None and isinstance(self._access, OpenAccess):
            if scope["type"] == "websocket" or page_path(scope["path"]) == "/":
                browser = self._access.new_browser()
                send = _with_cookie(browser, headers, send)
            else:
                browser = self._access.one_request_browser()
        scope["browser"] = browser
        if browser is None and scope["path"] not in PUBLIC:
            await _ask_to_log_in(scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _problem(self, scope: Scope, headers: Headers) -> str | None:
        host = headers.get("host", "")
        if not self._hosts.allow(host):
            return f"this console answers to {self._hosts}, not to {host[:80]!r}"
        origin = headers.get("origin")
        needs_origin = scope["type"] == "websocket" or scope["method"] not in {"GET", "HEAD"}
        if origin is None:
            return "requests that change state must have an Origin header" if needs_origin else None
        if _authority(origin) != host:
            return f"requests from {origin[:80]!r} are refused"
        return None


def _with_headers(scope: Scope, send: Send) -> Send:
    policy = VIEW_POLICY if page_path(scope["path"]).rstrip("/") == "/view" else SHELL_POLICY
    is_secure = scope.get("scheme") in {"https", "wss"}

    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers["Content-Security-Policy"] = policy
            for name, value in _COMMON.items():
                headers[name] = value
            if is_secure:
                headers["Strict-Transport-Security"] = f"max-age={_YEAR_S}"
        await send(message)

    return send_with_headers


async def read_body(request: Request, most: int) -> bytes | None:
    """Return the body of a request; None if it has more than `most` bytes."""
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > most:
            return None
    return body


def _with_cookie(browser: Browser, headers: Headers, send: Send) -> Send:
    cookie = f"{name_here(COOKIE, headers)}={browser.session}; HttpOnly; Path=/; SameSite=Strict"

    async def send_with_cookie(message: Message) -> None:
        if message["type"] == "http.response.start":
            MutableHeaders(scope=message).append("Set-Cookie", cookie)
        await send(message)

    return send_with_cookie


def login_path(page: str) -> str:
    """Return the address at which to log in for a page, which is shown after it."""
    return "/login" if page == "/" else f"/login?to={quote(page)}"


async def _ask_to_log_in(scope: Scope, receive: Receive, send: Send) -> None:
    is_page = scope["type"] == "http" and page_path(scope["path"]) == "/"
    if is_page and scope["method"] == "GET":
        await RedirectResponse(login_path(scope["path"]), status_code=303)(scope, receive, send)
        return
    await refuse("log in first", 401, scope, receive, send)


async def refuse(problem: str, status: int, scope: Scope, receive: Receive, send: Send) -> None:
    """Answer a request with an error, or close a WebSocket that is not accepted yet."""
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": problem[:120]})
        return
    await PlainTextResponse(problem + "\n", status_code=status)(scope, receive, send)
