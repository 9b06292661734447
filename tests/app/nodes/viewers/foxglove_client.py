"""A client of Foxglove's WebSocket protocol: subscribes to topics and keeps what comes."""

import json
import struct
import time

from websockets.sync.client import connect

MESSAGE, TIME = 1, 2


class FoxgloveClient:
    def __init__(self, port):
        self._socket = connect(
            f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"], max_size=None
        )
        self.channels = {}
        self.messages = {}
        """Payloads by topic, in order."""
        self.log_times_ns = []
        self.times_ns = []
        """What the server's clock said."""
        self.statuses = {}
        """Texts of the server by their name."""
        self.sessions = []
        self.capabilities = None
        self._topics = {}

    def close(self):
        self._socket.close()

    def subscribe(self, *topics):
        wanted = [self.channels[topic] for topic in topics]
        entries = [{"id": channel["id"], "channelId": channel["id"]} for channel in wanted]
        self._topics |= {channel["id"]: channel["topic"] for channel in wanted}
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": entries}))

    def wait(self, condition, timeout_s=20.0):
        """Receive until the condition holds."""
        deadline = time.monotonic() + timeout_s
        while not condition(self):
            left = deadline - time.monotonic()
            assert left > 0, f"heard { ({k: len(v) for k, v in self.messages.items()}) }"
            try:
                self._take(self._socket.recv(timeout=min(left, 0.2)))
            except TimeoutError:
                continue

    def _take(self, frame):
        if isinstance(frame, str):
            self._take_json(json.loads(frame))
        elif frame[0] == MESSAGE:
            number, log_ns = struct.unpack_from("<IQ", frame, 1)
            self.log_times_ns.append(log_ns)
            self.messages.setdefault(self._topics[number], []).append(frame[13:])
        elif frame[0] == TIME:
            self.times_ns.append(struct.unpack_from("<Q", frame, 1)[0])

    def _take_json(self, message):
        match message["op"]:
            case "serverInfo":
                self.capabilities = message["capabilities"]
                self.sessions.append(message["sessionId"])
            case "advertise":
                self.channels |= {entry["topic"]: entry for entry in message["channels"]}
            case "status":
                self.statuses[message.get("id")] = message["message"]
            case "removeStatus":
                for name in message["statusIds"]:
                    self.statuses.pop(name, None)
