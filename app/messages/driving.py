"""Messages for manual driving: drive mode, waypoints, painted regions, teleoperation."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

DriveModeName = Literal["auto", "assisted", "manual"]
WalkingStepName = Literal["turn", "walk", "look", "hold"]
Metres = Annotated[float, Meta(ge=-1e4, le=1e4)]
"""World x or y of a request."""


class _Message(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A message that refuses unknown fields, so that a misspelt field is an error."""


class _Published(Struct, frozen=True, kw_only=True):
    """What everyone may read: fields that a later version adds are ignored."""


class DriveRequest(_Message, frozen=True):
    """Set the drive mode, the speed limit or both: key `drive`. What is None stays."""

    mode: DriveModeName | None = None
    speed_limit: Annotated[float, Meta(ge=0.1, le=1.0)] | None = None
    """Limit of every command as a share of the robot's top speeds."""


class GotoRequest(_Message, frozen=True):
    """Send the robot to a point on the floor: key `goto`."""

    x_m: Metres = 0.0
    y_m: Metres = 0.0
    cancel: bool = False
    """Cancel the waypoint instead."""


class PaintRequest(_Message, frozen=True):
    """Weigh the gain over a part of the floor: key `paint`. Strokes apply until they are undone."""

    action: Literal["look_here", "not_here", "undo", "clear"]
    strokes: Annotated[list[tuple[Metres, Metres]], Meta(max_length=500)] = []
    """World x and y of the brush, metres."""
    radius_m: Annotated[float, Meta(ge=0.1, le=3.0)] = 0.6


class PaintedStroke(_Published, frozen=True):
    """One stroke of the brush."""

    kind: Literal["look_here", "not_here"]
    strokes: list[tuple[float, float]]
    radius_m: float
    room: str = ""
    """Name or type of the room that most of it was in when it was painted; empty for none."""


class PaintedRegions(_Published, frozen=True):
    """All strokes that apply; published on change and stored for late joiners."""

    regions: list[PaintedStroke]


class WalkStatus(_Published, frozen=True):
    """Where the person who carries the camera is to go and look next."""

    step: WalkingStepName
    """What to do first."""
    turn_deg: float
    """To the next corner of the way, at its end to the wanted heading; positive is left."""
    walk_m: float
    """To that corner; 0 at the end of the way."""
    way_m: float
    """Length of the whole way."""
    look_up_deg: float
    """Change of the camera's tilt; positive is up, 0 where it is right."""


class DriveStatus(_Published, frozen=True):
    """Drive mode and interventions of the safety filter."""

    mode: DriveModeName = "auto"
    speed_limit: float = 1.0
    by_hand: bool = False
    """Commands of the operator are arriving."""
    intervention: str = ""
    """Why the last command was slowed or stopped, empty if it was not."""
    waypoint: tuple[float, float] | None = None
    """Waypoint of the operator, until the robot reaches it."""
    top_linear_m_s: float = 0.0
    """Top speeds of the robot, which limit teleoperation."""
    top_yaw_rate_rad_s: float = 0.0
    top_tilt_rate_rad_s: float = 0.0
    body_half_width_m: float = 0.0
    """Half the width of the body; 0 if unknown, like the limits below."""
    slow_within_m: float = 0.0
    """Distance from the robot's centre to an obstacle ahead at which driving straight at the speed
    limit begins to be slowed."""
    stop_within_m: float = 0.0
    """Distance at which it is stopped."""


class TeleopTag(_Message, frozen=True):
    """Attachment of every `teleop/cmd_vel`: sender, lease and sequence number."""

    sender: str
    """`sender_of` the session that holds the lease."""
    epoch: int
    """Epoch of the lease."""
    seq: int

    def follows(self, other: "TeleopTag") -> bool:
        """Return whether this is newer than an accepted message."""
        if self.sender != other.sender:
            return self.epoch >= other.epoch
        return (self.epoch, self.seq) > (other.epoch, other.seq)
