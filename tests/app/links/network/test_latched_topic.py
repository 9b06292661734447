"""A receiver never takes an older message after a newer one."""

import threading
import time

from app.links.network.latched_topic import LatchedReceiver, LatchedTopic
from app.links.network.requests import last_message
from app.links.network.sender import Sender
from app.links.network.subscription import subscribe


def test_what_was_published_during_a_request_is_not_replaced_by_its_reply():
    taken = []
    receiver = LatchedReceiver(taken.append)

    def last():
        receiver.receive(b"new")
        return b"old"

    assert receiver.request(last), "somebody replied"
    assert taken == [b"new"]


def test_without_a_message_meanwhile_the_reply_is_taken():
    taken = []
    receiver = LatchedReceiver(taken.append)
    receiver.receive(b"before the link broke")
    assert not receiver.request(lambda: None)
    assert receiver.request(lambda: b"missed")
    assert taken == [b"before the link broke", b"missed"]


def test_messages_that_follow_one_another_at_once_are_taken_in_their_order(sessions):
    router, client = sessions
    sender = Sender()
    topic = LatchedTopic(router, "r/t", sender)
    taken = []
    receiver = LatchedReceiver(taken.append)
    subscribe(client, "r/t", receiver.receive)
    for number in range(200):
        topic.put(b"%03d" % number)
        receiver.request(lambda: last_message(client, "r/t", 5.0))
    deadline = time.monotonic() + 20.0
    while taken[-1] != b"199":
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert taken == sorted(taken)
    sender.close()


def test_a_request_is_not_answered_with_what_is_not_sent_yet(sessions):
    router, client = sessions
    sender, goes_on = Sender(), threading.Event()
    topic = LatchedTopic(router, "r/t", sender)

    def await_reply(wanted):
        deadline = time.monotonic() + 20.0
        while last_message(client, "r/t", 5.0) != wanted:
            assert time.monotonic() < deadline
            time.sleep(0.05)

    topic.put(b"0")
    await_reply(b"0")
    sender.put_latest("another, behind a slow link", goes_on.wait)
    topic.put(b"1")
    assert last_message(client, "r/t", 5.0) == b"0"
    goes_on.set()
    await_reply(b"1")
    sender.close()
