"""viser behind the gateway: on loopback, at any free port, with a secret header."""

import contextlib
import io
import secrets
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import viser
from websockets import Headers

from app.nodes.console.web.browsers import Browser, Browsers, set_acting_browser
from app.view.drawing.camera_follow import FOV_RAD, START
from app.view.drawing.viser_private import (
    SECRET_HEADER,
    disable_sharing,
    propagate_context,
    push_from_any_thread,
    require_secret,
)

BROWSER_HEADER: Final = "X-Ippon-Browser"


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopbackViserServer:
    """A running viser server and how to reach it."""

    server: viser.ViserServer
    secret: str
    """Value of the secret header; the server refuses requests without it."""

    @property
    def url(self) -> str:
        """Address of its WebSocket."""
        return f"ws://127.0.0.1:{self.server.get_port()}"

    def headers_of(self, browser: Browser) -> dict[str, str]:
        """Headers of a request: the secret and the browser."""
        return {SECRET_HEADER: self.secret, BROWSER_HEADER: browser.session}

    def close(self) -> None:
        """Stop the server."""
        with contextlib.redirect_stdout(io.StringIO()):
            self.server.stop()


def start_viser(browsers: Browsers) -> LoopbackViserServer:
    """Start viser on a free loopback port, without output and without public tunnels.

    Its callbacks run with the browser that triggered them as `acting_browser()`.
    """
    secret = secrets.token_urlsafe(32)

    def admit(headers: Headers) -> None:
        set_acting_browser(browsers.find(headers.get(BROWSER_HEADER, "")))

    push_from_any_thread()
    with require_secret(secret, admit), contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=0, label="IPPON", verbose=False)
    disable_sharing(server)
    propagate_context(server)
    server.initial_camera.fov = FOV_RAD
    server.initial_camera.position = START.position
    server.initial_camera.look_at = START.look_at
    server.gui.configure_theme(
        dark_mode=True,
        show_logo=False,
        show_share_button=False,
        brand_color=(86, 180, 233),
    )
    return LoopbackViserServer(server=server, secret=secret)


def client_page() -> Path:
    """Return viser's client as a single HTML file."""
    return Path(viser.__file__).parent / "client" / "build" / "index.html"
