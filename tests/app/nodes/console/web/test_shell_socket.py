"""The shell's line: state out, commands in, and the lease of a page."""

import asyncio
import time
from types import SimpleNamespace

import msgspec
import pytest

from app.messages.control import ControlRequest, QueueRequest, SavedSearchRequest
from app.messages.lease import LeaseReply
from app.messages.memory import MemoryNoteRequest
from app.nodes.console.scene.scene_requests import ClickChoice
from app.nodes.console.web import shell_socket
from app.nodes.console.web.page_messages import ShellCommand, ShellInput, ShellPing
from tests.app.nodes.console.served import closing_code, hear


def test_the_shell_hears_the_state_and_its_echo(client, state_feed):
    with client.socket("/api/ws") as shell:
        assert hear(shell) == {"type": "state", "link": "live"}
        shell.send('{"type":"ping","t":12.5}')
        assert hear(shell) == {"type": "pong", "t": 12.5}
        state_feed.post(b'{"type":"state","link":"silent"}')
        assert hear(shell)["link"] == "silent"


def test_the_shell_gets_an_answer_to_every_command(client, navigator):
    with client.socket("/api/ws") as shell:
        hear(shell)
        shell.send('{"type":"control","id":7,"action":"stop"}')
        assert hear(shell) == {"type": "reply", "id": 7, "ok": True, "text": "stopped"}
        navigator.problem = "the navigator gave no answer within 2 s"
        shell.send('{"type":"control","id":8,"action":"resume"}')
        reply = hear(shell)
        assert (reply["id"], reply["ok"], reply["text"]) == (8, False, navigator.problem)


def test_a_room_is_named_and_the_plan_asks_again(client, navigator, state_feed):
    with client.socket("/api/ws") as shell:
        hear(shell)
        shell.send('{"type":"room","id":9,"x_m":1.5,"y_m":2,"name":"Anna"}')
        assert hear(shell) == {"type": "reply", "id": 9, "ok": True, "text": "The room is named."}
        assert (1.5, 2, "Anna") in navigator.actions
        assert state_feed.exports.take_names_changed()
        assert not state_feed.exports.take_names_changed()


def test_a_remembered_thing_is_searched_for(client, navigator):
    with client.socket("/api/ws") as shell:
        hear(shell)
        shell.send('{"type":"search","id":3,"object":"coffee table"}')
        told = {"type": "reply", "id": 3, "ok": True, "text": "Looking for: coffee table."}
        assert hear(shell) == told
        assert "coffee table" in navigator.actions


def test_what_a_person_says_of_a_thing_is_passed_on_and_the_plan_asks_again(
    client, navigator, state_feed
):
    with client.socket("/api/ws") as shell:
        hear(shell)
        shell.send('{"type":"note","id":4,"change":{"instance_id":2,"name":"Anna\'s mug"}}')
        assert hear(shell)["text"] == "This mug is Anna's mug."
        assert navigator.actions[-1] == MemoryNoteRequest(instance_id=2, name="Anna's mug")
        assert state_feed.exports.take_names_changed()
        navigator.problem = "there is no thing with number 3 any more"
        shell.send('{"type":"note","id":5,"change":{"instance_id":3,"deny":"mug"}}')
        reply = hear(shell)
        assert (reply["ok"], reply["text"]) == (False, navigator.problem)


def test_the_scene_is_asked_what_a_page_points_at(client, state_feed):
    with client.socket("/api/ws") as shell:
        hear(shell)
        shell.send('{"type":"look","position":[1,2,0.5],"thing":"Anna\'s mug","share":0.9}')
        shell.send('{"type":"frame"}')
        shell.send('{"type":"hover","id":6,"u":0.25,"v":0.5}')
        asked = []
        deadline = time.monotonic() + 10.0
        while not asked:
            assert time.monotonic() < deadline
            state_feed.scene.answer_hovers(lambda hover: asked.append(hover) or "sofa")
            time.sleep(0.01)
        assert hear(shell) == {"type": "reply", "id": 6, "ok": True, "text": "sofa"}
        assert (asked[0].u, asked[0].v) == (0.25, 0.5)
        (look,) = state_feed.scene.looks()
        assert (look.centre_world, look.browser) == ((1, 2, 0.5), asked[0].browser)
        assert (look.thing, look.share) == ("Anna's mug", 0.9)
        assert state_feed.scene.framings() == [asked[0].browser]
        assert state_feed.scene.framings() == []


