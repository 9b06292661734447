import threading
from concurrent.futures import ThreadPoolExecutor

import zenoh
import zenoh.ext

from app.links.network.session import open_client
from app.links.network.subscription import is_alive, on_token, subscribe
from tests.app.relay import Relay


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


def test_who_is_not_there_yet_is_waited_for(sessions):
    router, client = sessions
    assert not is_alive(client, "r/alive", 0.1)
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(is_alive, client, "r/alive", 60.0)
        token = router.liveliness().declare_token("r/alive")
        assert waiting.result(60.0)
    assert is_alive(client, "r/alive", 60.0), "it was there before"
    token.undeclare()


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


def test_a_broken_line_is_told_of_before_anything_comes_over_the_new_one(sessions, free_endpoint):
    router, _ = sessions
    token = router.liveliness().declare_token("r/alive")
    relay = Relay(int(free_endpoint.rsplit(":", 1)[1]))
    client = open_client(f"tcp/127.0.0.1:{relay.port}")
    heard, came = [], threading.Condition()

    def hear(word):
        with came:
            heard.append(word)
            came.notify()

    subscribe(client, "r/word", hear)
    on_token(client, "r/alive", lost=lambda: hear(b"broken"))
    stop = threading.Event()

    def speak():
        while not stop.wait(0.01):
            router.put("r/word", b"word")

    speaker = threading.Thread(target=speak)
    speaker.start()
    try:
        with came:
            assert came.wait_for(lambda: b"word" in heard, 20.0)
            assert b"broken" not in heard
        while not list(client.liveliness().get("r/alive")):
            threading.Event().wait(0.1)
        relay.cut()
        with came:
            assert came.wait_for(lambda: b"broken" in heard and heard[-1] == b"word", 20.0)
            assert heard.count(b"broken") == 1
    finally:
        stop.set()
        speaker.join()
        client.close()
        relay.close()
        token.undeclare()
