"""Classes of ROS 2 interfaces by their name."""

from __future__ import annotations

import importlib
from typing import Any


def interface(name: str) -> Any:
    """Return the class of a message, service or action, such as sensor_msgs/msg/Image.

    Raises:
        ImportError: ROS 2 has no such package here.
        AttributeError: The package has no such interface.
    """
    package, kind, message = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), message)


def package_of(name: str) -> str:
    """Return the package that has to be installed for an interface."""
    return f"ros-$ROS_DISTRO-{name.split('/', 1)[0].replace('_', '-')}"
