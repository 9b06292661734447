import time

from app.links.network import topic_listener
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
