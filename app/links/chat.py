"""One question to an OpenAI-compatible chat endpoint: OpenAI, Ollama, vLLM, llama.cpp server."""

import ipaddress
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, cast

import httpx

ResponseForm = Literal["schema", "json", "text"]

MAX_REPLY_BYTES = 1_000_000
_FORMS: tuple[ResponseForm, ...] = ("schema", "json", "text")
_REFUSED_PARAMETER = frozenset({400, 415, 422, 501})
_PERMANENT = frozenset({401, 402, 403, 404, 405, 410})


@dataclass(frozen=True, slots=True, kw_only=True)
class ChatConfig:
    """Where the language model is and how it is asked."""

    base_url: str
    """Address up to and without `/chat/completions`, such as http://127.0.0.1:11434/v1."""
    model: str
    """Name of the model as the endpoint knows it."""
    api_key: str | None = field(default=None, repr=False)
    """Sent as bearer token; never logged, cached or recorded."""
    timeout_s: float = 30.0
    """The longest that one request may take in all; longer answers are given up."""
    temperature: float | None = 0.0
    """0 gives the likeliest answer; None leaves it to the endpoint."""

    def __post_init__(self) -> None:
        """Refuse addresses that cannot be asked."""
        url = httpx.URL(self.base_url)
        if url.scheme not in ("http", "https") or not url.host:
            raise ValueError(
                f"base_url {self.base_url!r} is no HTTP address; "
                "give one such as http://127.0.0.1:11434/v1"
            )
        if url.userinfo:
            raise ValueError("base_url must not hold a password; give the key as api_key")
        if not self.model.strip():
            raise ValueError("model is empty; give its name at the endpoint, such as llama3.1")
        if not 0.0 < self.timeout_s <= 600.0:
            raise ValueError(f"timeout_s must be in (0, 600], got {self.timeout_s}")


