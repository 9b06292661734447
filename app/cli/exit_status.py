"""Exit statuses of the commands."""

from typing import Final

from app.messages.status import GoalStatus

EXIT_NOT_FOUND: Final = 1
EXIT_USAGE: Final = 2
EXIT_FAILED: Final = 3
EXIT_OUT_OF_REACH: Final = 4
"""The object was found, but no path leads close to it."""
EXIT_INTERRUPTED: Final = 130


def exit_status(goal: GoalStatus) -> int:
    """Return the exit status of a command that waited for the end of a search."""
    return {"found": 0, "out_of_reach": EXIT_OUT_OF_REACH}.get(goal.outcome, EXIT_NOT_FOUND)
