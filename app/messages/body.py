"""The body of a robot, as the configuration of its navigator has it: key `configuration`."""

from typing import Annotated

from msgspec import Meta, Struct

Metres = Annotated[float, Meta(ge=-30.0, le=30.0)]


class BodySphere(Struct, frozen=True, kw_only=True):
    """A sphere of the body in the base frame, whose origin is on the floor."""

    x_m: Metres
    y_m: Metres
    z_m: Metres
    radius_m: Annotated[float, Meta(gt=0.0, le=30.0)]


class BodyProfile(Struct, frozen=True, kw_only=True):
    """What of a robot's profile is drawn."""

    name: str
    spheres: Annotated[list[BodySphere], Meta(min_length=1, max_length=500)]
    """They enclose the body."""


class BodyConfiguration(Struct, frozen=True, kw_only=True):
    """The part of a navigator's configuration with the body; its other fields are skipped."""

    robot: str
    profile: BodyProfile | None = None
    """None where the configuration leaves it to the default."""
