import threading

import pytest
import zenoh

from app.links.network import sender as sender_module
from app.links.network.sender import Sender


@pytest.fixture
def sender(monkeypatch):
    # Its thread may have to wait for the machine.
    monkeypatch.setattr(sender_module, "FLUSH_S", 20.0)
    sender = Sender()
    yield sender
    sender.close()


@pytest.fixture
def link(sender):
    """A link that is stuck until told otherwise; `sent` is what has passed."""
    return Link(sender)


class Link:
    def __init__(self, sender):
        self.sent = []
        self.free = threading.Event()
        self._stuck = threading.Event()
        sender.put(5, self._block)
        assert self._stuck.wait(20.0)

    def _block(self):
        self._stuck.set()
        assert self.free.wait(20.0)

    def send(self, value):
        return lambda: self.sent.append(value)


def test_nobody_waits_for_a_stuck_link_and_the_order_stays(sender, link):
    for k in range(50):
        sender.put(10, link.send(k))
    assert link.sent == []
    assert sender.backlog_bytes == 505
    link.free.set()
    sender.close()
    assert link.sent == list(range(50))
    assert sender.backlog_bytes == 0


def test_of_a_state_only_the_latest_is_sent(sender, link):
    for k in range(50):
        sender.put_latest("status", link.send(("status", k)))
        sender.put_latest("tree", link.send(("tree", k)))
    link.free.set()
    sender.close()
    assert link.sent == [("status", 49), ("tree", 49)]


def test_what_cannot_be_sent_does_not_end_the_sending(sender, link):
    def fail():
        raise ValueError("no message")

    sender.put(7, fail)
    sender.put_latest("status", fail)
    sender.put(1, link.send("stop"))
    link.free.set()
    sender.close()
    assert link.sent == ["stop"]
    assert sender.backlog_bytes == 0


def test_a_long_queue_does_not_hold_up_the_status(sender, link):
    for k in range(10):
        sender.put(1, link.send(k))
    sender.put_latest("status", link.send("status"))
    link.free.set()
    sender.close()
    assert link.sent.index("status") <= 1


def test_one_failure_is_logged_and_the_next_message_is_sent(sender, link, caplog):
    def fail():
        raise zenoh.ZError("closed")

    sender.put(1, fail)
    sender.put(1, link.send("next"))
    link.free.set()
    sender.close()
    assert link.sent == ["next"]
    assert "a message was not sent: closed" in caplog.text
