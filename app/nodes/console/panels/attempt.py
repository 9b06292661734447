"""Commands of a panel, with their results in a line of it."""

from collections.abc import Callable
from typing import Any

from app.nodes.console.link.commands import CommandError
from app.nodes.console.panels.markup import answer

Try = Callable[[Callable[[], str]], None]
"""Runs a command of a part of a panel."""


def attempt(line: Any, command: Callable[[], str]) -> bool:
    """Run a command and show its result in a line; return whether it was carried out."""
    try:
        line.content = answer(command(), ok=True)
    except CommandError as error:
        line.content = answer(str(error), ok=False)
        return False
    return True
