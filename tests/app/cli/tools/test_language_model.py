import http.server
import threading

import pytest

from app.cli.options.language_model import Llm
from app.cli.tools.language_model import as_arguments, make_model
from app.errors import UsageError

KEY = "sk-very-secret-0123456789"


@pytest.fixture
def refusing():
    """An endpoint that asks for a key; it keeps the keys that it gets."""
    keys = []

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_POST(self):
            self.rfile.read(int(self.headers["Content-Length"]))
            keys.append(self.headers.get("Authorization"))
            self.send_response(401)
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.02,))
    thread.start()
    yield f"http://127.0.0.1:{server.server_address[1]}/v1", keys
    server.shutdown()
    thread.join()
    server.server_close()


def refusal(url, **environment):
    model = make_model(Llm(model="tiny", base_url=url), environment)
    answer = model.read_request("find my hat")
    model.close()
    return answer.failed


def test_an_endpoint_of_another_vendor_does_not_get_openais_key(refusing):
    url, keys = refusing
    failed = refusal(url, OPENAI_API_KEY=KEY)
    assert keys == [None]
    assert failed.startswith("HTTP 401. OPENAI_API_KEY was not sent")
    assert "IPPON_API_KEY" in failed
    assert refusal(url) == "HTTP 401"
    assert refusal(url, OPENAI_API_KEY=KEY, OPENAI_BASE_URL=url) == "HTTP 401"
    assert refusal(url, IPPON_API_KEY=KEY, OPENAI_API_KEY="other") == "HTTP 401"
    assert keys == [None, None, f"Bearer {KEY}", f"Bearer {KEY}"]


def test_openai_needs_a_key():
    with pytest.raises(UsageError, match="OpenAI requires a key"):
        make_model(Llm(model="gpt"), {})
    model = make_model(Llm(model="gpt"), {"OPENAI_API_KEY": KEY})
    assert model.name == "gpt at api.openai.com"
    model.close()


@pytest.mark.parametrize("wanted", [{"second_opinion": True}, {"look_every_s": 5.0}])
def test_what_only_a_model_does_is_refused_without_one(wanted):
    with pytest.raises(UsageError, match=r"name it with --llm\.model"):
        make_model(Llm(**wanted), {})
    model = make_model(Llm(**wanted), {"IPPON_LLM_MODEL": "tiny", "OPENAI_API_KEY": KEY})
    model.close()
    assert make_model(Llm(), {}) is None


@pytest.mark.parametrize(
    ("wanted", "word"), [(True, "second-opinion"), (False, "no-second-opinion")]
)
def test_another_process_is_told_of_the_second_opinion_either_way(wanted, word):
    # A file that it reads may say otherwise.
    assert as_arguments(Llm(model="tiny", second_opinion=wanted))[-1] == f"--llm.{word}"
    assert as_arguments(Llm(second_opinion=wanted))[-1] == f"--llm.{word}"
