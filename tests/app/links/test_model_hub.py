"""Models are fetched from a hub: a real server that answers as the hub does."""

import hashlib
import json
import logging
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

pytest.importorskip("huggingface_hub", reason="the extra ippon[segmentation] is not installed")

from app.links import model_hub
from app.links.model_hub import fetch_missing, is_here

MODELS = ("some/tiny", "other/tiny", "some/pickles")
SHA = "0123456789abcdef0123456789abcdef01234567"
FILES = {
    "config.json": b'{"model_type": "sam2"}',
    "model.safetensors": b"weights" * 1000,
    "pytorch_model.bin": b"pickle",
    "onnx/config.json": b"{}",
    "vocab.txt": b"a\nb\n",
}


class Hub(BaseHTTPRequestHandler):
    """Holds one model; answers as told for others."""

    asked: list[str]

    def do_HEAD(self):
        self.do_GET()

    def do_GET(self):
        path = self.path.partition("?")[0]
        self.asked.append(path)
        if "/gated/" in path:
            return self._answer(403, b"{}", {"X-Error-Code": "GatedRepo"})
        if path.startswith("/api/models/"):
            return self._api(path)
        content = FILES.get(path.partition(f"/resolve/{SHA}/")[2])
        if content is None:
            return self._answer(404, b"{}", {"X-Error-Code": "EntryNotFound"})
        tag = hashlib.sha256(content).hexdigest()
        return self._answer(200, content, {"ETag": f'"{tag}"', "X-Repo-Commit": SHA})

    def _api(self, path):
        if not path.startswith(tuple(f"/api/models/{name}" for name in MODELS)):
            return self._answer(404, b"{}", {"X-Error-Code": "RepoNotFound"})
        only = None if "tiny" in path else "pytorch_model.bin"
        files = {name: content for name, content in FILES.items() if only in {None, name}}
        if "/tree/" in path:
            rows = [
                {"type": "file", "path": name, "size": len(content), "oid": "0" * 40}
                for name, content in files.items()
            ]
            return self._answer(200, json.dumps(rows).encode())
        said = {
            "id": "some/tiny",
            "sha": SHA,
            "cardData": {"license": "apache-2.0"},
            "siblings": [
                {"rfilename": name, "size": len(content)} for name, content in files.items()
            ],
        }
        return self._answer(200, json.dumps(said).encode())

    def _answer(self, status, content, headers=None):
        self.send_response(status)
        for name, value in (headers or {}).items():
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        if self.command == "GET":
            self.wfile.write(content)

    def log_message(self, *_):
        pass


@pytest.fixture
def hub(monkeypatch):
    Hub.asked = []
    server = ThreadingHTTPServer(("127.0.0.1", 0), Hub)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture
def said(caplog):
    caplog.set_level(logging.INFO, logger=model_hub.__name__)
    return caplog


def test_a_model_is_fetched_and_its_terms_are_said_first(hub, tmp_path, said):
    fetch_missing(["some/tiny"], tmp_path / "models", hub)
    target = tmp_path / "models" / "tiny"
    assert said.messages == [
        f"fetching some/tiny: 0 MB, licence apache-2.0 ({hub}/some/tiny), into {target}"
    ]
    assert {path.name: path.read_bytes() for path in target.iterdir()} == {
        **{name: FILES[name] for name in ("config.json", "model.safetensors", "vocab.txt")},
        "hub-name.txt": b"some/tiny\n",
    }
    assert [path.name for path in target.parent.iterdir()] == ["tiny"]
    assert is_here("some/tiny", tmp_path / "models")
    before = len(Hub.asked)
    fetch_missing(["some/tiny", str(target), "./some/tiny/other", "san_vit_b_16"], tmp_path, hub)
    assert [path for path in Hub.asked[before:] if "/san" in path or "other" in path] == []


def test_a_model_of_another_owner_is_fetched_beside_that_of_its_name(
    hub, tmp_path, said, monkeypatch
):
    fetch_missing(["some/tiny"], tmp_path, hub)
    assert not is_here("other/tiny", tmp_path)
    monkeypatch.setitem(FILES, "model.safetensors", b"others")
    fetch_missing(["other/tiny"], tmp_path, hub)
    assert said.messages[-1].endswith(f", into {tmp_path / 'other--tiny'}")
    assert is_here("other/tiny", tmp_path)
    assert is_here("some/tiny", tmp_path)
    weights = {path.parent.name: path.read_bytes() for path in tmp_path.glob("*/model.safetensors")}
    assert weights == {"tiny": b"weights" * 1000, "other--tiny": b"others"}


