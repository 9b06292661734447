import logging
import time
from types import SimpleNamespace

from app.links.network import topic_listener
from app.links.network.latched_topic import LatchedTopic
from app.links.network.requests import last_message
from app.links.network.sender import Sender
from app.links.network.topic_listener import TopicListener
from app.messages import keys


def test_the_whole_map_is_queried_and_not_heard(sessions, free_endpoint):
    router, _ = sessions
    listener = TopicListener(free_endpoint, "r", (keys.MAP_KEYFRAME, keys.STATUS), print)
    whole, status = (
        router.declare_publisher(f"r/{topic}") for topic in (keys.MAP_KEYFRAME, keys.STATUS)
    )
    served = router.declare_queryable(f"r/{keys.MAP_KEYFRAME}", _answer)
    listener.check()
    deadline = time.monotonic() + 10.0
    while not status.matching_status.matching:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert not whole.matching_status.matching
    assert listener.query(keys.MAP_KEYFRAME) == b"map"
    listener.close()
    served.undeclare()


def _answer(query):
    with query:
        query.reply(query.key_expr, b"map")


def test_the_whole_map_is_given_more_time_than_a_status(monkeypatch):
    given = {}

    def asked(_, key, timeout_s):
        given[key] = timeout_s

    monkeypatch.setattr(topic_listener, "last_message", asked)
    listener = TopicListener("tcp/127.0.0.1:1", "r", (), print)
    listener.session = object()
    for topic in (keys.MAP_KEYFRAME, keys.STATUS):
        listener.query(topic)
    assert given[f"r/{keys.MAP_KEYFRAME}"] >= 5 * given[f"r/{keys.STATUS}"]


def test_a_first_start_is_no_reconnection(monkeypatch, caplog):
    now = [100.0]
    monkeypatch.setattr(topic_listener, "time", SimpleNamespace(monotonic=lambda: now[0]))
    session = SimpleNamespace(close=lambda: None)
    monkeypatch.setattr(topic_listener, "open_client", lambda *_: session)
    receivers = {}

    def subscribe(_session, key, receive, **_):
        receivers[key] = receive

    monkeypatch.setattr(topic_listener, "subscribe", subscribe)
    monkeypatch.setattr(topic_listener, "on_token", lambda *_, **__: None)
    monkeypatch.setattr(topic_listener, "request_when_seen", lambda *_: None)
    caplog.set_level(logging.INFO, logger=topic_listener.__name__)
    listener = TopicListener("tcp/robot:7447", "r", (keys.STATUS,), lambda *_: None)

    def check_after(seconds):
        now[0] += seconds
        listener.check()
        said, opened = list(caplog.messages), listener.openings
        caplog.clear()
        return said, opened

    assert check_after(0.0) == ([], 1)
    waiting = "the router at tcp/robot:7447 answers; waiting for the navigator of r to start"
    assert check_after(5.0) == ([waiting], 2)
    assert check_after(5.0) == ([], 3), "said once"
    receivers["r/status"](b"")
    assert check_after(1.0) == ([], 3)
    lost = "no data from the navigator at tcp/robot:7447: reconnecting"
    assert check_after(5.0) == ([lost], 4)
    assert check_after(5.0) == ([], 5)


def test_last_messages_are_requested_of_what_is_subscribed_to_alone(sessions, free_endpoint):
    router, _ = sessions
    sender, came = Sender(), []
    token = router.liveliness().declare_token(f"r/{keys.NAVIGATOR_ALIVE}")
    latched = {key: LatchedTopic(router, f"r/{key}", sender) for key in keys.LATCHED}
    for key, topic in latched.items():
        topic.put(b"last")
        assert last_message(router, f"r/{key}", 5.0) == b"last", "sent before it begins"
    wanted = [keys.STATUS, keys.PAINTED, keys.MAP_ALIGNMENT]
    listener = TopicListener(
        free_endpoint, "r", (*wanted, keys.CAMERA_INFO), lambda key, _: came.append(key)
    )
    listener.check()
    deadline = time.monotonic() + 10.0
    while len(came) < len(wanted) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert sorted(came) == sorted(wanted)
    listener.close()
    token.undeclare()
    sender.close()
