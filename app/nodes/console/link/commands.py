"""Commands to the navigator: from the page (`Controller`) and from the panels (`Actions`)."""

from collections.abc import Sequence
from typing import Literal, NamedTuple, Protocol

from app.messages.control import (
    ControlRequest,
    PreviewReply,
    QueueRequest,
    SavedSearchRequest,
    SentenceReading,
)
from app.messages.driving import DriveModeName
from app.messages.lease import LeaseReply
from app.messages.memory import MemoryNoteRequest, MemoryReply
from app.nodes.console.web.browsers import Browser
from app.view.words import Words
from ippon.control.drive_mode import TeleopInput
from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.levels import LevelName

LeaseAction = Literal["request", "renew", "release", "grant", "deny", "take"]
PaintAction = Literal["look_here", "not_here", "undo", "clear"]
ClickAction = Literal["explain", "go", "look_here", "not_here"]
"""What a click on the map does; on the plan, too, but for explaining."""
RecordAction = Literal["start", "stop", "note", "mark"]


class StartedSearch(NamedTuple):
    """A search that the navigator has accepted."""

    text: str
    """A line for the operator."""
    goal_id: int


class CommandError(Exception):
    """An operator command failed; the text is shown to the operator."""


class FloorCommands(Protocol):
    """Commands about the floor, from the page and the panels.

    Each waits for the reply, so call it in a thread, and returns a line for the operator. Each
    raises `CommandError` when the command did not arrive or was refused.
    """

    def go_to(self, x_m: float, y_m: float) -> str:
        """Send the robot to a point on the floor."""
        ...

    def paint(
        self, action: PaintAction, strokes: Sequence[tuple[float, float]], radius_m: float
    ) -> str:
        """Paint or clear search weights on the floor."""
        ...


class GoalCommands(Protocol):
    """Commands about finds and goals, from the page and the panels; see `FloorCommands`."""

    def confirm_find(self, goal_id: int | None = None, number: int | None = None) -> str:
        """Confirm the find, in a tour that of a goal, or one of several by its number."""
        ...

    def reject_find(self, goal_id: int | None = None, number: int | None = None) -> str:
        """Reject the find, or one of several by its number, and continue the search."""
        ...

    def change_queue(self, request: QueueRequest) -> str:
        """Change the queue of goals, or search once more for one that has ended."""
        ...


def act_at(
    commands: FloorCommands, action: ClickAction, x_m: float, y_m: float, brush_m: float
) -> str:
    """Do at a point of the floor what was chosen for a click; not for one that explains.

    Raises:
        CommandError: See `FloorCommands`.
    """
    if action == "go":
        return commands.go_to(x_m, y_m)
    painted = "look_here" if action == "look_here" else "not_here"
    return commands.paint(painted, [(x_m, y_m)], brush_m)


class Controller(FloorCommands, GoalCommands, Protocol):
    """Sends requests of the page to the navigator."""

    async def control(self, request: ControlRequest) -> str:
        """Send a control request and return the resulting state.

        Raises:
            CommandError: The command was not delivered, or was refused.
        """
        ...

    async def drive(self, mode: DriveModeName) -> str:
        """Set the drive mode; the speed limit stays.

        Raises:
            CommandError: The command was not delivered, or was refused.
        """
        ...

    async def lease(self, action: LeaseAction, requester: str = "") -> LeaseReply:
        """Request, renew, release, grant, deny or take control for the acting browser.

        Args:
            action: What to do.
            requester: Name of who is granted or denied control; empty for whoever asks.

        Raises:
            CommandError: It was not delivered, or was refused.
        """
        ...

    def name_room(self, x_m: float, y_m: float, name: str) -> str:
        """Name the room at a point; waits for the reply, so call it in a thread.

        Raises:
            CommandError: It was not delivered, or was refused.
        """
        ...

    def things(self) -> MemoryReply:
        """Return what the robot remembers; waits for the reply, so call it in a thread.

        Raises:
            CommandError: It was not delivered, or was refused.
        """
        ...

    def thing_picture(self, instance_id: int) -> bytes:
        """Return the picture of a remembered thing as JPEG, empty for none; call it in a thread.

        Raises:
            CommandError: It was not delivered, or was refused.
        """
        ...

    def note_thing(self, request: MemoryNoteRequest) -> str:
        """Say something of a remembered thing; waits for the reply, so call it in a thread.

        Raises:
            CommandError: It was not delivered, or was refused.
        """
        ...

    def search_for(self, wanted: str) -> str:
        """Start a search for an object; waits for the reply, so call it in a thread.

        Raises:
            CommandError: It was not delivered, or was refused.
        """
        ...

    def change_saved(self, request: SavedSearchRequest) -> str:
        """Save a search, run or delete a saved one; waits for the reply, so call it in a thread.

        Raises:
            CommandError: It was not delivered, or was refused.
        """
        ...

    def may_use_panels(self, browser: Browser) -> bool:
        """Return whether a browser may use the panels: no other browser has control."""
        ...

    def send_input(self, held: TeleopInput) -> None:
        """Send the keys that an operator holds down, at once and without a reply."""
        ...


class Actions(FloorCommands, GoalCommands, Protocol):
    """Commands of the panels: each waits for the reply and returns a line for the operator.

    Each raises `CommandError` when the command did not arrive or was refused.
    """

    recorded: bool
    """Whether a recording is shown, without a robot."""
    say: Words
    """The words of the replies, and of the panels."""

    def search(
        self,
        wanted: str,
        context: str,
        scenario: str,
        *,
        joins: int | None = None,
        attributes: Sequence[Attribute] = (),
        count: int | Literal["all"] = 1,
        other: bool = False,
    ) -> StartedSearch:
        """Start a search for an object, in one tour with the goal numbered `joins` if given."""
        ...

    def read(self, sentence: str) -> SentenceReading:
        """Read the goals of a sentence, without starting a search."""
        ...

    def add_label(self, label: str) -> str:
        """Add a label to the vocabulary."""
        ...

    def set_level(self, label: str, level: LevelName) -> str:
        """Change the proximity level of one label."""
        ...

    def pause(self) -> str:
        """Pause the robot."""
        ...

    def resume(self) -> str:
        """Resume after a pause or a stop."""
        ...

    def cancel(self) -> str:
        """End the current search."""
        ...

    def record(self, action: RecordAction, text: str) -> str:
        """Start or stop recording, or add a note or mark."""
        ...

    def set_drive(self, mode: DriveModeName | None = None, speed_limit: float | None = None) -> str:
        """Set the drive mode, the speed limit or both; what is None stays."""
        ...

    def cancel_go_to(self) -> str:
        """Cancel the waypoint."""
        ...

    def preview(self, context: str | None, levels: dict[str, LevelName]) -> PreviewReply:
        """Return the next choice with another context or levels, without changing the search."""
        ...
