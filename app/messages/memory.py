"""What is remembered: requests on key `memory`, and where the robot is in a map of another day."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from ippon.geometry import Float64Array, base_pose


class MemoryRequest(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Ask where something is, or was last; the robot does not move for it."""

    find: Annotated[str, Meta(max_length=80)] = ""
    """What to look for, in your own words; empty for everything."""
    limit: Annotated[int, Meta(ge=1, le=10_000)] = 50
    """Largest number of things in the reply."""
    picture: int | None = None
    """Number of a thing whose picture is wanted, too."""


class RememberedThing(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One thing that is remembered."""

    instance_id: int
    label: str
    """Most probable one that nobody has denied; empty where all were."""
    probability: float
    """That it is what was asked for; without a question, that it has this label."""
    alternatives: list[tuple[str, float]]
    """Other labels that it may have, with their probabilities."""
    source: Literal["map", "search"]
    """`search`: found by a search for it; `map`: one of the common objects."""
    position_world: tuple[float, float, float]
    size_m: tuple[float, float, float]
    room: str
    """Empty where that is not clear."""
    first_seen_ns: int
    """Clock of the navigator's machine, nanoseconds since 1970, like all times here."""
    last_seen_ns: int
    gone_ns: int
    """When it was noticed that it is not there any more; 0 while it is."""
    has_picture: bool
    attributes: list[str] = []
    """What a search has seen of it: "red", "large"."""
    name: str = ""
    """What a person calls it; empty for nothing."""
    denied: list[str] = []
    """Labels that it does not have, as a person said."""


class MemoryReply(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Reply to `MemoryRequest`: what is there comes first, then the surer, then the later seen."""

    things: list[RememberedThing]
    count: int
    """Number of all things that answer the question."""
    picture: bytes = b""
    """JPEG (base64 in JSON) of the thing that was asked for; empty where there is none."""
    note: str = ""
    """What is wrong with the memory."""


class MemoryNoteRequest(
    Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True
):
    """Say something of a remembered thing: key `memory/note`. The reply is the thing."""

    instance_id: int
    name: Annotated[str, Meta(max_length=200)] | None = None
    """What it is called from now on, in requests, too; empty to remove the name."""
    deny: Annotated[str, Meta(max_length=80)] = ""
    """Label that it may have and does not: it is no find in a search for that."""
    allow: Annotated[str, Meta(max_length=80)] = ""
    """Label that was denied and that it may have after all, from the next search on."""


class Room(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One room of the map."""

    x_m: float
    """World x and y where its name is written."""
    y_m: float
    area_m2: float
    kind: str
    """Type, such as "kitchen"; empty if unclear."""
    name: str
    """Name that a person has given; empty for none."""


class RoomsRequest(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Ask for the rooms of the map: key `rooms`."""


class RoomNameRequest(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Name the room at a point of the map: key `rooms/name`. The name is kept with the map."""

    x_m: Annotated[float, Meta(ge=-1e4, le=1e4)]
    y_m: Annotated[float, Meta(ge=-1e4, le=1e4)]
    name: Annotated[str, Meta(max_length=200)]
    """Empty to remove the name."""


class RoomsReply(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Reply to both: the rooms, the largest first."""

    rooms: list[Room]
    note: str = ""
    """Why names are not kept."""


class MapAlignment(Struct, frozen=True, kw_only=True):
    """Pose of the frame of tf in the frame of the map: key `map/alignment`, kept for late joiners.

    Everything else that the navigator publishes is in the frame of the map.
    """

    position_map: tuple[float, float, float]
    """Metres."""
    yaw_rad: float

    def as_transform(self) -> Float64Array:
        """Return T_map_world (4, 4), from the frame of tf to that of the map."""
        return base_pose(*self.position_map, self.yaw_rad)
