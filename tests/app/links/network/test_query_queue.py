import queue
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from app.links.network.query_queue import QueryQueue, waited_s
from app.links.network.requests import RequestRefusedError, ask, serve
from app.messages.control import Accepted, ControlReply, ControlRequest, SearchRequest

KEY = "robot/search"


class Desk:
    """Answers queries when it is let, in the order that it notes."""

    def __init__(self):
        self.answered = []
        self.begins, self.may_answer = threading.Semaphore(0), threading.Semaphore(0)

    def answer(self, query):
        self.begins.release()
        self.may_answer.acquire(timeout=30.0)
        with query:
            self.answered.append(text := query.payload.to_string())
            query.reply(KEY, f"yes {text}")

    def refuse(self, query):
        with query:
            query.reply(KEY, f"no {query.payload.to_string()}")


def send(session, *texts):
    """Send queries; return a queue that gets their replies."""
    replies = queue.SimpleQueue()
    for text in texts:
        session.get(KEY, lambda r: replies.put(r.ok.payload.to_string()), payload=text, timeout=30)
    return replies


def test_what_comes_faster_than_the_rate_is_refused_and_after_a_while_admitted(sessions, caplog):
    router, client = sessions
    desk, now = Desk(), [100.0]
    desk.may_answer.release(100)
    QueryQueue(router, KEY, desk.answer, desk.refuse, rate_hz=2.0, burst=3, clock=lambda: now[0])
    replies = send(client, *"abcde")
    assert sorted(replies.get(timeout=10.0) for _ in range(5)) == [
        "no d", "no e", "yes a", "yes b", "yes c",
    ]  # fmt: skip
    assert caplog.text.count("more than 2 queries a second") == 1
    now[0] += 1.0
    replies = send(client, *"fgh")
    assert sorted(replies.get(timeout=10.0) for _ in range(3)) == ["no h", "yes f", "yes g"]


def test_an_urgent_query_goes_before_those_that_wait_and_past_the_limit(sessions):
    router, client = sessions
    desk = Desk()
    stop_came = threading.Event()

    def is_urgent(query):
        if is_stop := query.payload.to_string() == "stop":
            stop_came.set()
        return is_stop

    QueryQueue(router, KEY, desk.answer, None, is_urgent, burst=3)
    first = send(client, "a")
    assert desk.begins.acquire(timeout=10.0)
    others = send(client, *"bcdefg", "stop")
    assert stop_came.wait(10.0)
    desk.may_answer.release(10)
    for replies in (first, others, others, others):
        replies.get(timeout=10.0)
    assert desk.answered[:4] == ["a", "stop", "b", "c"]


def test_an_answer_knows_how_long_its_query_waited_for_its_turn(sessions):
    router, client = sessions
    desk, now, waited = Desk(), [100.0], {}
    arrived = threading.Semaphore(0)

    def answer(query):
        waited[query.payload.to_string()] = waited_s()
        desk.answer(query)

    def clock():
        time_s = now[0]
        arrived.release()
        return time_s

    QueryQueue(router, KEY, answer, clock=clock)
    first = send(client, "a")
    assert desk.begins.acquire(timeout=10.0)
    while arrived.acquire(blocking=False):
        pass
    second = send(client, "b")
    assert arrived.acquire(timeout=10.0)
    now[0] += 8.0
    desk.may_answer.release(10)
    for replies in (first, second):
        replies.get(timeout=10.0)
    assert waited == {"a": 0.0, "b": 8.0}
    assert waited_s() == 0.0


def test_a_failure_does_not_end_the_answers(sessions, caplog):
    router, client = sessions
    desk = Desk()
    desk.may_answer.release(100)

    def answer(query):
        if query.payload.to_string() == "bad":
            raise ZeroDivisionError
        desk.answer(query)

    QueryQueue(router, KEY, answer)
    replies = send(client, "bad", "good")
    assert replies.get(timeout=10.0) == "yes good"
    assert "ZeroDivisionError" in caplog.text


def test_a_request_too_many_is_told_so_and_a_stop_is_not(sessions):
    router, client = sessions
    stopped = ControlReply(state="stopped")
    served = [
        serve(router, KEY, SearchRequest, lambda request: Accepted(detail=request.object)),
        serve(router, "robot/control", ControlRequest, lambda _: stopped),
    ]

    def exhaust(key, request, kind):
        # One after the other, a busy machine may ask less than 50 times a second.
        with ThreadPoolExecutor(16) as pool:
            list(pool.map(lambda _: ask(client, key, request, kind, 20.0), range(1000)))

    with pytest.raises(RequestRefusedError, match="more than 50 requests a second come on robot/"):
        exhaust(KEY, SearchRequest(object="hat"), Accepted)
    with pytest.raises(RequestRefusedError, match="Stop is always accepted"):
        exhaust("robot/control", ControlRequest(action="pause"), ControlReply)
    stop = ControlRequest(action="stop")
    for _ in range(200):
        assert ask(client, "robot/control", stop, ControlReply, 5.0).state == "stopped"
    del served
