"""Liveliness tokens of rmw_zenoh: one for each node, publisher and subscription of a robot.

`@ros2_lv/DOMAIN/SESSION/NODE/ID/KIND/ENCLAVE/NAMESPACE/NAME`, and for a publisher or subscription
`/TOPIC/TYPE/HASH/QOS` after it. Newer versions may append parts of their own, which are not read.
"""

from dataclasses import dataclass, field
from typing import Final, Literal, get_args

from app.links.rmw_zenoh.protocol.names import dds_type, demangled, mangled, ros_type, topic_key

SPACE: Final = "@ros2_lv"
DEFAULT_DEPTH: Final = 42
"""Depth of a history for which the token says nothing."""

Kind = Literal["NN", "MP", "MS", "SS", "SC"]
"""Node, publisher, subscription, service, client."""
_NODE_PARTS: Final = 9
_TOPIC_PARTS: Final = 13


@dataclass(frozen=True, slots=True, kw_only=True)
class Qos:
    """Quality of service, as far as it matters here."""

    reliable: bool = True
    transient_local: bool = False
    """Late subscribers get the last messages."""
    keep_all: bool = False
    depth: int = DEFAULT_DEPTH

    def __str__(self) -> str:
        """Return it in words."""
        reliability = "reliable" if self.reliable else "best effort"
        return f"{reliability}, transient local" if self.transient_local else reliability


@dataclass(frozen=True, slots=True, kw_only=True)
class Entity:
    """A node, publisher, subscription, service or client in the ROS graph."""

    domain: int
    session: str
    """zenoh's identifier of the session."""
    node_id: int
    entity_id: int
    kind: Kind
    namespace: str = "/"
    node: str
    enclave: str = ""
    topic: str = ""
    """Full name; empty for a node."""
    type: str = ""
    """ROS 2 type, such as `sensor_msgs/msg/Image`."""
    type_hash: str = ""
    qos: Qos = field(default_factory=Qos)

    @property
    def full_name(self) -> str:
        """Name of the node with its namespace."""
        return f"{self.namespace.rstrip('/')}/{self.node}"

    @property
    def key(self) -> str:
        """Key expression of the messages."""
        return topic_key(self.domain, self.topic, self.type, self.type_hash)


def token_of(entity: Entity) -> str:
    """Return the key of an entity's token."""
    parts = [
        SPACE, str(entity.domain), entity.session, str(entity.node_id), str(entity.entity_id),
        entity.kind, mangled(entity.enclave), mangled(entity.namespace), mangled(entity.node),
    ]  # fmt: skip
    if entity.kind != "NN":
        parts += [
            mangled(entity.topic), dds_type(entity.type), entity.type_hash, encode_qos(entity.qos)
        ]  # fmt: skip
    return "/".join(parts)


def read_token(key: str) -> Entity:
    """Return what a token says.

    Raises:
        ValueError: It is no token of rmw_zenoh.
    """
    parts = key.split("/")
    kind = parts[5] if len(parts) > 5 else ""
    least = _NODE_PARTS if kind == "NN" else _TOPIC_PARTS
    if parts[0] != SPACE or kind not in get_args(Kind) or len(parts) < least or not all(parts):
        raise ValueError(f"not a token of rmw_zenoh: {key[:200]!r}")
    numbers = [parts[1], *parts[3:5]]
    if not all(number.isdecimal() for number in numbers):
        raise ValueError(f"a token of rmw_zenoh has a number that is none: {key[:200]!r}")
    domain, node_id, entity_id = map(int, numbers)
    topic = dict[str, str]()
    if kind != "NN":
        topic = {"topic": demangled(parts[9]), "type": ros_type(parts[10]), "type_hash": parts[11]}
    return Entity(
        domain=domain,
        session=parts[2],
        node_id=node_id,
        entity_id=entity_id,
        kind=kind,  # pyright: ignore[reportArgumentType]
        enclave=demangled(parts[6]).strip("/"),
        namespace=demangled(parts[7]),
        node=demangled(parts[8]),
        qos=Qos() if kind == "NN" else decode_qos(parts[12]),
        **topic,
    )


def encode_qos(qos: Qos) -> str:
    """Return a quality of service as a token has it; what is the default is left out."""
    reliability = "" if qos.reliable else "2"
    durability = "1" if qos.transient_local else ""
    history = "2" if qos.keep_all else ""
    depth = "" if qos.depth == DEFAULT_DEPTH else str(qos.depth)
    return f"{reliability}:{durability}:{history},{depth}:,:,:,,"


def decode_qos(text: str) -> Qos:
    """Return the quality of service in a token; deadline, lifespan and lease are not read.

    Raises:
        ValueError: It is none.
    """
    parts = text.split(":")
    history, comma, depth = parts[2].partition(",") if len(parts) >= 6 else ("", "", "")
    values = [*parts[:2], history, depth]
    if not comma or not all(value == "" or value.isdecimal() for value in values):
        raise ValueError(f"not a quality of service of rmw_zenoh: {text[:100]!r}")
    return Qos(
        reliable=parts[0] != "2",
        transient_local=parts[1] == "1",
        keep_all=history == "2",
        depth=int(depth) if depth else DEFAULT_DEPTH,
    )
