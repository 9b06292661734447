"""A robot that is longer than wide, as walking ones are."""

import dataclasses

from ippon.robot import ZED, CollisionSphere

LONG = dataclasses.replace(
    ZED,
    name="long",
    spheres=(
        *(CollisionSphere(x_m=x, y_m=0.0, z_m=0.38, radius_m=0.27) for x in (-0.2, 0.0, 0.2)),
        *(CollisionSphere(x_m=0.0, y_m=0.0, z_m=z, radius_m=0.2) for z in (0.8, 1.0)),
    ),
)
"""0.94 m long and 0.54 m wide, with a mast."""
