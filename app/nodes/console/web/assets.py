"""The files of the page, also compressed, with cache headers."""

import gzip
import hashlib
from collections.abc import Mapping
from importlib import resources
from typing import Final

from starlette.requests import Request
from starlette.responses import Response

from app.nodes.console.web.viser_server import client_page
from app.view.drawing.viser_client import unpack_client
from app.view.words import ENGLISH, Words

PREFIX: Final = "/assets/"
_NAMES: Final = (
    "shell.css", "shell.js", "view.css", "icon.svg",
    "answers.js", "base.js", "calls.js", "camera.css", "camera.js", "camera_worker.js",
    "draw_rate.js", "drive.css", "drive.js", "explain.js", "fold.js", "goals.js", "help.js",
    "hover.js", "introduction.css", "introduction.js", "lease.css", "lease.js", "login.css",
    "map_first.js", "notice.js", "one_layout.js", "panel_names.js", "panel_tabs.js", "plan.css",
    "plan.js", "plan_drawing.js", "plan_layout.js", "plan_pointer.js", "robots.js", "scene_area.js",
    "scene_frame.js", "side.css", "side.js", "stop.js", "text.js", "theme.js", "things.js",
    "waiting.js", "walk.css", "walk.js", "words.js",
)  # fmt: skip
_TYPES: Final = {
    "css": "text/css",
    "html": "text/html",
    "js": "text/javascript",
    "svg": "image/svg+xml",
    "wasm": "application/wasm",
}
_WORTH_IT: Final = 1024
"""Smaller files are not compressed."""
_ASK_AGAIN: Final = "no-cache"
_FOR_GOOD: Final = "private, max-age=31536000, immutable"


class Asset:
    """One file with its compressed form and headers."""

    def __init__(self, name: str, content: bytes, caching: str) -> None:
        self._type = _TYPES[name.rpartition(".")[2]]
        self._plain = content
        self._packed = gzip.compress(content, 3, mtime=0) if len(content) >= _WORTH_IT else None
        self._caching = caching

    def response(self, request: Request) -> Response:
        """Return the response, compressed if the browser accepts it."""
        headers = {"Cache-Control": self._caching, "Vary": "Accept-Encoding"}
        if self._packed is None or "gzip" not in request.headers.get("accept-encoding", ""):
            return Response(self._plain, media_type=self._type, headers=headers)
        headers["Content-Encoding"] = "gzip"
        return Response(self._packed, media_type=self._type, headers=headers)


class Assets:
    """The shell page, the scene's page inside it, and the files of both.

    Args:
        say: The words of the page.
    """

    def __init__(self, say: Words = ENGLISH) -> None:
        root = resources.files("web_assets")
        client = unpack_client(client_page().read_bytes(), PREFIX)
        # The browser fetches and compiles the scene's script while it loads the shell.
        page = say.page(root.joinpath("index.html").read_text("utf-8"))
        shell = _with_head(page.encode(), client.links)
        # Not deferred, because the scene's script uses it.
        ours = (
            f'<link rel="stylesheet" href="{PREFIX}view.css">'
            f'<script src="{PREFIX}map_first.js"></script>'
            f'<script src="{PREFIX}draw_rate.js"></script>'
            f'<script src="{PREFIX}one_layout.js"></script>'
        ).encode()
        self._shell = shell
        self.shell = self.shell_at("/")
        scene = client.page.replace(b'lang="en"', f'lang="{say.language}"'.encode(), 1)
        self.view = Asset("view.html", _with_head(scene, ours), _ASK_AGAIN)
        own = {name: (root / name).read_bytes() for name in _NAMES}
        parts = hashlib.sha256(shell + scene + b"".join(own.values()))
        self.edition: Final = parts.hexdigest()[:16]
        """Another one: a page that is open has other words or scripts, and must be loaded again."""
        self.files: Mapping[str, Asset] = {
            name: Asset(name, content, _ASK_AGAIN) for name, content in own.items()
        } | {name: Asset(name, content, _FOR_GOOD) for name, content in client.files.items()}

    def shell_at(self, base: str) -> Asset:
        """Return the shell page of the robot whose page is at a path."""
        page = self._shell.replace(b'src="/view/', f'src="{base}view/'.encode())
        page = page.replace(b'href="/api/', f'href="{base}api/'.encode())
        return Asset("index.html", page, "no-store")


def _with_head(page: bytes, more: bytes) -> bytes:
    head, mark, rest = page.partition(b"</head>")
    assert mark, "a page has a head"
    return head + more + mark + rest
