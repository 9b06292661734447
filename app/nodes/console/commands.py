"""What the page and the panels ask of the navigator."""

from typing import Protocol

from app.messages.control import ControlRequest, LevelName


class CommandError(Exception):
    """A command of the operator had no effect; the text is for the operator."""


class Controller(Protocol):
    """Whoever hands a control request to the navigator."""

    async def control(self, request: ControlRequest) -> str:
        """Return the state that followed.

        Raises:
            CommandError: The command did not arrive, or was refused.
        """
        ...


class Actions(Protocol):
    """Commands of the panels: each waits for the reply and returns a line for the operator.

    Each raises `CommandError` when the command did not arrive or was refused.
    """

    def search(self, wanted: str, context: str) -> str:
        """Look for an object."""
        ...

    def confirm_find(self) -> str:
        """Say that the find is the object."""
        ...

    def reject_find(self) -> str:
        """Say that the find is something else, and go on."""
        ...

    def set_level(self, label: str, level: LevelName) -> str:
        """Change the proximity level of one label."""
        ...

    def pause(self) -> str:
        """Wait where the robot is."""
        ...

    def resume(self) -> str:
        """Go on after a pause or a stop."""
        ...

    def cancel(self) -> str:
        """End the current search."""
        ...
