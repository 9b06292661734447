import threading
import time
from concurrent.futures import Future

import pytest

from app.links.network.requests import RequestRefusedError
from app.nodes.navigator.services.operation_queue import MAX_WAITING, OperationQueue


@pytest.fixture
def operations():
    return OperationQueue(wake=lambda: None)


def test_they_run_in_order_and_what_is_first_goes_first_and_once(operations):
    ran = []
    operations.enqueue(lambda _: ran.append("a"))
    operations.enqueue(lambda _: ran.append("b"))

    def stop(_):
        ran.append("stop")

    operations.enqueue_first(stop)
    operations.enqueue_first(stop)
    operations.run_queued(None)
    assert ran == ["stop", "a", "b"]


def test_what_takes_long_waits_for_the_next_round(operations):
    ran = []
    for k in range(5):
        operations.enqueue(lambda _, k=k: (time.sleep(0.06), ran.append(k)))
    operations.run_queued(None)
    assert 1 <= len(ran) <= 2
    for _ in range(5):
        operations.run_queued(None)
    assert ran == [0, 1, 2, 3, 4]


def test_what_a_question_raises_is_told_at_once(operations):
    def run():
        while not operations._operations:
            time.sleep(0.01)
        operations.run_queued(None)

    def fail(error):
        raise error

    for raised, told in (
        (ValueError("no such thing"), RequestRefusedError),
        (RequestRefusedError("not now"), RequestRefusedError),
        (KeyError("a bug"), KeyError),
    ):
        mission = threading.Thread(target=run)
        mission.start()
        with pytest.raises(told, match=str(raised.args[0])):
            operations.ask(lambda _, raised=raised: fail(raised), timeout_s=20.0)
        mission.join()


def test_requests_are_refused_while_too_many_wait(operations):
    for _ in range(MAX_WAITING + 1):
        operations.enqueue(lambda _: None)
    with pytest.raises(RequestRefusedError, match="200 requests wait"):
        operations.check_room()
    with pytest.raises(RequestRefusedError, match="try again in a moment"):
        operations.ask(lambda _: 1)
    operations.run_queued(None)
    operations.check_room()


def test_what_was_refused_because_it_waited_is_not_done_later(operations):
    ran = []
    with pytest.raises(RequestRefusedError, match=r"not answer within 0\.05 s; try again"):
        operations.ask(lambda _: ran.append("drive there"), timeout_s=0.05)
    operations.run_queued(None)
    assert ran == []


def test_what_is_under_way_is_waited_for(operations, monkeypatch):
    begun, refused = threading.Event(), threading.Event()
    result, cancel = Future.result, Future.cancel

    def result_once_begun(answer, timeout=None):
        # The time is up at once after the question has begun, whenever that is.
        assert begun.wait(20.0)
        return result(answer, None if timeout is None else 0.0)

    def cancel_and_note(answer):
        try:
            return cancel(answer)
        finally:
            refused.set()

    def think(_):
        begun.set()
        assert refused.wait(20.0), "its time is up"
        return "there"

    monkeypatch.setattr(Future, "result", result_once_begun)
    monkeypatch.setattr(Future, "cancel", cancel_and_note)
    mission = threading.Thread(target=operations.run_queued, args=(None,))
    operations.wake = mission.start
    assert operations.ask(think, timeout_s=0.2) == "there"
    mission.join()
