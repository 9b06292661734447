import time

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
    assert listener.query(keys.MAP_KEYFRAME, 5.0) == b"map"
    listener.close()
    served.undeclare()


def _answer(query):
    with query:
        query.reply(query.key_expr, b"map")
