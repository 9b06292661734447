"""Messages of whoever drives by hand: modes, points to go to, painted floor, the hand itself."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

DriveModeName = Literal["auto", "assisted", "manual"]


class _Message(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Messages refuse fields that they do not know: a misspelt field is an error."""


class DriveRequest(_Message, frozen=True):
    """Say who drives, and how fast at most: key `drive`."""

    mode: DriveModeName
    speed_limit: Annotated[float, Meta(ge=0.1, le=1.0)] = 1.0
    """Share of the robot's top speeds that every command is kept to."""


class GotoRequest(_Message, frozen=True):
    """Send the robot to a point on the floor: key `goto`."""

    x_m: Annotated[float, Meta(ge=-1e4, le=1e4)] = 0.0
    y_m: Annotated[float, Meta(ge=-1e4, le=1e4)] = 0.0
    cancel: bool = False
    """Go nowhere any more instead."""


class PaintRequest(_Message, frozen=True):
    """Weigh a part of the floor: key `paint`. What is painted counts until it is undone."""

    action: Literal["look_here", "not_here", "undo", "clear"]
    strokes: Annotated[list[tuple[float, float]], Meta(max_length=500)] = []
    """World x and y of the brush, metres."""
    radius_m: Annotated[float, Meta(ge=0.1, le=3.0)] = 0.6


class PaintedStroke(_Message, frozen=True):
    """One stroke of the brush, as it counts now."""

    kind: Literal["look_here", "not_here"]
    strokes: list[tuple[float, float]]
    radius_m: float


class PaintedRegions(_Message, frozen=True):
    """All strokes that count; published on change and kept for late joiners."""

    regions: list[PaintedStroke]


class DriveStatus(_Message, frozen=True):
    """Who drives, and what the safety filter made of it."""

    mode: DriveModeName = "auto"
    speed_limit: float = 1.0
    by_hand: bool = False
    """Commands of the operator arrive now."""
    intervention: str = ""
    """Why the last command was slowed or stopped, empty when it was not."""
    waypoint: tuple[float, float] | None = None
    """Where the operator sent the robot, until it is there."""
    top_linear_m_s: float = 0.0
    """What the robot can do: the hand sends speeds up to these."""
    top_yaw_rate_rad_s: float = 0.0
    top_tilt_rate_rad_s: float = 0.0


class TeleopTag(_Message, frozen=True):
    """Attached to every `teleop/cmd_vel`: whose hand, under which lease, in which order."""

    sender: str
    epoch: int
    """Of the lease."""
    seq: int

    def follows(self, other: "TeleopTag") -> bool:
        """Tell whether this is newer than a message that was taken before."""
        if self.sender != other.sender:
            return self.epoch >= other.epoch
        return (self.epoch, self.seq) > (other.epoch, other.seq)
