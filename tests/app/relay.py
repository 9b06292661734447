"""A line to a port of this machine that can be cut."""

import contextlib
import socket
import threading


class Relay:
    """Passes everything on, until it is cut; who connects again is let through again."""

    def __init__(self, port):
        self._to = ("127.0.0.1", port)
        self._ends = []
        self.passed = 0
        """Bytes that went either way."""
        self.lets_in = True
        """Whether who connects is let through; otherwise its connection ends at once."""
        self.swallows = False
        """Whether who connects from now on is let in, and nothing that is sent passed on."""
        self.swallowed = []
        self._silent = set()
        self._threads = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._acceptor = threading.Thread(target=self._accept, daemon=True)
        self._acceptor.start()

    def cut(self):
        """Break every connection."""
        ends, self._ends = self._ends + self.swallowed, []
        for end in ends:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def silence(self):
        """Lose whatever is sent on the present connections, and break none; later ones work."""
        self._silent.update(self._ends)

    def close(self):
        """Let nobody through any more."""
        # Closing alone leaves the thread in `accept`.
        self._listener.shutdown(socket.SHUT_RDWR)
        self._acceptor.join(5.0)
        self._listener.close()
        self.cut()
        for thread in self._threads:
            thread.join(5.0)

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                if not self.lets_in:
                    near.close()
                    continue
                if self.swallows:
                    self.swallowed.append(near)
                    continue
                try:
                    far = socket.create_connection(self._to)
                except OSError:
                    near.close()
                    continue
                self._ends += [near, far]
                self._carry(near, far)
                self._carry(far, near)

    def _carry(self, source, sink):
        self._start(self._pass_on, source, sink)

    def _start(self, run, *arguments):
        self._threads.append(threading.Thread(target=run, args=arguments, daemon=True))
        self._threads[-1].start()

    def _pass_on(self, source, sink):
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                if source in self._silent:
                    continue
                self.passed += len(data)
                sink.sendall(data)
        for end in () if source in self._silent else (source, sink):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
