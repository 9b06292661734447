"""One question to an OpenAI-compatible chat endpoint: OpenAI, Ollama, vLLM, llama.cpp server.

The `openai` SDK speaks the protocol. It takes a second to load: import this module only where a
model is configured.
"""

import json
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, cast
from urllib.parse import urlsplit

import httpx2
from openai import APIConnectionError, APIStatusError, APITimeoutError, Omit, OpenAI, OpenAIError

from app.links.language_model import bounded_transport as bounded
from app.links.loopback import is_loopback

ResponseForm = Literal["schema", "json", "text"]

MAX_REPLY_BYTES = 1_000_000
_FORMS: tuple[ResponseForm, ...] = ("schema", "json", "text")
_REFUSED_PARAMETER = frozenset({400, 415, 422, 501})
_UNAUTHORISED = frozenset({401, 403})
_PERMANENT = frozenset({401, 402, 403, 404, 405, 410})


@dataclass(frozen=True, slots=True, kw_only=True)
class ChatConfig:
    """Where the language model is and how it is asked."""

    base_url: str
    """Address up to and without `/chat/completions`, such as http://127.0.0.1:11434/v1."""
    model: str
    """Name of the model at the endpoint."""
    api_key: str | None = field(default=None, repr=False)
    """Sent as bearer token; never logged, cached or recorded."""
    without_key: str = ""
    """What to do about a refusal (HTTP 401, 403) where no key is sent; empty for nothing known."""
    timeout_s: float = 30.0
    """Maximum total time of one request."""
    temperature: float | None = 0.0
    """0 gives the most probable answer; None uses the endpoint's default."""

    def __post_init__(self) -> None:
        """Refuse addresses that cannot be asked."""
        url = urlsplit(self.base_url)
        if url.scheme not in ("http", "https") or not url.hostname:
            raise ValueError(
                f"base_url {self.base_url!r} is no HTTP address; "
                "give one such as http://127.0.0.1:11434/v1"
            )
        if url.username is not None or url.password is not None:
            raise ValueError("base_url must not hold a password; give the key as api_key")
        if not self.model.strip():
            raise ValueError("model is empty; give its name at the endpoint, such as llama3.1")
        if self.api_key is not None and not _is_header(self.api_key):
            # The HTTP client would show the key in its error.
            raise ValueError(
                "the API key holds a space, a line break or a letter that is not ASCII"
            )
        if not 0.0 < self.timeout_s <= 600.0:
            raise ValueError(f"timeout_s must be in (0, 600], got {self.timeout_s}")

    @property
    def host(self) -> str:
        """Name or address of the machine that is asked."""
        return urlsplit(self.base_url).hostname or ""


class ChatError(Exception):
    """The endpoint gave no answer; the text can be shown to the operator."""

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
    """As the model gave it; `ChatEndpoint.without_key` prepares it to be shown or kept."""
    form: ResponseForm
    """Form of structured output that was requested."""


Message = dict[str, Any]
"""Role and content; the content is a text, or a list of parts where it holds an image."""


