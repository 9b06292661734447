"""Calls of a robot's services, as clients of rmw_zenoh make them: queries with an attachment."""

import logging
import threading
import time
from collections.abc import Callable, Iterable
from typing import Any, Final

import zenoh

from app.links.rmw_zenoh.participant import Participant
from app.links.rmw_zenoh.protocol.attachment import Attachment, encode_attachment, gid_of
from app.links.rmw_zenoh.protocol.tokens import Entity, Qos, token_of

logger = logging.getLogger(__name__)

SERVICES: Final = Qos(depth=10)
"""Quality of service of the clients of ROS 2."""

Answer = Callable[[bytes | None], None]


class ServiceClient:
    """Calls one service of the robot, of the type and hash that its server announces.

    Args:
        participant: Of the robot's graph.
        name: Full name of the service.
        kind: ROS 2 type.
    """

    def __init__(self, participant: Participant, name: str, kind: str) -> None:
        self._participant, self._name, self._kind = participant, name, kind
        self._lock = threading.Lock()
        self._client: Entity | None = None
        self._token: Any = None
        self._gid = b""
        self._sequence = 0

    def follow(self, entities: Iterable[Entity]) -> bool:
        """Find the server; return whether it is there."""
        server = next(
            (
                one
                for one in entities
                if one.kind == "SS" and one.topic == self._name and one.type == self._kind
            ),
            None,
        )
        with self._lock:
            known = self._client
            if server is None:
                return False
            if known is None or known.key != server.key:
                if self._token is not None:
                    self._token.undeclare()
                self._client, self._token = self._participant.client(
                    self._name, self._kind, server.type_hash, SERVICES
                )
                self._gid = gid_of(token_of(self._client))
        return True

    def call(self, request: bytes, timeout_s: float, answer: Answer) -> None:
        """Send a serialized request.

        Args:
            request: CDR.
            timeout_s: How long the answer may take.
            answer: Gets the serialized response, or None where none came; called once, in zenoh's
                network thread.
        """
        with self._lock:
            client = self._client
            self._sequence += 1
            attachment = Attachment(sequence=self._sequence, stamp_ns=time.time_ns(), gid=self._gid)
        if client is None:
            answer(None)
            return
        answered = threading.Event()

        def receive(reply: zenoh.Reply) -> None:
            if reply.ok is not None and not answered.is_set():
                answered.set()
                answer(reply.ok.payload.to_bytes())

        def end() -> None:
            if not answered.is_set():
                answer(None)

        handler: Any = zenoh.handlers.Callback(receive, end, indirect=False)
        self._participant.session.get(
            client.key,
            handler,
            payload=request,
            attachment=encode_attachment(attachment),
            timeout=timeout_s,
            target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
        )

    def close(self) -> None:
        """Leave the graph."""
        with self._lock:
            if self._token is not None:
                self._token.undeclare()
            self._client = self._token = None
