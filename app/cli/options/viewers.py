"""Options of the commands that show a running robot in other programs."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Foxglove:
    """Serve a running robot to Foxglove: images, map, viewpoints, path, finds, status, log.

    In Foxglove, open a connection to ws://127.0.0.1:8765. It takes no commands. It waits for a
    navigator that does not run yet, and shows when one is not heard.
    """

    connect: str | None = None
    """zenoh endpoint of the navigator; by default the navigator running on this machine."""
    robot: str | None = None
    """Key prefix of the robot; by default that of the navigator running on this machine."""
    host: str = "127.0.0.1"
    """Address to listen on. Foxglove's protocol has no login: whoever reaches another address than
    the default sees the robot's camera."""
    port: int = 8765
    """Port to listen on; 0 selects any free port."""
    layout: Path | None = None
    """Write the layout of panels to this file and exit. In Foxglove: Layouts, Import from file."""
    ceiling_m: float = 1.4
    """Height above the robot's floor from which on the map is hidden, so that one looks into rooms
    from above."""
    parent_pid: int | None = None
    """Exit when this process has ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rerun:
    """Stream a running robot to Rerun: images, map, viewpoints, path, finds, status, events.

    Starts Rerun's viewer on this machine, unless `--url` or `--save` names another place. It waits
    for a navigator that does not run yet, and shows when one is not heard.
    """

    connect: str | None = None
    """zenoh endpoint of the navigator; by default the navigator running on this machine."""
    robot: str | None = None
    """Key prefix of the robot; by default that of the navigator running on this machine."""
    url: str | None = None
    """Viewer that runs already, such as rerun+http://192.168.1.20:9876/proxy."""
    save: Path | None = None
    """Write to this file (.rrd) instead of a viewer."""
    ceiling_m: float = 1.4
    """Height above the robot's floor from which on the map is hidden, so that one looks into rooms
    from above."""
    parent_pid: int | None = None
    """Exit when this process has ended."""
