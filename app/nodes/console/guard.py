"""Headers and checks that every request to the console passes."""

from typing import Final
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LOOPBACK: Final = frozenset({"127.0.0.1", "localhost", "::1"})

SHELL_POLICY: Final = (
    "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; frame-src 'self'; frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'none'; object-src 'none'"
)
"""For our own pages: nothing inline, nothing from elsewhere."""

VIEW_POLICY: Final = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' blob:; "
    "worker-src 'self' blob:; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self' data: blob:; font-src 'self' data:; frame-ancestors 'self'; "
    "base-uri 'none'; form-action 'none'; object-src 'none'"
)
"""For viser's client, which is one inlined file: it may connect to this server only, so that
`?websocket=` cannot lead it to another, and it may not evaluate text as code."""

_COMMON: Final = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
}


def _authority(origin: str) -> str:
    """Return the host and port of an Origin header; "" when it is not one."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return ""


def host_name(host: str) -> str:
    """Return the name in a Host header, without the port; "" when it is not one."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


class Guard:
    """Refuses foreign hosts and origins, and sends the security headers with every answer.

    A page of another site may reach a loopback port through the operator's browser, by a host
    name that resolves to 127.0.0.1 or by a WebSocket; neither carries our Host and Origin.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request or WebSocket."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        problem = _problem(scope)
        if problem is not None:
            await _refuse(problem, scope, receive, send)
            return
        policy = VIEW_POLICY if scope["path"].rstrip("/") == "/view" else SHELL_POLICY

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers["Content-Security-Policy"] = policy
                for name, value in _COMMON.items():
                    headers[name] = value
            await send(message)

        await self._app(scope, receive, send_with_headers)


def _problem(scope: Scope) -> str | None:
    headers = Headers(scope=scope)
    host = headers.get("host", "")
    if host_name(host) not in LOOPBACK:
        return f"this console answers to 127.0.0.1 and localhost, not to {host[:80]!r}"
    origin = headers.get("origin")
    needs_origin = scope["type"] == "websocket" or scope["method"] not in {"GET", "HEAD"}
    if origin is None:
        return "requests that change something must name their origin" if needs_origin else None
    if _authority(origin) != host:
        return f"requests from {origin[:80]!r} are refused"
    return None


async def _refuse(problem: str, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": problem[:120]})
        return
    await PlainTextResponse(problem + "\n", status_code=403)(scope, receive, send)