@pytest.mark.parametrize(
    ("choice", "action", "text"),
    [
        (ClickChoice(tool="go", brush_m=0.6), ("go", 1.5, 2.0), "Driving there, 2.4 m."),
        (
            ClickChoice(tool="look_here", brush_m=0.8),
            ("look_here", [(1.5, 2.0)], 0.8),
            "Searching there first.",
        ),
        (ClickChoice(tool="explain", brush_m=0.6), None, ""),
        (None, None, ""),
    ],
)
def test_a_click_on_the_plan_does_what_is_chosen(
    client, navigator, state_feed, choice, action, text
):
    with client.socket("/api/ws") as shell:
        hear(shell)
        before = list(navigator.actions)
        shell.send('{"type":"point","id":7,"x_m":1.5,"y_m":2.0}')
        asked = []
        deadline = time.monotonic() + 10.0
        while not asked:
            assert time.monotonic() < deadline
            state_feed.scene.answer_choices(lambda browser: asked.append(browser) or choice)
            time.sleep(0.01)
        assert hear(shell) == {"type": "reply", "id": 7, "ok": bool(text), "text": text}
        assert navigator.actions[len(before) :] == ([] if action is None else [action])


def test_goals_are_changed_cancelled_and_saved_by_number(client, navigator):
    with client.socket("/api/ws") as shell:
        hear(shell)
        for text, request in (
            (
                '{"type":"queue","id":1,"change":{"goal_id":5,"action":"before","before":3}}',
                QueueRequest(goal_id=5, action="before", before=3),
            ),
            (
                '{"type":"saved","id":1,"change":{"action":"run","saved_id":2}}',
                SavedSearchRequest(action="run", saved_id=2),
            ),
            (
                '{"type":"control","id":1,"action":"cancel","goal_id":4}',
                ControlRequest(action="cancel", requester="console", goal_id=4),
            ),
        ):
            shell.send(text)
            assert hear(shell)["ok"]
            assert navigator.actions[-1] == request
        navigator.problem = "goal 5 is no longer waiting"
        shell.send('{"type":"queue","id":2,"change":{"goal_id":5,"action":"first"}}')
        assert hear(shell) == {"type": "reply", "id": 2, "ok": False, "text": navigator.problem}


@pytest.mark.parametrize(
    "text",
    ["", "no json", '{"type":"queue","id":1,"change":{"goal_id":5,"action":"eat"}}',
     '{"type":"search","id":1,"object":""}', "[]", '{"type":"shoot"}',
     '{"type":"control","id":1,"action":"explode"}',
     '{"type":"ping","t":1,"more":2}', '{"type":"ping","t":1}' + " " * 9000, b"\x00\xff"],
)  # fmt: skip
def test_what_is_no_message_ends_the_shell_and_commands_nothing(client, navigator, text):
    with client.socket("/api/ws") as shell:
        hear(shell)
        shell.send(text)
        assert closing_code(shell) == 1007
    assert navigator.actions == []


def test_a_page_is_told_who_it_is_and_a_browser_stays_the_same(client):
    cookie, _, flags = client.get("/").headers["set-cookie"].partition("; ")
    assert flags == "HttpOnly; Path=/; SameSite=Strict"
    with client.socket("/api/ws", cookie=cookie) as shell:
        you = hear(shell, "you")
    assert you["name"].startswith("browser ")
    assert (you["role"], you["standing"], you["has_login"]) == ("supervisor", "watches", False)
    assert "set-cookie" not in client.get("/").headers
    with client.socket("/api/ws", cookie=cookie) as again:
        assert hear(again, "you") == you
    with client.socket("/api/ws") as other:
        assert hear(other, "you")["name"] != you["name"]


def test_what_a_page_asks_is_asked_in_its_name(client, navigator):
    with client.socket("/api/ws") as shell:
        name = hear(shell, "you")["name"]
        shell.send('{"type":"control","id":7,"action":"pause"}')
        hear(shell, "reply")
    assert navigator.who.name == name


def test_control_is_taken_renewed_and_lost_as_the_page_is_told(client, navigator):
    navigator.counts_renewals = True
    with client.socket("/api/ws") as shell:
        assert hear(shell, "you")["standing"] == "watches"
        shell.send('{"type":"lease","id":1,"action":"request"}')
        assert hear(shell, "reply") == {
            "type": "reply", "id": 1, "ok": True, "text": "You have control.",
        }  # fmt: skip
        assert hear(shell, "you")["standing"] == "holds"
        deadline = time.monotonic() + 10.0
        while navigator.actions.count("renew") < 3:
            assert time.monotonic() < deadline
            shell.send('{"type":"alive"}')
            time.sleep(0.05)
        shell.send('{"type":"lease","id":2,"action":"release"}')
        hear(shell, "reply")
    assert {"request", "renew", "release"} == set(navigator.actions)
    navigator.problem = "Anna has control"
    with client.socket("/api/ws") as shell:
        shell.send('{"type":"lease","id":3,"action":"take"}')
        assert hear(shell, "reply")["text"] == "Anna has control"