class ChatError(Exception):
    """The endpoint gave no answer; the text is fit to be shown."""

    def __init__(self, text: str, *, retry: bool, wait_s: float = 0.0) -> None:
        super().__init__(text)
        self.retry = retry
        """Whether asking again can help."""
        self.wait_s = wait_s
        """How long the endpoint asks to wait before that."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ChatReply:
    """An answer."""

    text: str
    complete: bool
    """False where the endpoint cut the answer at its length limit."""
    form: ResponseForm
    """What the endpoint was held to."""


Message = dict[str, str]


class ChatEndpoint:
    """A connection to one endpoint and model; may be used by several threads.

    Finds out which form of structured output the endpoint takes, and remembers it.
    """

    def __init__(self, config: ChatConfig, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._config = config
        self._clock = clock
        self._url = config.base_url.rstrip("/") + "/chat/completions"
        self._forms: tuple[ResponseForm, ...] = _FORMS
        self._temperature = config.temperature
        # A proxy of the environment must not get in the way of a model on this machine.
        self._client = httpx.Client(
            timeout=config.timeout_s,
            trust_env=not _is_local(httpx.URL(config.base_url).host),
            follow_redirects=False,
        )

    def close(self) -> None:
        """Close the connection; a request that is under way fails."""
        self._client.close()

    @property
    def form(self) -> ResponseForm:
        """The form of structured output that is tried next."""
        return self._forms[0]

    def ask(
        self, messages: Callable[[ResponseForm], Sequence[Message]], schema: dict[str, Any]
    ) -> ChatReply:
        """Ask one question.

        Args:
            messages: The conversation for each form of answer.
            schema: JSON Schema of the answer.

        Raises:
            ChatError: No answer within the time, or one that is no chat completion.
        """
        deadline = self._clock() + self._config.timeout_s
        while True:
            form = self.form
            status, body, headers = self._post(self._body(form, messages(form), schema), deadline)
            if status == 200:
                return self._completion(body, form)
            if status in _REFUSED_PARAMETER and self._give_way(body):
                continue
            raise self._error(status, body, headers)

    def _body(
        self, form: ResponseForm, messages: Sequence[Message], schema: dict[str, Any]
    ) -> dict[str, Any]:
        body: dict[str, Any] = {"model": self._config.model, "messages": list(messages)}
        if self._temperature is not None:
            body["temperature"] = self._temperature
        if form == "schema":
            named = {"name": "answer", "strict": True, "schema": schema}
            body["response_format"] = {"type": "json_schema", "json_schema": named}
        elif form == "json":
            body["response_format"] = {"type": "json_object"}
        return body

    def _post(self, body: dict[str, Any], deadline: float) -> tuple[int, bytes, httpx.Headers]:
        headers = {"Accept": "application/json"}
        if self._config.api_key:
            headers["Authorization"] = f"Bearer {self._config.api_key}"
        left = max(deadline - self._clock(), 0.01)
        try:
            with self._client.stream(
                "POST", self._url, json=body, headers=headers, timeout=left
            ) as response:
                received = bytearray()
                for chunk in response.iter_bytes():
                    received += chunk
                    if len(received) > MAX_REPLY_BYTES:
                        raise ChatError("the answer is longer than 1 MB", retry=False)
                    # A server that trickles never runs into the time-out of a single read.
                    if self._clock() > deadline:
                        raise ChatError(self._late(), retry=True)
                return response.status_code, bytes(received), response.headers
        except httpx.TimeoutException:
            raise ChatError(self._late(), retry=True) from None
        except (httpx.HTTPError, httpx.InvalidURL, RuntimeError) as error:
            reason = str(error) or type(error).__name__
            raise ChatError(self._clean(f"no connection: {reason}"), retry=True) from None

    def _give_way(self, body: bytes) -> bool:
        """Drop what the endpoint does not take; False when there is nothing left to drop."""
        text = body[:4000].decode("utf-8", "replace").lower()
        if "temperature" in text and self._temperature is not None:
            self._temperature = None
            return True
        if "model" in text and "not found" in text:
            return False
        if len(self._forms) > 1:
            self._forms = self._forms[1:]
            return True
        return False

    def _error(self, status: int, body: bytes, headers: httpx.Headers) -> ChatError:
        detail = _error_detail(body)
        text = f"HTTP {status}" + (f": {detail}" if detail else "")
        return ChatError(
            self._clean(text), retry=status not in _PERMANENT, wait_s=_retry_after(headers)
        )

    def _completion(self, body: bytes, form: ResponseForm) -> ChatReply:
        text, complete = _read_completion(body)
        return ChatReply(text=self._clean(text), complete=complete, form=form)

    def _late(self) -> str:
        return f"no answer within {self._config.timeout_s:g} s"

    def _clean(self, text: str) -> str:
        """Take the key out of a text: an endpoint may have echoed it."""
        key = self._config.api_key
        return text.replace(key, "***") if key else text


def _is_local(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _read_completion(body: bytes) -> tuple[str, bool]:
    try:
        value = json.loads(body)
        choice = value["choices"][0]
        message = cast("dict[str, Any]", choice["message"])
        text, refusal = message.get("content"), message.get("refusal")
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        raise ChatError("the answer is no chat completion", retry=True) from None
    if not isinstance(text, str) or not text.strip():
        why = f": {_short(refusal)}" if isinstance(refusal, str) else ""
        raise ChatError(f"the model gave no answer{why}", retry=True)
    return text, choice.get("finish_reason") != "length"


def _error_detail(body: bytes) -> str:
    try:
        value = json.loads(body)
        error = value["error"]
        return _short(str(error["message"] if isinstance(error, dict) else error))
    except (ValueError, LookupError, TypeError, RecursionError):
        return ""


def _retry_after(headers: httpx.Headers) -> float:
    try:
        return max(0.0, float(headers.get("Retry-After", "0")))
    except ValueError:
        return 0.0  # The date form: nobody waits for that here.


def _short(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= 200 else line[:199] + "…"
