import json
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from tests import later

chat = later.module("app.links.language_model.chat")

KEY = "sk-very-secret-0123456789"
QUESTION: list[dict[str, str]] = [{"role": "user", "content": "?"}]


@pytest.fixture
def endpoint(chat_server: Any) -> Iterator[Any]:
    endpoint = chat.ChatEndpoint(
        chat.ChatConfig(base_url=chat_server.url + "/", model="tiny", timeout_s=5.0)
    )
    yield endpoint
    endpoint.close()


def ask(endpoint: Any) -> Any:
    return endpoint.ask(lambda _: QUESTION, {"type": "object"})


def test_sends_no_key_where_there_is_none(chat_server: Any, speak: Any, endpoint: Any) -> None:
    chat_server.script = speak("yes")
    reply = ask(endpoint)
    assert (reply.text, reply.form) == ("yes", "schema")
    assert "Authorization" not in chat_server.headers[0]


def test_says_where_no_answer_fits_into_the_limit_of_length(
    chat_server: Any, reply_with: Any, endpoint: Any
) -> None:
    """A model that thinks first may not come to its answer."""
    body = b'{"choices": [{"message": {"content": ""}, "finish_reason": "length"}]}'
    chat_server.script = reply_with(200, body)
    with pytest.raises(chat.ChatError, match="no answer before its limit of length"):
        ask(endpoint)


@pytest.mark.parametrize(
    ("status", "headers", "retry", "wait_s"),
    [
        (429, {"Retry_After": "3"}, True, 3.0),
        (429, {"Retry_After": "Wed, 21 Oct 2026 07:28:00 GMT"}, True, 0.0),
        (503, {}, True, 0.0),
        (401, {}, False, 0.0),
        (404, {}, False, 0.0),
    ],
)
def test_says_whether_asking_again_helps(
    chat_server: Any,
    reply_with: Any,
    endpoint: Any,
    status: int,
    headers: dict[str, str],
    retry: bool,
    wait_s: float,
) -> None:
    chat_server.script = reply_with(status, b"", **headers)
    with pytest.raises(chat.ChatError, match=f"HTTP {status}") as caught:
        ask(endpoint)
    assert (caught.value.retry, caught.value.wait_s) == (retry, wait_s)
    assert len(chat_server.requests) == 1


def test_an_endpoint_that_takes_nothing_is_an_error(
    chat_server: Any, reply_with: Any, endpoint: Any
) -> None:
    chat_server.script = reply_with(400, b'{"error": "no"}')
    with pytest.raises(chat.ChatError, match="HTTP 400: no"):
        ask(endpoint)
    assert len(chat_server.requests) == 3


@pytest.mark.parametrize(
    ("config", "message"),
    [
        ({"base_url": "ftp://x"}, "base_url 'ftp://x' is no HTTP address; give one such as"),
        ({"base_url": "http://me:secret@x/v1"}, "base_url must not hold a password"),
        ({"model": " "}, "model is empty"),
        ({"api_key": "sk-very-secret\n"}, "the API key holds a space, a line break or"),
        ({"api_key": "sk-very-secrét"}, "the API key holds a space, a line break or"),
        ({"timeout_s": 0.0}, r"timeout_s must be in \(0, 600\], got 0.0"),
    ],
)
def test_config_errors(config: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        chat.ChatConfig(**({"base_url": "http://127.0.0.1/v1", "model": "tiny"} | config))
    assert "secret" not in str(caught.value)


def test_the_key_is_not_shown() -> None:
    config = chat.ChatConfig(base_url="http://127.0.0.1/v1", model="tiny", api_key=KEY)
    assert KEY not in repr(config)


def test_threads_that_are_refused_one_form_drop_it_once(
    chat_server: Any, speak: Any, reply_with: Any, endpoint: Any
) -> None:
    both = threading.Barrier(2, timeout=10.0)

    def script(server: Any, body: dict[str, Any], handler: Any) -> None:
        if body.get("response_format", {}).get("type") == "json_schema":
            both.wait()
            reply_with(400, b'{"error": "no json_schema"}')(server, body, handler)
        else:
            speak("yes")(server, body, handler)

    chat_server.script = script
    with ThreadPoolExecutor(2) as pool:
        replies = list(pool.map(lambda _: ask(endpoint), range(2)))
    assert [reply.form for reply in replies] == ["json", "json"]


def test_a_question_that_is_refused_in_every_form_changes_none(
    chat_server: Any, speak: Any, reply_with: Any, endpoint: Any
) -> None:
    chat_server.script = reply_with(400, b'{"error": "maximum context length exceeded"}')
    with pytest.raises(chat.ChatError):
        ask(endpoint)
    chat_server.script = speak("yes")
    assert ask(endpoint).form == "schema"


@pytest.mark.parametrize(
    ("status", "body"),
    [
        (200, {"choices": [{"message": {"content": "half \ud800"}}]}),
        (200, {"choices": [{"message": {"content": None, "refusal": f"\ud800 {KEY}"}}]}),
        (500, {"error": {"message": f"\ud800 {KEY}"}}),
    ],
)
def test_texts_of_an_endpoint_can_be_sent_on(
    chat_server: Any, reply_with: Any, status: int, body: dict[str, Any]
) -> None:
    chat_server.script = reply_with(status, json.dumps(body).encode())
    endpoint = chat.ChatEndpoint(
        chat.ChatConfig(base_url=chat_server.url, model="tiny", api_key=KEY)
    )
    try:
        text = ask(endpoint).text
    except chat.ChatError as error:
        text = str(error)
    finally:
        endpoint.close()
    assert text.encode()
    assert KEY not in text


def test_a_redirection_is_not_followed(chat_server: Any, reply_with: Any, endpoint: Any) -> None:
    chat_server.script = reply_with(307, b"", Location=chat_server.url + "/other")
    with pytest.raises(chat.ChatError, match="HTTP 307"):
        ask(endpoint)
    assert len(chat_server.requests) == 1
