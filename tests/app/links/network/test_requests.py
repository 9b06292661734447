import logging
import threading
from concurrent.futures import ThreadPoolExecutor

import msgspec
import pytest
import zenoh

from app.links.network.latched_topic import LatchedTopic
from app.links.network.requests import (
    RequestRefusedError,
    ask,
    ask_until_answered,
    last_message,
    serve,
)
from app.links.network.sender import Sender
from app.links.network.session import LinkError, open_client
from app.messages.control import (
    Accepted,
    ControlReply,
    ControlRequest,
    ErrorReply,
    FeedbackRequest,
    SearchRequest,
)
from tests.app.relay import Relay

KEY = "robot/search"


def raw_reply(session, payload, key=KEY):
    """Ask with any bytes; return what came as JSON."""
    replies = [r.ok.payload.to_bytes() for r in session.get(key, payload=payload, timeout=5.0)]
    assert len(replies) == 1
    return msgspec.json.decode(replies[0])


def test_a_request_gets_its_result(sessions):
    router, client = sessions
    serve(router, KEY, SearchRequest, lambda r: Accepted(detail=r.object))
    assert ask(client, KEY, SearchRequest(object="hat"), Accepted, 5.0) == Accepted(detail="hat")


@pytest.mark.parametrize(
    ("payload", "text"),
    [
        (None, "not a SearchRequest"),
        (b"", "not a SearchRequest"),
        (b"{", "truncated"),
        (b"\xff\xfe\x00", "malformed"),
        (b'"\xff"', "not a SearchRequest"),
        (b"[1, 2]", "Expected `object`, got `array`"),
        (b"{}", "missing required field `object`"),
        (b'{"object": ""}', "length >= 1"),
        (b'{"object": "hat", "colour": "red"}', "unknown field `colour`"),
        (b'{"object": "' + b"x" * 1_000_000 + b'"}', "length <= 80"),
        (b"[" * 100_000, "not a SearchRequest"),
    ],
)
def test_a_malformed_request_gets_a_reply_that_says_what_is_wrong(sessions, payload, text):
    router, client = sessions
    serve(router, KEY, SearchRequest, lambda r: Accepted(detail=r.object))
    error = raw_reply(client, payload)["error"]
    assert text in error
    assert "object, context, scenario, requester" in error
    assert len(error) < 1000


def test_a_refusal_reaches_the_asker(sessions):
    router, client = sessions

    def refuse(_):
        raise RequestRefusedError("the queue is full")

    serve(router, KEY, SearchRequest, refuse)
    assert raw_reply(client, b'{"object": "hat"}') == {"error": "the queue is full"}
    with pytest.raises(RequestRefusedError, match="the queue is full"):
        ask(client, KEY, SearchRequest(object="hat"), Accepted, 5.0)


def test_a_failure_of_the_handler_is_logged_and_answered(sessions, caplog):
    router, client = sessions

    def fail(_):
        raise ZeroDivisionError

    serve(router, KEY, SearchRequest, fail)
    with caplog.at_level(logging.ERROR):
        reply = raw_reply(client, b'{"object": "hat"}')
    assert "see its log" in reply["error"]
    assert "ZeroDivisionError" in caplog.text


def test_nobody_answers(sessions):
    _, client = sessions
    with pytest.raises(LinkError, match=r"no reply on robot/search within 0\.5 s"):
        ask(client, KEY, SearchRequest(object="hat"), Accepted, 0.5)
    with pytest.raises(LinkError, match="there is no such endpoint; the navigator may still be"):
        ask(client, KEY, SearchRequest(object="hat"), Accepted, 20.0)


def test_an_answer_that_takes_too_long_is_told_as_such(sessions):
    router, client = sessions
    over, taken = threading.Event(), []
    came = threading.Event()

    def think(request):
        taken.append(request)
        came.set()
        over.wait(20.0)
        return Accepted()

    serve(router, KEY, SearchRequest, think)
    with pytest.raises(LinkError) as told:
        ask(client, KEY, SearchRequest(object="hat"), Accepted, 0.3)
    assert came.wait(20.0)
    over.set()
    assert str(told.value) == "no reply on robot/search within 0.3 s"
    assert len(taken) == 1


def test_a_request_is_not_sent_again_when_the_line_breaks(sessions, free_endpoint):
    router, _ = sessions
    relay = Relay(int(free_endpoint.rsplit(":", 1)[1]))
    client = open_client(f"tcp/127.0.0.1:{relay.port}")
    taken, under_way, over = [], threading.Event(), threading.Event()

    def think(request):
        taken.append(request)
        under_way.set()
        over.wait(20.0)
        return Accepted()

    serve(router, KEY, SearchRequest, think)
    try:
        with ThreadPoolExecutor(1) as pool:
            reply = pool.submit(ask, client, KEY, SearchRequest(object="hat"), Accepted, 3.0)
            assert under_way.wait(20.0)
            relay.cut()
            # zenoh says so at once, or waits for a reply until the time is up.
            with pytest.raises(LinkError, match="no reply on robot/search"):
                reply.result(30.0)
    finally:
        over.set()
        client.close()
        relay.close()
    assert len(taken) == 1


def test_what_may_be_done_twice_is_sent_until_it_is_answered(sessions):
    router, client = sessions
    served = []
    later = threading.Timer(
        0.4, lambda: served.append(serve(router, KEY, SearchRequest, lambda _: Accepted()))
    )
    later.start()
    request = SearchRequest(object="hat")
    assert ask_until_answered(client, KEY, request, Accepted, 20.0) == Accepted()
    later.join()
    with pytest.raises(LinkError, match=r"no reply on robot/another within 0\.3 s"):
        ask_until_answered(client, "robot/another", request, Accepted, 0.3)


def test_a_stop_is_told_at_once_while_another_request_is_answered(sessions):
    router, client = sessions
    busy, over, stopped = threading.Event(), threading.Event(), threading.Event()

    def handle(request):
        if request.action == "pause":
            busy.set()
            assert over.wait(20.0)
        return ControlReply(state="stopped")

    serve(router, "robot/control", ControlRequest, handle, on_stop=stopped.set)
    ignored = zenoh.handlers.Callback(lambda _: None)
    client.get("robot/control", ignored, payload=b'{"action": "pause"}')
    assert busy.wait(20.0)
    assert not stopped.is_set()
    client.get("robot/control", ignored, payload=b'{"action": "stop"}')
    assert stopped.wait(20.0)
    over.set()


def test_a_reply_of_another_kind_is_not_taken(sessions):
    router, client = sessions
    serve(router, KEY, SearchRequest, lambda _: FeedbackRequest(verdict="confirm"))
    with pytest.raises(LinkError, match="the reply on robot/search is not understood"):
        ask(client, KEY, SearchRequest(object="hat"), Accepted, 5.0)


def test_an_error_reply_is_a_refusal_even_when_sent_by_the_handler(sessions):
    router, client = sessions
    serve(router, KEY, SearchRequest, lambda _: ErrorReply(error="no"))
    with pytest.raises(RequestRefusedError, match="no"):
        ask(client, KEY, SearchRequest(object="hat"), Accepted, 5.0)


def test_a_late_joiner_gets_the_last_message(sessions):
    router, client = sessions
    sender = Sender()
    latched = LatchedTopic(router, "robot/status", sender)
    assert last_message(client, "robot/status", 1.0) is None
    latched.put(b"one")
    latched.put(b"two")
    assert last_message(client, "robot/status", 5.0) == b"two"
    assert last_message(client, "robot/other", 0.5) is None
    sender.close()
