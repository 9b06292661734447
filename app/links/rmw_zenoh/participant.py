"""This program as a ROS 2 node among others: `ros2 node list` and `ros2 topic info` show it."""

import itertools
import threading
import time
from collections.abc import Callable
from typing import Any, Final

import zenoh
import zenoh.ext

from app.links.rmw_zenoh.protocol.attachment import (
    Attachment,
    decode_attachment,
    encode_attachment,
    gid_of,
)
from app.links.rmw_zenoh.protocol.tokens import Entity, Kind, Qos, token_of
from app.messages.cdr import MessageError

NODE: Final = "ippon"
COMMANDS: Final = Qos(depth=1)
"""Quality of service of what is published: reliable, volatile."""
MOST_KEPT: Final = 100
"""Messages of a transient local topic that are asked for."""

Take = Callable[[bytes, Attachment | None], None]


class Endpoint:
    """A publisher or subscription with its token."""

    def __init__(self, entity: Entity, declared: Any, token: Any, gid: bytes) -> None:
        self.entity = entity
        self._declared, self._token, self._gid = declared, token, gid
        self._lock = threading.Lock()
        self._sequence = 0

    def put(self, payload: bytes) -> None:
        """Publish a serialized message."""
        with self._lock:
            self._sequence += 1
            attachment = Attachment(sequence=self._sequence, stamp_ns=time.time_ns(), gid=self._gid)
            self._declared.put(payload, attachment=encode_attachment(attachment))

    def close(self) -> None:
        """Withdraw from the graph."""
        self._token.undeclare()
        self._declared.undeclare()


class Participant:
    """One node with its publishers and subscriptions.

    Args:
        session: Connected to the robot's router, or the router of the robot's nodes.
        domain: ROS domain.
        namespace: Of the node.
    """

    def __init__(self, session: zenoh.Session, domain: int, namespace: str = "/") -> None:
        self.session = session
        self._domain, self._namespace = domain, namespace
        self._zid = str(session.info.zid())
        self._numbers = itertools.count(1)
        self._token: Any = self._declare_token(self._entity("NN", 0))
        self._endpoints: list[Endpoint] = []

    def publish(self, topic: str, kind: str, type_hash: str) -> Endpoint:
        """Declare a publisher of commands."""
        entity = self._entity("MP", next(self._numbers), topic, kind, type_hash, COMMANDS)
        # As rmw_zenoh does for reliable publishers: a command that cannot leave is obsolete.
        declared = self.session.declare_publisher(
            entity.key,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.REAL_TIME,
            express=True,
        )
        return self._add(entity, declared)

    def subscribe(self, topic: str, kind: str, type_hash: str, qos: Qos, take: Take) -> Endpoint:
        """Declare a subscription.

        Args:
            topic: Full name.
            kind: ROS 2 type.
            type_hash: As the publishers have it.
            qos: Transient local asks each publisher for its last messages, too.
            take: Gets each payload with its attachment, None without a valid one; called in
                zenoh's network thread: it must return at once.
        """
        entity = self._entity("MS", next(self._numbers), topic, kind, type_hash, qos)

        def receive(sample: zenoh.Sample) -> None:
            attached = sample.attachment
            try:
                attachment = None if attached is None else decode_attachment(attached.to_bytes())
            except MessageError:
                attachment = None
            take(sample.payload.to_bytes(), attachment)

        handler: Any = zenoh.handlers.Callback(receive, indirect=False)
        if not qos.transient_local:
            return self._add(entity, self.session.declare_subscriber(entity.key, handler))
        history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=MOST_KEPT)
        declared = zenoh.ext.declare_advanced_subscriber(
            self.session, entity.key, handler, history=history, subscriber_detection=True
        )
        return self._add(entity, declared)

    def client(self, name: str, kind: str, type_hash: str, qos: Qos) -> tuple[Entity, Any]:
        """Declare the client of a service; return it with its token."""
        entity = self._entity("SC", next(self._numbers), name, kind, type_hash, qos)
        return entity, self._declare_token(entity)

    def withdraw(self, endpoint: Endpoint) -> None:
        """Close one endpoint."""
        self._endpoints.remove(endpoint)
        endpoint.close()

    def close(self) -> None:
        """Close all endpoints, and leave the graph."""
        for endpoint in self._endpoints:
            endpoint.close()
        self._endpoints.clear()
        self._token.undeclare()

    def _add(self, entity: Entity, declared: Any) -> Endpoint:
        endpoint = Endpoint(entity, declared, self._declare_token(entity), gid_of(token_of(entity)))
        self._endpoints.append(endpoint)
        return endpoint

    def _declare_token(self, entity: Entity) -> Any:
        return self.session.liveliness().declare_token(token_of(entity))

    def _entity(
        self,
        kind: Kind,
        number: int,
        topic: str = "",
        message: str = "",
        type_hash: str = "",
        qos: Qos | None = None,
    ) -> Entity:
        return Entity(
            domain=self._domain,
            session=self._zid,
            node_id=0,
            entity_id=number,
            kind=kind,
            namespace=self._namespace,
            node=NODE,
            topic=topic,
            type=message,
            type_hash=type_hash,
            qos=qos or Qos(),
        )
