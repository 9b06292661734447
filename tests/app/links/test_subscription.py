import threading

import zenoh
import zenoh.ext

from app.links.subscription import subscribe


def test_messages_of_two_keys_come_in_the_order_in_which_they_were_sent(sessions):
    router, client = sessions
    heard, complete = [], threading.Event()
    n = 2000

    def take(payload):
        heard.append(int(payload))
        if len(heard) == n:
            complete.set()

    for key in ("r/even", "r/odd"):
        subscribe(client, key, take)
    publishers = [router.declare_publisher(key) for key in ("r/even", "r/odd")]
    while not all(publisher.matching_status.matching for publisher in publishers):
        threading.Event().wait(0.01)
    for k in range(n):
        publishers[k % 2].put(str(k).encode())
    assert complete.wait(20.0)
    assert heard == list(range(n))


def test_what_is_sent_once_and_kept_reaches_those_who_come_late(sessions):
    # As a bridge publishes a transient local topic of ROS; it needs time stamps of its own.
    router, client = sessions
    keeper = zenoh.ext.declare_advanced_publisher(
        router, "r/tf_static", cache=zenoh.ext.CacheConfig(1), publisher_detection=True
    )
    keeper.put(b"once")
    heard, came = [], threading.Condition()

    def take(payload):
        with came:
            heard.append(payload)
            came.notify()

    subscribe(client, "r/tf_static", take, kept=True)
    with came:
        assert came.wait_for(lambda: heard == [b"once"], 20.0)
    router.put("r/tf_static", b"by a plain publisher")
    with came:
        assert came.wait_for(lambda: heard[1:] == [b"by a plain publisher"], 20.0)
    keeper.undeclare()
