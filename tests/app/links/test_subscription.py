import threading

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
