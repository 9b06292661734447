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
import threading
import time

SEGMENT = 1448


class LossyRelay:
    """Passes everything on late; `loss` of each segment, and `rate` in bytes a second or None."""

    def __init__(self, port, latency_s, loss, rate=None, seed=0):
        self.latency_s, self.loss, self.rate = latency_s, loss, rate
        self._to = ("127.0.0.1", port)
        self._random = random.Random(seed)
        self._ends, self._closed = [], False
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._threads = [threading.Thread(target=self._accept, daemon=True)]
        self._threads[0].start()

    @staticmethod
    def reno_rate(latency_s, loss):
        return 1.22 * SEGMENT / (2.0 * latency_s * math.sqrt(loss))

    def cut(self):
        """Break every connection; whoever connects again is let through again."""
        ends, self._ends = self._ends, []
        for end in ends:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def close(self):
        self._closed = True
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self.cut()
        for thread in self._threads:
            thread.join(10.0)

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                try:
                    far = socket.create_connection(self._to)
                except OSError:
                    near.close()
                    continue
                self._ends += [near, far]
                for source, sink in ((near, far), (far, near)):
                    source.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
                    sink.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    late = queue.Queue(maxsize=64)
                    for run, ends in ((self._take, (source, late)), (self._give, (late, sink))):
                        self._threads.append(threading.Thread(target=run, args=ends, daemon=True))
                        self._threads[-1].start()

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
