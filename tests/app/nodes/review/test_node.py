"""The pages of a review, from a process of their own."""

import json
import shutil
import time

import httpx2
import pytest
import websockets.sync.client
import zstandard

from app.cli.exit_status import EXIT_INTERRUPTED

pytestmark = pytest.mark.process


def _await_state(socket, condition, timeout_s=30.0):
    deadline = time.monotonic() + timeout_s
    while True:
        state = json.loads(socket.recv(timeout=max(deadline - time.monotonic(), 0.01)))
        if condition(state):
            return state


def test_choose_a_session_play_it_and_write_beside_it(session_folder, launch):
    process = launch("review", str(session_folder.parent), "--port", "0")
    process.wait_for_log("review at http")
    url = process.log().split("review at ")[1].split()[0]
    with httpx2.Client(base_url=url, follow_redirects=True, timeout=30.0) as client:
        assert "Sessions" in client.get("/").text
        (entry,) = client.get("/review/sessions").json()["sessions"]
        assert entry["object"] == "hat"
        assert [goal["outcome"] for goal in entry["goals"]] == ["found"]
        assert "sumOf" in client.get("/review/outcomes.js").text
        picture = client.get(f"/review/picture/{entry['id']}")
        assert picture.headers["content-type"] == "image/jpeg"
        assert client.get("/session/../../etc/passwd").status_code == 404
        assert client.get("/session/nothing.mcap").status_code == 404
        # Its link works, though the list was read before.
        later = session_folder.parent / "later"
        shutil.copytree(session_folder, later)
        of_later = entry["id"].replace(session_folder.name, "later", 1)
        assert client.get(f"/session/{of_later}").status_code == 200
        page = client.get(f"/session/{entry['id']}").text
        shutil.rmtree(later)
        assert page.index("/review/review.js") < page.index("/assets/shell.js")
        shown = client.get("/review/session").json()
        assert [mark["kind"] for mark in shown["marks"]] == [
            "query", "detection", "levels", "found",
        ]  # fmt: skip
        where = url.replace("http", "ws") + "/review/ws"
        with websockets.sync.client.connect(where, origin=url) as socket:

            def send(**command):
                socket.send(json.dumps(command))

            opened = _await_state(socket, lambda s: s["version"] > 0)
            find_s = min(shown["marks"][-1]["at_s"] + 0.3, shown["duration_s"])
            assert opened["position_s"] == pytest.approx(find_s, abs=0.02)
            send(action="seek", value=3.0)
            _await_state(socket, lambda s: s["position_s"] == 3.0)
            send(action="speed", value=16.0)
            send(action="play")
            state = _await_state(socket, lambda s: not s["playing"] and s["position_s"] > 5.0)
            assert state["speed"] == 16.0
            assert state["ended"], "the page says that this is the end"
            send(action="seek", value=2.0)
            send(action="note", text="here")
            _await_state(socket, lambda s: s["version"] > state["version"])
        (note,) = client.get("/review/session").json()["notes"]
        assert (note["text"], note["at_s"]) == ("here", pytest.approx(2.0, abs=0.02))
        assert shown["link"] == f"/session/{entry['id']}"
        moment = client.get("/review/moment?at=2.5")
        assert moment.headers["content-type"] == "image/jpeg"
        assert client.get("/review/moment?at=2.5&lane=1").status_code == 204
        for wrong in ("", "?at=x", "?at=-1", "?at=nan", "?at=1&lane=two"):
            assert client.get(f"/review/moment{wrong}").status_code == 400
        health = client.get("/health").json()
        assert health["state"]["object"] == "hat"
        answer = client.post("/api/stop", headers={"Origin": url}).json()
        assert answer == {"ok": False, "text": "this is a recording: nothing here commands a robot"}


def test_what_cannot_be_shown_is_said(tmp_path, launch):
    (tmp_path / "a.mcap").write_bytes(b"nonsense")
    process = launch("review", str(tmp_path / "a.mcap"), "--port", "0")
    status, _ = process.finish()
    assert status == 2
    assert "is not a recording" in process.log()


def test_what_was_unpacked_is_removed_when_the_process_is_told_to_end(
    session_folder, tmp_path, launch, monkeypatch
):
    bag, unpacked = tmp_path / "bag.mcap.zstd", tmp_path / "unpacked"
    (session,) = session_folder.glob("*.mcap")
    bag.write_bytes(zstandard.compress(session.read_bytes()))
    unpacked.mkdir()
    monkeypatch.setenv("TMPDIR", str(unpacked))
    process = launch("review", str(bag), "--port", "0")
    process.wait_for_log("review at http")
    assert list(unpacked.glob("ippon-bag-*"))
    process.child.terminate()
    assert process.finish()[0] == EXIT_INTERRUPTED
    assert not list(unpacked.glob("ippon-bag-*"))