class ChatEndpoint:
    """A connection to one endpoint and model; safe from any thread.

    Detects which form of structured output the endpoint accepts, and keeps it.
    """

    def __init__(self, config: ChatConfig, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._config = config
        self._clock = clock
        self._lock = threading.Lock()
        self._forms: tuple[ResponseForm, ...] = _FORMS
        self._temperature = config.temperature
        self._client = _connect(config)

    def close(self) -> None:
        """Close the connection; a pending request fails."""
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
            ChatError: No answer in time, or an answer that is not a chat completion.
        """
        deadline = self._clock() + self._config.timeout_s
        accepted = self._forms
        while True:
            form, temperature = self._forms[0], self._temperature
            question = self._body(form, temperature, messages(form), schema)
            status, body, headers = self._post(question, deadline)
            if status == 200:
                return self._completion(body, form)
            if status in _REFUSED_PARAMETER and self._drop_parameter(body, form, temperature):
                continue
            # What is refused in every form is refused for another reason, such as its length.
            self._forms = accepted
            raise self._error(status, body, headers)

    def _body(
        self,
        form: ResponseForm,
        temperature: float | None,
        messages: Sequence[Message],
        schema: dict[str, Any],
    ) -> dict[str, Any]:
        body: dict[str, Any] = {"messages": list(messages)}
        if temperature is not None:
            body["temperature"] = temperature
        if form == "schema":
            named = {"name": "answer", "strict": True, "schema": schema}
            body["response_format"] = {"type": "json_schema", "json_schema": named}
        elif form == "json":
            body["response_format"] = {"type": "json_object"}
        return body

    def _post(self, body: dict[str, Any], deadline: float) -> tuple[int, bytes, Mapping[str, str]]:
        left = max(deadline - self._clock(), 0.01)
        headers = None if self._config.api_key else {"Authorization": Omit()}
        create = self._client.chat.completions.with_raw_response.create
        try:
            response = create(
                model=self._config.model, timeout=left, extra_headers=headers, **body
            ).http_response
        except APIStatusError as error:
            response = error.response
        except APITimeoutError:
            raise ChatError(self._late(), retry=True) from None
        except APIConnectionError as error:
            raise self._failure(error.__cause__ or error) from None
        except (OpenAIError, bounded.BoundError, RuntimeError, ValueError) as error:
            raise self._failure(error) from None
        return response.status_code, response.content, response.headers

    def _failure(self, error: BaseException) -> ChatError:
        match error:
            case bounded.AnswerTooLateError():
                return ChatError(self._late(), retry=True)
            case bounded.ClosedError():
                return ChatError("the provider was closed", retry=False)
            case bounded.AnswerTooLongError():
                return ChatError("the answer is longer than 1 MB", retry=False)
            case bounded.AnswerCompressedError():
                return ChatError(
                    "the answer is compressed, although that was not requested", retry=False
                )
            case _:
                reason = str(error) or type(error).__name__
                return ChatError(self.without_key(f"no connection: {reason}"), retry=True)

    def _drop_parameter(self, body: bytes, form: ResponseForm, temperature: float | None) -> bool:
        """Drop a parameter that the endpoint refuses; return False if none is left.

        Of several threads that are refused the same parameter, the first drops it.
        """
        text = body[:4000].decode("utf-8", "replace").lower()
        if "temperature" in text and temperature is not None:
            self._temperature = None
            return True
        if ("model" in text and "not found" in text) or form == _FORMS[-1]:
            return False
        with self._lock:
            if self._forms[0] == form:
                self._forms = self._forms[1:]
        return True

    def _error(self, status: int, body: bytes, headers: Mapping[str, str]) -> ChatError:
        detail = _error_detail(body)
        text = f"HTTP {status}" + (f": {detail}" if detail else "")
        if status in _UNAUTHORISED and self._config.api_key is None and self._config.without_key:
            text += f". {self._config.without_key}"
        return ChatError(
            self.without_key(text), retry=status not in _PERMANENT, wait_s=_retry_after(headers)
        )

    def _completion(self, body: bytes, form: ResponseForm) -> ChatReply:
        try:
            text = _read_completion(body)
        except ChatError as error:
            raise ChatError(self.without_key(str(error)), retry=error.retry) from None
        # Half a character, "\ud800", stands in no text. The key stays: "x" is in many a word.
        return ChatReply(text=text.encode("utf-8", "replace").decode(), form=form)

    def _late(self) -> str:
        return f"no answer within {self._config.timeout_s:g} s"

    def without_key(self, text: str) -> str:
        """Return a text to be shown, without the key, which an endpoint may have echoed."""
        key = self._config.api_key
        text = text.encode("utf-8", "replace").decode()
        return text.replace(key, "***") if key else text


def _connect(config: ChatConfig) -> OpenAI:
    """Return the SDK's client; its own retries are off, and every answer is bounded."""
    # A proxy from the environment must not be used for a model on this machine.
    use_environment = not is_loopback(config.host)
    inner = httpx2.Client(
        trust_env=use_environment,
        follow_redirects=False,
        timeout=config.timeout_s,
        limits=httpx2.Limits(max_keepalive_connections=0),
    )
    http_client = httpx2.Client(
        transport=bounded.BoundedTransport(inner, MAX_REPLY_BYTES), timeout=config.timeout_s
    )
    # Without a key the SDK would take one from the environment, meant for another endpoint.
    return OpenAI(
        base_url=config.base_url,
        api_key=config.api_key or "none",
        max_retries=0,
        http_client=http_client,
    )


def _is_header(key: str) -> bool:
    return key.isascii() and key.isprintable() and " " not in key


def _read_completion(body: bytes) -> str:
    try:
        value = json.loads(body)
        choice = value["choices"][0]
        message = cast("dict[str, Any]", choice["message"])
        text, refusal = message.get("content"), message.get("refusal")
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        raise ChatError("the answer is not a chat completion", retry=True) from None
    if not isinstance(text, str) or not text.strip():
        if isinstance(refusal, str):
            raise ChatError(f"the model gave no answer: {_short(refusal)}", retry=True)
        if choice.get("finish_reason") == "length":
            raise ChatError("the model gave no answer before its limit of length", retry=True)
        raise ChatError("the model gave no answer", retry=True)
    return text


def _error_detail(body: bytes) -> str:
    try:
        value = json.loads(body)
        error = value["error"]
        return _short(str(error["message"] if isinstance(error, dict) else error))
    except (ValueError, LookupError, TypeError, RecursionError):
        return ""


def _retry_after(headers: Mapping[str, str]) -> float:
    try:
        return max(0.0, float(headers.get("Retry-After", "0")))
    except ValueError:
        return 0.0  # The date form is not supported.


def _short(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= 200 else line[:199] + "…"