def test_who_asks_for_control_after_somebody_else_is_told(client, navigator, monkeypatch):
    asked = "Anna has control, and Bert asks for it already."

    async def lease(action, requester=""):
        return LeaseReply(standing="watches", epoch=3, detail=asked)

    monkeypatch.setattr(navigator, "lease", lease)
    with client.socket("/api/ws") as shell:
        shell.send('{"type":"lease","id":1,"action":"request"}')
        assert hear(shell, "reply") == {"type": "reply", "id": 1, "ok": False, "text": asked}
        shell.send('{"type":"lease","id":2,"action":"release"}')
        assert hear(shell, "reply")["ok"]


def test_a_page_that_sleeps_keeps_no_lease(client, navigator, monkeypatch):
    navigator.counts_renewals = True
    monkeypatch.setattr(shell_socket, "ASLEEP_S", 0.2)
    monkeypatch.setattr(shell_socket, "RENEW_S", 0.05)
    with client.socket("/api/ws") as shell:
        shell.send('{"type":"lease","id":1,"action":"request"}')
        hear(shell, "reply")
        time.sleep(0.5)
        renewals = navigator.actions.count("renew")
        time.sleep(0.3)
        assert navigator.actions.count("renew") == renewals
        deadline = time.monotonic() + 10.0
        while navigator.actions.count("renew") == renewals:
            assert time.monotonic() < deadline
            shell.send('{"type":"alive"}')
            time.sleep(0.02)


def test_the_theme_of_a_page_is_that_of_its_browser(client, browsers):
    cookie = client.get("/").headers["set-cookie"].split(";")[0]
    browser = browsers.find(cookie.partition("=")[2])
    with client.socket("/api/ws", cookie=cookie) as shell:
        for light in (True, False):
            shell.send(f'{{"type":"theme","light":{str(light).lower()}}}')
            shell.send('{"type":"ping","t":1}')
            hear(shell, "pong")
            assert browser.has_light_theme is light


def test_a_verdict_is_about_the_find_that_the_page_showed(client, navigator):
    with client.socket("/api/ws") as shell:
        for verdict, find in (("confirm", 2), ("reject", "null")):
            shell.send(
                f'{{"type":"verdict","id":1,"verdict":"{verdict}","goal_id":7,"find":{find}}}'
            )
            assert hear(shell, "reply")["ok"]
    sent = [one for one in navigator.actions if one != "renew"]
    assert sent == [("confirm", 7, 2), ("reject", 7, None)]


def test_keys_that_arrive_late_move_nothing_and_the_page_is_told(monkeypatch):
    now_s, sent, told = [100.0], [], []

    async def messages(*_):
        for n in range(40):
            # From the twentieth on, each comes 0.1 s later after the one before than it was sent.
            now_s[0] = 100.0 + 0.05 * n + 0.1 * max(0, n - 20)
            yield ShellInput(t=50.0 * n, forward=1.0)
            await asyncio.sleep(0)

    async def put(message):
        told.append(msgspec.json.decode(message)["type"])

    monkeypatch.setattr(shell_socket, "page_messages", messages)
    monkeypatch.setattr(shell_socket, "time", SimpleNamespace(monotonic=lambda: now_s[0]))
    controller = SimpleNamespace(send_input=sent.append)
    asyncio.run(shell_socket._listen(None, put, controller, None, None))
    moved = [one.forward for one in sent]
    assert moved[:24] == [1.0] * 24
    assert moved[27:] == [0.0] * (len(moved) - 27)
    assert set(told) == {"late"}
    assert 1 <= len(told) <= 5, "twice a second, not with every message"


def test_a_stop_is_read_while_the_line_to_the_page_is_full(monkeypatch):
    stopped = asyncio.Event()

    async def messages(*_):
        yield ShellPing(t=1.0)
        yield ShellCommand(id=1, action="stop")
        await asyncio.sleep(30.0)

    async def control(request):
        assert request.action == "stop"
        stopped.set()

    async def never(_):
        await asyncio.Event().wait()

    async def run():
        controller = SimpleNamespace(control=control)
        listening = asyncio.create_task(shell_socket._listen(None, never, controller, None, None))
        await asyncio.wait_for(stopped.wait(), 10.0)
        listening.cancel()

    monkeypatch.setattr(shell_socket, "page_messages", messages)
    asyncio.run(run())
