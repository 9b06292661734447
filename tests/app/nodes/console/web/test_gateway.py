import contextlib
import json
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from app.nodes.console.scene import export_requests as export_desk
from app.nodes.console.web import gateway
from app.view.model.scene_model import SceneModel
from app.view.words import ENGLISH
from tests.app.nodes.console.served import closing_code, drain, first, hear


def test_the_page_is_ours_and_runs_nothing_inline(client):
    page = client.get("/")
    assert page.status_code == 200
    assert "IPPON" in page.text
    assert "<script>" not in page.text
    assert "style=" not in page.text
    policy = page.headers["content-security-policy"]
    assert "script-src 'self';" in policy
    assert "frame-ancestors 'none'" in policy
    assert page.headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize("name", ["shell.css", "shell.js", "things.js", "view.css", "icon.svg"])
def test_assets_are_served_with_their_type(client, name):
    answer = client.get(f"/assets/{name}")
    assert answer.status_code == 200
    assert answer.headers["content-type"].split(";")[0] in {
        "text/css",
        "text/javascript",
        "image/svg+xml",
    }


@pytest.mark.parametrize(
    "path",
    ["/assets/index.html", "/assets/..%2f__init__.py", "/assets/../../pyproject.toml", "/x"],
)
def test_no_other_file_is_served(client, path):
    assert client.get(path).status_code == 404


def test_the_scene_may_connect_to_this_server_only(client):
    page = client.get("/view/?darkMode")
    assert page.status_code == 200
    assert '<link rel="stylesheet" href="/assets/view.css">' in page.text
    policy = page.headers["content-security-policy"]
    assert "connect-src 'self' data: blob:" in policy
    assert "'unsafe-eval'" not in policy
    assert "'unsafe-inline'" not in policy.partition("script-src")[2].partition(";")[0]
    assert "<script>" not in page.text


