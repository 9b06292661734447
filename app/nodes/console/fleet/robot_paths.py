"""Paths of the robots' pages: /robot/NAME/, with `~` for the slashes of a name."""

import re
from typing import Final

_PATH: Final = re.compile(r"/robot/([A-Za-z0-9_.~-]{1,100})(/.*)?")


def path_of(robot: str) -> str:
    """Return the path of a robot's page."""
    return f"/robot/{robot.replace('/', '~')}/"


def split_path(path: str) -> tuple[str, str] | None:
    """Return the robot of a path, and the path below its page; None for another path."""
    found = _PATH.fullmatch(path)
    return None if found is None else (found[1].replace("~", "/"), found[2] or "")


def page_path(path: str) -> str:
    """Return a path as it is below the page of its robot: "/" for every robot's page."""
    found = split_path(path)
    return path if found is None else found[1] or "/"
