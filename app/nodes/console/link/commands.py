"""What the page and the panels ask of the navigator."""

from collections.abc import Sequence
from typing import Literal, Protocol

from ippon.control.drive_mode import TeleopInput

from app.messages.control import ControlRequest, LevelName, PreviewReply, SentenceReading
from app.messages.driving import DriveModeName
from app.messages.lease import LeaseReply
from app.nodes.console.web.browsers import Browser

LeaseAction = Literal["request", "renew", "release", "grant", "deny", "take"]
PaintAction = Literal["look_here", "not_here", "undo", "clear"]


RecordAction = Literal["start", "stop", "note", "mark"]


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

    async def drive(self, mode: DriveModeName, speed_limit: float | None = None) -> str:
        """Say who drives; without a limit the last one stays.

        Raises:
            CommandError: The command did not arrive, or was refused.
        """
        ...

    async def lease(self, action: LeaseAction) -> LeaseReply:
        """Ask for control in the acting browser's name, keep it, or hand it on.

        Raises:
            CommandError: It did not arrive, or was refused.
        """
        ...

    def may_touch(self, browser: Browser) -> bool:
        """Tell whether a browser may use the panels: nobody else holds control."""
        ...

    def send_input(self, hand: TeleopInput) -> None:
        """Pass on what an operator holds down; at once, and without an answer."""
        ...


class Actions(Protocol):
    """Commands of the panels: each waits for the reply and returns a line for the operator.

    Each raises `CommandError` when the command did not arrive or was refused.
    """

    recorded: bool
    """What is shown was recorded: there is no robot, and nothing to record."""

    def search(self, wanted: str, context: str, scenario: str) -> str:
        """Look for an object."""
        ...

    def read(self, sentence: str) -> SentenceReading:
        """Have one sentence taken apart; nothing is searched for yet."""
        ...

    def add_label(self, label: str) -> str:
        """Tell one more kind of common object apart from now on."""
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

    def record(self, action: RecordAction, text: str) -> str:
        """Begin or end recording, or write a note or mark beside it."""
        ...

    def set_drive(self, mode: DriveModeName, speed_limit: float) -> str:
        """Say who drives, and how fast at most."""
        ...

    def go_to(self, x_m: float, y_m: float) -> str:
        """Send the robot to a point on the floor."""
        ...

    def cancel_go_to(self) -> str:
        """Send it nowhere any more."""
        ...

    def reorder(self, goal_id: int, action: Literal["first", "remove"]) -> str:
        """Let a waiting goal come next, or cancel it."""
        ...

    def preview(self, context: str | None, levels: dict[str, LevelName]) -> PreviewReply:
        """Ask what would be chosen next with another context or levels; nothing changes."""
        ...

    def paint(
        self, action: PaintAction, strokes: Sequence[tuple[float, float]], radius_m: float
    ) -> str:
        """Weigh a part of the floor, or take that back."""
        ...
