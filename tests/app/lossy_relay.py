"""A line to a port of this machine with latency and loss, as TCP passes them on.

Where the kernel has no `netem`, this stands for it: what is lost is not missing but late, since TCP
sends it again after a round trip, and all that follows waits behind it. The rate falls as Mathis et
al. (1997) give it for TCP Reno: 1.22 segments a round trip over the root of the loss.
"""

import contextlib
import math
import queue
import random
import socket
import time

from tests.app.relay import Relay

SEGMENT = 1448


class LossyRelay(Relay):
    """Passes everything on late; `loss` of each segment, and `rate` in bytes a second or None."""

    def __init__(self, port, latency_s, loss, rate=None, seed=0):
        self.latency_s, self.loss, self.rate = latency_s, loss, rate
        self._random = random.Random(seed)
        self._closed = False
        super().__init__(port)

    @staticmethod
    def reno_rate(latency_s, loss):
        return 1.22 * SEGMENT / (2.0 * latency_s * math.sqrt(loss))

    def close(self):
        self._closed = True
        super().close()

    def _carry(self, source, sink):
        source.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
        sink.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        late = queue.Queue(maxsize=64)
        self._start(self._take, source, late)
        self._start(self._give, late, sink)

    def _take(self, source, late):
        due = free_at = 0.0
        with contextlib.suppress(OSError):
            while data := source.recv(16384):
                now = time.monotonic()
                if self.rate:
                    free_at = max(free_at, now) + len(data) / self.rate
                    now = free_at
                due = max(due, now + self.latency_s + self._resent_s(len(data)))
                self._put(late, (due, data))
        self._put(late, (0.0, b""))

    def _put(self, late, item):
        while not self._closed:
            with contextlib.suppress(queue.Full):
                return late.put(item, timeout=0.2)
        return None

    def _give(self, late, sink):
        with contextlib.suppress(OSError):
            while not self._closed:
                try:
                    due, data = late.get(timeout=0.2)
                except queue.Empty:
                    continue
                if not data:
                    break
                time.sleep(max(0.0, due - time.monotonic()))
                sink.sendall(data)
        with contextlib.suppress(OSError):
            sink.shutdown(socket.SHUT_RDWR)
        sink.close()

    def _resent_s(self, size):
        """Round trips until the last lost segment has come; what is sent again may be lost, too."""
        missing, trips = math.ceil(size / SEGMENT), -1
        while missing:
            missing = sum(self._random.random() < self.loss for _ in range(missing))
            trips += 1
        return trips * max(0.2, 2.0 * self.latency_s)
