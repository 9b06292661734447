"""Which publisher or subscription of a robot belongs to a topic of its profile."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal

from app.links.rmw_zenoh.protocol.names import NO_HASH, topic_key, type_hash
from app.links.rmw_zenoh.protocol.tokens import Entity, Qos
from app.ros2.ippon_ros2.settings import KEPT, Topic

_DIGITS: Final = 15
"""Characters of a hash that a message shows, its prefix included."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Match:
    """The endpoints of a topic that can be used, or why there are none."""

    type: str = ""
    """ROS 2 type."""
    type_hash: str = ""
    qos: Qos = field(default_factory=Qos)
    nodes: tuple[str, ...] = ()
    """Full names of their nodes."""
    problem: str = ""
    """Why there are none; empty where there are."""
    reason: Literal["", "absent", "type", "definition"] = ""
    """The same in a word."""
    note: str = ""
    """What is unusual about them."""

    def key(self, domain: int, topic: str) -> str:
        """Return the key expression of the messages."""
        return topic_key(domain, topic, self.type, self.type_hash)


def match_topic(
    key: str,
    topic: Topic,
    accepted: Sequence[str],
    kind: Literal["MP", "MS"],
    entities: Iterable[Entity],
) -> Match:
    """Return the publishers (`MP`) or subscriptions (`MS`) of a topic.

    Args:
        key: Entry of the profile, such as `tf_static`.
        topic: Its topic.
        accepted: Types that are carried, the first preferred.
        kind: Which endpoints.
        entities: The robot's graph.
    """
    all_of_kind = [entity for entity in entities if entity.kind == kind]
    there = [entity for entity in all_of_kind if entity.topic == topic.name]
    if not there:
        verb = "publishes" if kind == "MP" else "subscribes to"
        problem = f"nobody {verb} {topic.name}{_near(topic.name, all_of_kind)}"
        return Match(problem=problem, reason="absent")
    wanted = (topic.type,) if topic.type else tuple(accepted)
    types = sorted({entity.type for entity in there})
    chosen = next((one for one in wanted if one in types), None)
    if chosen is None:
        problem = f"{topic.name} is {', '.join(types)}; needed: {' or '.join(wanted)}"
        return Match(problem=problem, reason="type")
    of_type = [entity for entity in there if entity.type == chosen]
    hashes = {entity.type_hash for entity in of_type}
    known = type_hash(chosen)
    used = next((one for one in (known, NO_HASH) if one in hashes), None)
    if used is None:
        other = min(hashes)[:_DIGITS]
        return Match(
            problem=f"{topic.name} has another definition of {chosen}: its hash is {other}…, of "
            f"the usual one {known[:_DIGITS]}…",
            reason="definition",
        )
    used_by = [entity for entity in of_type if entity.type_hash == used]
    qos = _common_qos(used_by)
    return Match(
        type=chosen,
        type_hash=used,
        qos=qos,
        nodes=tuple(sorted({entity.full_name for entity in used_by})),
        note=_note(key, kind, qos, topic, hashes - {used}),
    )


def _near(name: str, entities: Iterable[Entity]) -> str:
    """Return the topics elsewhere that have the same last name."""
    last = name.rsplit("/", 1)[-1]
    near = sorted({one.topic for one in entities if one.topic.rsplit("/", 1)[-1] == last})
    return f"; there is {', '.join(near[:3])}" if near else ""


def _common_qos(entities: Sequence[Entity]) -> Qos:
    profiles = [entity.qos for entity in entities]
    return Qos(
        reliable=all(qos.reliable for qos in profiles),
        transient_local=all(qos.transient_local for qos in profiles),
        keep_all=any(qos.keep_all for qos in profiles),
        depth=max(qos.depth for qos in profiles),
    )


def _note(key: str, kind: str, qos: Qos, topic: Topic, others: set[str]) -> str:
    notes: list[str] = []
    if kind == "MP" and key in KEPT and not qos.transient_local:
        notes.append(
            f"{topic.name} is published volatile: what was sent before now is lost; publish it "
            "transient local"
        )
    if kind == "MS" and qos.transient_local:
        notes.append(
            f"{topic.name} is subscribed to transient local, but commands are volatile: it gets "
            "none from before it began"
        )
    if others:
        notes.append(f"other nodes have another definition of its type ({min(others)[:_DIGITS]}…)")
    return "; ".join(notes)
