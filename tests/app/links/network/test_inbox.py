import threading
import time

from app.links.network import inbox as inbox_module
from app.links.network.inbox import Inbox


def test_keeps_every_message_of_some_topics_and_the_latest_of_others():
    inbox = Inbox(["map"])
    for n in range(3):
        inbox.put("map", bytes([n]))
        inbox.put("image", bytes([n]))
    batch = inbox.drain(0.0)
    assert [payload for key, payload in batch if key == "map"] == [b"\0", b"\1", b"\2"]
    assert [payload for key, payload in batch if key == "image"] == [b"\2"]
    assert inbox.drain(0.0) == []


def test_a_flood_is_bounded_and_counted(monkeypatch):
    monkeypatch.setattr(inbox_module, "_LIMIT", 5)
    inbox = Inbox(["map"])
    for _ in range(8):
        inbox.put("map", b"")
    assert len(inbox.drain(0.0)) == 5
    assert inbox.dropped == 3


def test_waits_for_a_message_and_can_be_woken():
    inbox = Inbox([])
    threading.Timer(0.05, inbox.put, ("status", b"s")).start()
    assert inbox.drain(5.0) == [("status", b"s")]
    started = time.monotonic()
    inbox.wake()
    assert inbox.drain(20.0) == []
    threading.Timer(0.05, inbox.wake).start()
    assert inbox.drain(20.0) == []
    assert time.monotonic() - started < 10.0
    assert inbox.drain(0.01) == []


def test_takers_hear_their_topics_at_once():
    heard = []
    inbox = Inbox([], {"image": heard.append, "heat": heard.append}, ["heat"])
    for key in ("image", "heat", "status"):
        inbox.put(key, key.encode())
    assert heard == [b"image", b"heat"]
    assert sorted(inbox.drain(0.0)) == [("image", b"image"), ("status", b"status")]


def test_what_waits_gives_way_to_a_message_that_begins_anew():
    inbox = Inbox(["map", "jump"], anew=["jump"])
    for key in ("map", "status", "jump", "map"):
        inbox.put(key, key.encode())
    assert inbox.drain(0.0) == [("jump", b"jump"), ("map", b"map")]
