"""Quality of service of the bridge's subscriptions."""

# pyright: reportMissingImports=false
from __future__ import annotations

from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from .settings import IMAGES, KEPT


def qos_of(key: str, publishers: list[Any]) -> QoSProfile:
    """Return a quality of service that all publishers of a topic can serve."""
    profiles = [publisher.qos_profile for publisher in publishers]
    reliable = all(one.reliability == ReliabilityPolicy.RELIABLE for one in profiles)
    transient = key in KEPT and all(
        one.durability == DurabilityPolicy.TRANSIENT_LOCAL for one in profiles
    )
    # Of images only the newest counts; poses are interpolated and need each.
    return QoSProfile(
        depth=2 if key in IMAGES else 100,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if transient else DurabilityPolicy.VOLATILE,
    )
