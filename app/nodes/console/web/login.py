"""The login page and the logout."""

import asyncio
import hmac
import html
import logging
import math
import secrets
import time
from importlib import resources
from typing import Final
from urllib.parse import parse_qs

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import Route

from app.nodes.console.fleet.robot_paths import page_path, split_path
from app.nodes.console.web.access import LoginAccess, cookie_of, name_here
from app.nodes.console.web.accounts import Accounts
from app.nodes.console.web.browsers import Browser
from app.nodes.console.web.guard import login_path, read_body
from app.nodes.console.web.throttle import Throttle
from app.view.words import ENGLISH, Words

logger = logging.getLogger(__name__)

MAX_FORM: Final = 8192
FORM_S: Final = 5.0
"""Time limit for receiving a form."""
GUESSES: Final = 2
"""Passwords checked concurrently; each check takes 32 MiB."""
FORM_COOKIE: Final = "ippon-form"


class LoginPages:
    """Serves the login form and checks passwords."""

    def __init__(self, access: LoginAccess, accounts: Accounts, say: Words = ENGLISH) -> None:
        self._words = say
        self._access = access
        self._accounts = accounts
        self._throttle = Throttle()
        self._guesses = asyncio.Semaphore(GUESSES)
        page = (resources.files("web_assets") / "login.html").read_text(encoding="utf-8")
        self._page = say.page(page)

    def routes(self) -> list[Route]:
        """Return the routes of login and logout."""
        return [
            Route("/login", self._show),
            Route("/login", self._log_in, methods=["POST"]),
            Route("/logout", self._log_out, methods=["POST"]),
        ]

    async def _show(self, request: Request) -> Response:
        if request.scope.get("browser") is not None:
            return RedirectResponse(_page_after(request), status_code=303)
        return self._form(request, "", 200)

    async def _log_in(self, request: Request) -> Response:
        form = await _form_of(request)
        if form is None:
            return Response("a form of name and password was expected\n", status_code=400)
        expected = cookie_of(request.headers, FORM_COOKIE)
        if not expected or not hmac.compare_digest(expected.encode(), form["form"].encode()):
            return self._form(request, self._words("login.stale"), 403)
        address = request.client.host if request.client is not None else ""
        name = form["name"].strip()[:40]
        wait_s = self._throttle.wait_s(address, name, time.monotonic())
        if wait_s > 0.0:
            text = self._words("login.throttled", n=math.ceil(wait_s))
            answer = self._form(request, text, 429)
            answer.headers["Retry-After"] = str(math.ceil(wait_s))
            return answer
        # Counted before the check, so that concurrent guesses count as well.
        attempt = self._throttle.failed(address, name, time.monotonic())
        async with self._guesses:
            role = await asyncio.to_thread(self._accounts.verify, name, form["password"])
        if role is None:
            logger.warning("wrong password for %r from %s", name, address)
            return self._form(request, self._words("login.wrong"), 401)
        self._throttle.succeeded(attempt)
        logger.info("%s (%s) logged in from %s", name, role, address)
        granted = self._access.issue(name, role)
        answer = RedirectResponse(_page_after(request), status_code=303)
        answer.delete_cookie(name_here(FORM_COOKIE, request.headers))
        answer.set_cookie(
            name_here(granted.cookie, request.headers),
            granted.value,
            max_age=granted.max_age_s,
            secure=granted.is_secure,
            httponly=True,
            samesite="strict",
        )
        return answer

    async def _log_out(self, request: Request) -> Response:
        browser: Browser | None = request.scope.get("browser")
        if browser is not None:
            logger.info("%s logged out", browser.name)
            self._access.revoke(browser)
        answer = RedirectResponse("/login", status_code=303)
        answer.delete_cookie(name_here(self._access.cookie, request.headers))
        return answer

    def _form(self, request: Request, problem: str, status: int) -> Response:
        token = secrets.token_urlsafe(24)
        hidden = "" if problem else "hidden"
        to = login_path(_page_after(request)).removeprefix("/login")
        page = self._page.replace("{to}", html.escape(to)).replace("{form}", token)
        page = page.replace("{problem}", html.escape(problem))
        answer = Response(page.replace("{hidden}", hidden), status, media_type="text/html")
        answer.headers["Cache-Control"] = "no-store"
        answer.set_cookie(
            name_here(FORM_COOKIE, request.headers),
            token,
            max_age=3600,
            secure=self._access.is_secure,
            httponly=True,
            samesite="strict",
        )
        return answer


def _page_after(request: Request) -> str:
    """Return the page that the login was asked for: of a robot, or that of this console."""
    page = request.query_params.get("to", "/")
    return page if split_path(page) is not None and page_path(page) == "/" else "/"


async def _form_of(request: Request) -> dict[str, str] | None:
    """Read the three fields; None if they are missing, too long or too slow."""
    try:
        async with asyncio.timeout(FORM_S):
            body = await read_body(request, MAX_FORM)
        if body is None:
            return None
        fields = parse_qs(body.decode(), max_num_fields=8, strict_parsing=True)
    except (TimeoutError, ValueError):
        return None
    wanted = {name: fields.get(name, [""])[0] for name in ("form", "name", "password")}
    return wanted if wanted["name"] and wanted["password"] else None