def test_a_model_of_another_owner_that_was_fetched_meanwhile_is_not_taken(
    hub, tmp_path, said, monkeypatch
):
    download = model_hub.snapshot_download

    def with_another(*arguments, **options):
        download(*arguments, **options)
        (tmp_path / "tiny").mkdir()
        (tmp_path / "tiny" / "hub-name.txt").write_text("other/tiny\n")

    monkeypatch.setattr(model_hub, "snapshot_download", with_another)
    fetch_missing(["some/tiny"], tmp_path, hub)
    assert f"some/tiny was not fetched: {tmp_path / 'tiny'} cannot be written" in said.messages[-1]
    monkeypatch.setattr(model_hub, "snapshot_download", download)
    fetch_missing(["some/tiny"], tmp_path, hub)
    assert is_here("some/tiny", tmp_path)


def test_what_is_here_is_not_asked_for(hub, tmp_path, said):
    (tmp_path / "tiny").mkdir()
    fetch_missing(["some/tiny"], tmp_path, hub)
    assert (Hub.asked, said.messages) == ([], [])


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("some/nothing", "{hub} has no such model"),
        (
            "gated/model",
            "access must be granted by its owners: request it at {hub}/gated/model, then run `hf",
        ),
        ("some/pickles", "it holds no weights in safetensors, and pickles can run code"),
    ],
)
def test_a_model_that_cannot_be_had_says_why(hub, tmp_path, said, name, reason):
    fetch_missing([name], tmp_path, hub)
    (message,) = said.messages
    assert message.startswith(f"{name} was not fetched: " + reason.format(hub=hub))
    assert list(tmp_path.iterdir()) == []


def test_without_a_network_the_reason_is_said(tmp_path, said):
    fetch_missing(["some/tiny"], tmp_path, "http://127.0.0.1:9")
    (message,) = said.messages
    assert message.startswith(
        "some/tiny was not fetched: http://127.0.0.1:9 cannot be reached or gave an error: "
    )


def test_a_full_disk_is_noticed_before(hub, tmp_path, said, monkeypatch):
    usage = type("Usage", (), {"free": 7_010})
    monkeypatch.setattr(model_hub.shutil, "disk_usage", lambda _: usage)
    fetch_missing(["some/tiny"], tmp_path, hub)
    assert said.messages[0].startswith("some/tiny was not fetched: it needs 0 MB, and ")
    below = tmp_path / "some--tiny.partial" / ".cache"
    below.mkdir(parents=True)
    (below / "weights.incomplete").write_bytes(bytes(100))
    fetch_missing(["some/tiny"], tmp_path, hub)
    assert is_here("some/tiny", tmp_path), "what an interrupted fetch left is not fetched again"


def test_a_model_that_another_process_fetched_meanwhile_is_taken(hub, tmp_path, said, monkeypatch):
    download = model_hub.snapshot_download

    def with_another(*arguments, **options):
        download(*arguments, **options)
        (tmp_path / "tiny").mkdir()
        (tmp_path / "tiny" / "config.json").write_text("{}")

    monkeypatch.setattr(model_hub, "snapshot_download", with_another)
    fetch_missing(["some/tiny"], tmp_path, hub)
    assert [one for one in said.messages if "was not fetched" in one] == []
    assert is_here("some/tiny", tmp_path)


def test_a_fetch_that_breaks_off_leaves_no_model(hub, tmp_path, said, monkeypatch):
    monkeypatch.setitem(FILES, "model-00002.safetensors", b"more")
    real = Hub._answer

    def broken(self, status, content, headers=None):
        if "model-00002" in self.path and "/resolve/" in self.path:
            return real(self, 404, b"{}", {"X-Error-Code": "EntryNotFound"})
        return real(self, status, content, headers)

    monkeypatch.setattr(Hub, "_answer", broken)
    fetch_missing(["some/tiny"], tmp_path, hub)
    assert "some/tiny was not fetched: " in said.messages[-1]
    assert not is_here("some/tiny", tmp_path)