def test_another_servers_address_in_the_url_is_dropped(client):
    answer = client.get("/view/?darkMode&websocket=ws://evil.example", follow_redirects=False)
    assert answer.status_code == 303
    assert answer.headers["location"] == "/view/?darkMode"


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example:8080", "", "[::", "a b"])
def test_foreign_host_names_are_refused(client, host):
    answer = client.get("/", headers={"Host": host})
    assert answer.status_code == 403
    assert "answers to 127.0.0.1" in answer.text


@pytest.mark.parametrize("host", ["localhost:8080", "127.0.0.1:9", "[::1]:8080"])
def test_every_name_of_this_machine_is_served(client, host):
    answer = client.get("/health", headers={"Host": host, "Origin": f"http://{host}"})
    assert answer.status_code == 200


@pytest.mark.parametrize("path", ["/api/ws", "/view"])
@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:9999"])
def test_websockets_from_other_pages_are_refused(client, path, origin):
    with pytest.raises(InvalidStatus) as refused:
        client.socket(path, origin=origin)
    assert refused.value.response.status_code == 403


def test_stop_from_another_page_is_refused(client, navigator):
    answer = client.post("/api/stop", headers={"Origin": "http://evil.example"})
    assert answer.status_code == 403
    assert navigator.actions == []


@pytest.mark.parametrize("origin", ["http://[", "http://[::1", "http://\u2100", "//", ""])
def test_an_origin_that_is_none_is_refused(client, navigator, origin):
    answer = client.post("/api/stop", headers={"Origin": origin.encode("utf-8")})
    assert answer.status_code == 403
    assert navigator.actions == []


def test_stop_by_http(client, navigator):
    assert client.post("/api/stop").json() == {"ok": True, "text": "stopped"}
    navigator.problem = "no navigator at tcp/127.0.0.1:7447"
    answer = client.post("/api/stop")
    assert (answer.status_code, answer.json()["ok"]) == (502, False)
    assert "no navigator" in answer.json()["text"]
    assert navigator.actions == ["stop", "stop"]


def test_health_tells_the_state(client):
    assert client.get("/health").json()["link"] == "live"


def test_beyond_so_many_pages_a_further_one_is_turned_away(client, monkeypatch):
    monkeypatch.setattr(gateway, "MAX_SOCKETS", 2)
    with client.socket("/api/ws") as one, client.socket("/api/ws") as two:
        hear(one)
        hear(two)
        with client.socket("/api/ws") as three:
            assert closing_code(three) == 1013
    deadline = time.monotonic() + 10.0
    while True:
        with client.socket("/api/ws") as again:
            if json.loads(first(again)).get("type"):
                break
        assert time.monotonic() < deadline


def test_a_page_saves_what_is_shown(client, state_feed, stage):
    model = SceneModel()
    answers = ThreadPoolExecutor(1)

    def saved(name):
        answer = answers.submit(client.get, f"/api/export/{name}")
        while not answer.done():
            # As the scene_thread does, in the thread that owns the model.
            state_feed.exports.fill(model, ENGLISH)
        return answer.result()

    nothing = saved("map.ply")
    assert nothing.status_code == 404
    assert "nothing to write" in nothing.text
    model.on_status(stage.status_of())
    model.on_keyframe(stage.cloud_of(*stage.home_voxels(), 1))
    answer = saved("map.ply")
    assert answer.content.startswith(b"ply\nformat binary")
    assert answer.headers["content-disposition"] == 'attachment; filename="ippon-map.ply"'
    assert saved("figures.csv").text.startswith("time_s,")
    unknown = client.get("/api/export/passwd")
    assert unknown.status_code == 404
    assert "map.ply" in unknown.text


def test_a_page_is_told_when_nobody_writes(client, monkeypatch):
    monkeypatch.setattr(export_desk, "PATIENCE_S", 0.05)
    answer = client.get("/api/export/map.ply")
    assert answer.status_code == 503
    assert "the console does not respond" in answer.text


def test_what_is_remembered_is_listed_with_its_pictures(client, navigator):
    assert client.get("/api/goals").json() == client.get("/api/calls").json() == {}
    listed = client.get("/api/things")
    assert listed.headers["content-type"] == "application/json"
    assert [thing["label"] for thing in listed.json()["things"]][:2] == ["sofa", "table"]
    assert navigator.who is not None, "the request is that of a browser"
    assert client.get("/api/things/1").headers["content-type"] == "image/jpeg"
    assert client.get("/api/things/2").status_code == 204
    assert client.get("/api/things/two").status_code == 404
    navigator.problem = "no navigator at tcp/127.0.0.1:7447"
    refused = client.get("/api/things")
    assert (refused.status_code, refused.json()) == (502, {"problem": navigator.problem})
    assert client.get("/api/things/1").status_code == 502


@pytest.mark.parametrize("next_line", ["socket", "http"])
def test_what_arrives_late_on_a_line_that_a_page_has_left_is_not_carried_out(
    client, navigator, next_line
):
    cookie = client.get("/").headers["set-cookie"].partition(";")[0]
    with client.socket("/api/ws", cookie=cookie) as old, client.socket("/api/ws") as other:
        hear(old)
        hear(other)
        if next_line == "socket":
            with client.socket("/api/ws?silent_s=0", cookie=cookie) as new:
                hear(new)
                new.send('{"type":"control","id":1,"action":"stop"}')
                assert hear(new, "reply")["ok"]
        else:
            assert client.post("/api/stop?silent_s=0").json()["ok"]
        with contextlib.suppress(ConnectionClosed):
            old.send('{"type":"control","id":1,"action":"resume"}')
        with pytest.raises(ConnectionClosed):
            drain(old)
        other.send('{"type":"ping","t":1}')
        assert hear(other, "pong") == {"type": "pong", "t": 1}
    assert navigator.actions == ["stop"]


@pytest.mark.parametrize("silent_s", ["60", "", "soon", "nan"])
def test_a_line_from_after_the_silence_goes_on(client, silent_s):
    cookie = client.get("/").headers["set-cookie"].partition(";")[0]
    with client.socket("/api/ws", cookie=cookie) as shell:
        hear(shell)
        with client.socket(f"/api/ws?silent_s={silent_s}", cookie=cookie) as new:
            hear(new)
        shell.send('{"type":"ping","t":1}')
        assert hear(shell, "pong") == {"type": "pong", "t": 1}
