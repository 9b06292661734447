"""Bids: would a robot take a search, and how far would it have to go? Key `bid`."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from app.messages.control import SearchRequest

ShortText = Annotated[str, Meta(max_length=300)]
Obstacle = Literal[
    "", "starting", "searching", "found", "held", "manual", "stopped", "paused", "lost"
]
"""Why a robot would not take a search; empty where it would.

`starting` and `lost`: no data of the robot, or its pose is not known; `found`: its last find has
just been announced; `held`: somebody else has control; `manual`: a person drives it.
"""
Ground = Literal["room", "thing", "area", "unknown"]
"""What a robot knows of the place of a search.

`room`: the room that was said is in its map; `thing`: no room was said, and it remembers where the
object is; `area`: no room was said, and it has explored some floor; `unknown`: its map does not
have the room that was said, or is empty.
"""


class BidRequest(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Ask whether a robot would take a search: key `bid`. It does not move, and nothing is queued.

    With a `Credential` attached, a robot that the requester has control of counts as free.
    """

    search: SearchRequest


class Bid(Struct, frozen=True, kw_only=True):
    """Reply to `BidRequest`. Fields of later versions are ignored."""

    obstacle: Obstacle
    detail: ShortText = ""
    """What is searched for, who has control, or what is missing."""
    ground: Ground
    place: ShortText = ""
    """The room by the name that people have given it, else by its type; of a `thing` what it is."""
    room: ShortText = ""
    """Of a `thing`: the room that it is in; empty where that is not clear."""
    way_m: Annotated[float, Meta(ge=0.0, le=1e6)] | None = None
    """Length of the way from the robot to the place over its own map; 0 for `area`, None where it
    knows no way."""
    explored_m2: Annotated[float, Meta(ge=0.0)] = 0.0
    """Floor that it has explored."""

    @property
    def is_free(self) -> bool:
        """It would take the search."""
        return self.obstacle == ""
