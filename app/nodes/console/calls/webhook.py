"""Sends calls to a webhook: signed, retried, and never waited for."""

import asyncio
import hashlib
import hmac
import json
import logging
import secrets
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

import httpx2

from app.nodes.console.calls.call import Call
from app.nodes.console.config import LOOPBACK, SECRET_VARIABLE, ConsoleError
from app.view.words import ENGLISH, Words

logger = logging.getLogger(__name__)

SIGNATURE: Final = "X-Ippon-Signature-256"
"""Header with "sha256=" and the HMAC of the body in hexadecimal digits."""
MAX_WAITING: Final = 32
_AGAIN: Final = frozenset({408, 425, 429})
"""Answers after which another attempt may succeed, besides those from 500 on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """How long and how often a call is tried."""

    timeout_s: float = 5.0
    """Limit of one attempt, from the first byte sent to the status of the answer."""
    pauses_s: tuple[float, ...] = (2.0, 8.0, 30.0)
    """Pause before each further attempt."""


class Webhook:
    """Sends calls in a thread of its own.

    Args:
        url: Where calls are posted.
        secret: Key of the signature.
        robot: Key prefix of the robot, part of each message.
        note: Told the number of a call and what became of it.
        patience: How long and how often a call is tried.
        say: The words of what became of a call.
    """

    def __init__(
        self,
        url: str,
        secret: bytes,
        robot: str,
        note: Callable[[int, str], None],
        patience: Patience | None = None,
        say: Words = ENGLISH,
    ) -> None:
        """Prepare the client.

        Raises:
            ConsoleError: The proxy that the environment names cannot be used.
        """
        self._words = say
        self._url, self._secret, self._robot, self._note = url, secret, robot, note
        self._patience = patience or Patience()
        # A proxy from the environment must not be used for a server on this machine.
        is_local = urlsplit(url).hostname in LOOPBACK
        try:
            self._client = httpx2.AsyncClient(
                trust_env=not is_local, timeout=self._patience.timeout_s
            )
        except (ImportError, ValueError) as error:
            raise ConsoleError(
                f"--notify: the proxy of the environment cannot be used: {error}"
            ) from error
        self._loop = asyncio.new_event_loop()
        self._tasks: set[asyncio.Task[None]] = set()
        self._run = secrets.token_hex(8)
        self._thread = threading.Thread(target=self._serve, name="webhook", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def close(self) -> None:
        """Give up what has not arrived, and end the thread."""
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(timeout=5.0)

    def send(self, call: Call) -> None:
        """Send a call, without waiting; safe from any thread."""
        self._loop.call_soon_threadsafe(self._begin, call)

    def _serve(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_forever()
        if self._tasks:
            logger.warning("%d calls had not arrived at the webhook", len(self._tasks))
        for task in self._tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*self._tasks, return_exceptions=True))
        self._loop.run_until_complete(self._client.aclose())
        self._loop.close()

    def _begin(self, call: Call) -> None:
        if len(self._tasks) >= MAX_WAITING:
            self._tell(call, self._words("webhook.unsent", n=MAX_WAITING), arrived=False)
            return
        task = self._loop.create_task(self._deliver(call))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _deliver(self, call: Call) -> None:
        body = body_of(call, self._robot, self._run)
        headers = {
            "Content-Type": "application/json",
            "User-Agent": "ippon",
            SIGNATURE: sign(body, self._secret),
        }
        tried, problem = 0, ""
        for pause_s in (0.0, *self._patience.pauses_s):
            await asyncio.sleep(pause_s)
            tried += 1
            problem, again = await self._attempt(body, headers)
            if not problem:
                self._tell(call, self._words.count("webhook.arrived", tried), arrived=True)
                return
            if not again or tried > len(self._patience.pauses_s):
                break
            self._note(call.number, self._words("webhook.again", problem=problem))
        failed = self._words.count("webhook.failed", tried, problem=problem)
        self._tell(call, failed, arrived=False)

    async def _attempt(self, body: bytes, headers: Mapping[str, str]) -> tuple[str, bool]:
        """Return why an attempt failed, empty if it did not, and whether another one may help."""
        limit_s = self._patience.timeout_s
        try:
            # The client's own timeout starts anew with each byte that comes.
            async with (
                asyncio.timeout(limit_s),
                self._client.stream("POST", self._url, content=body, headers=headers) as answer,
            ):
                status = answer.status_code
        except (TimeoutError, httpx2.TimeoutException):
            return self._words("webhook.late", n=f"{limit_s:g}"), True
        except httpx2.HTTPError as error:
            return str(error) or type(error).__name__, True
        except Exception as error:  # People are told whatever it is; its text may hold the path.
            logger.debug("an attempt at the webhook", exc_info=True)
            return type(error).__name__, True
        if 200 <= status < 300:
            return "", False
        return self._words("webhook.answer", status=status), status >= 500 or status in _AGAIN

    def _tell(self, call: Call, what: str, *, arrived: bool) -> None:
        self._note(call.number, what)
        level = logging.INFO if arrived else logging.ERROR
        logger.log(level, "call %d (%s) at the webhook: %s", call.number, call.title, what)


def body_of(call: Call, robot: str, run: str) -> bytes:
    """Return the body of a message about a call.

    Args:
        call: The call.
        robot: Key prefix of the robot.
        run: Distinguishes the runs of a console, whose calls are numbered from 1.
    """
    one = call.occasion
    message: dict[str, Any] = {
        "id": f"{run}-{call.number}",
        "time": datetime.fromtimestamp(call.wall_ns / 1e9, tz=UTC).isoformat(),
        "robot": robot,
        "kind": one.kind,
        "title": call.title,
        "text": one.text,
        "count": call.count,
        "goal_id": one.goal_id,
        "object": one.object,
        "position_world": one.position_world,
    }
    return json.dumps(message, ensure_ascii=False).encode()


def sign(body: bytes, secret: bytes) -> str:
    """Return the signature of a body: HMAC with SHA-256."""
    return f"sha256={hmac.new(secret, body, hashlib.sha256).hexdigest()}"


def read_secret(environment: Mapping[str, str], file: Path | None) -> bytes:
    """Return the key of the signature, from a file or else the environment.

    Raises:
        ConsoleError: There is none, or the file cannot be read or holds more than one word.
    """
    if file is None:
        text = environment.get(SECRET_VARIABLE, "").strip()
        if not text:
            raise ConsoleError(
                f"--notify signs what it sends: set {SECRET_VARIABLE}, or name a file with the "
                "secret by --notify-secret FILE"
            )
        return text.encode()
    try:
        text = file.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise ConsoleError(f"no secret in {file}: {type(error).__name__}") from None
    if len(text.split()) != 1:
        raise ConsoleError(f"{file} must hold the secret alone, on one line")
    return text.encode()


def place_of(url: str) -> str:
    """Return the part of an address that may be shown: a path may hold a secret."""
    parts = urlsplit(url)
    port = "" if parts.port is None else f":{parts.port}"
    return f"{parts.scheme}://{parts.hostname}{port}"
