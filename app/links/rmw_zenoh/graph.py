"""The ROS graph of a domain, as the tokens of its nodes announce it."""

import logging
import threading
from typing import Any, Final

import zenoh

from app.links.rmw_zenoh.protocol.tokens import SPACE, Entity, read_token

logger = logging.getLogger(__name__)

MOST_ENTITIES: Final = 20_000


class Graph:
    """Entities of one domain, except those of this session; safe from any thread.

    Args:
        session: Connected to the robot's router, or the router of the robot's nodes.
        domain: ROS domain; None for all.
    """

    def __init__(self, session: zenoh.Session, domain: int | None) -> None:
        self._lock = threading.Lock()
        self._entities: dict[str, Entity] = {}
        self._own = str(session.info.zid())
        self.unread = 0
        """Tokens that are none of rmw_zenoh, or one too many."""
        handler: Any = zenoh.handlers.Callback(self._receive, indirect=False)
        self._subscriber = session.liveliness().declare_subscriber(
            f"{SPACE}/{'*' if domain is None else domain}/**", handler, history=True
        )

    def entities(self) -> tuple[Entity, ...]:
        """Return all entities that are there now."""
        with self._lock:
            return tuple(self._entities.values())

    def close(self) -> None:
        """Follow the graph no more."""
        self._subscriber.undeclare()  # pyright: ignore[reportUnknownMemberType]

    def _receive(self, sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.DELETE:
            with self._lock:
                self._entities.pop(key, None)
            return
        try:
            entity = read_token(key)
        except ValueError as error:
            self.unread += 1
            if self.unread == 1:
                logger.warning("%s", error)
            return
        if entity.session == self._own:
            return
        with self._lock:
            if len(self._entities) < MOST_ENTITIES:
                self._entities[key] = entity
            else:
                self.unread += 1
