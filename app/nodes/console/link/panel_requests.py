"""What the panels ask of the navigator, each as one request."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Final, Literal

import msgspec

from app.messages import keys
from app.messages.control import (
    Accepted,
    FeedbackRequest,
    GuidanceRequest,
    InspectReply,
    InspectRequest,
    LevelName,
    M,
    PreviewReply,
    PreviewRequest,
    QueueRequest,
    SearchAccepted,
    SearchRequest,
    SentenceReading,
    SentenceRequest,
    VocabularyRequest,
)
from app.messages.driving import GotoRequest, PaintRequest
from app.messages.recording import RecordingStatus, RecordRequest
from app.nodes.console.link.commands import PaintAction, RecordAction

REQUESTER: Final = "console"
READ_S: Final = 12.0
"""So long a sentence may take: longer than the navigator gives its language model."""


class PanelRequests(ABC):
    """The part of `Actions` that needs nothing but a way to ask."""

    recorded = False

    @abstractmethod
    def _request(
        self, topic: str, message: msgspec.Struct, kind: type[M], timeout_s: float | None = None
    ) -> M:
        """Send a request and return its reply.

        Raises:
            CommandError: It did not arrive, or was refused.
        """

    def go_to(self, x_m: float, y_m: float) -> str:
        """Send the robot to a point on the floor."""
        return self._request(keys.GOTO, GotoRequest(x_m=x_m, y_m=y_m), Accepted).detail

    def record(self, action: RecordAction, text: str) -> str:
        """Begin or end recording, or write a note or mark beside it."""
        request = RecordRequest(action=action, text=text, requester=REQUESTER)
        status = self._request(keys.RECORD, request, RecordingStatus)
        return "Written beside the recording." if action in {"note", "mark"} else status.text

    def cancel_go_to(self) -> str:
        """Send it nowhere any more."""
        return self._request(keys.GOTO, GotoRequest(cancel=True), Accepted).detail

    def paint(
        self, action: PaintAction, strokes: Sequence[tuple[float, float]], radius_m: float
    ) -> str:
        """Weigh a part of the floor, or take that back."""
        request = PaintRequest(action=action, strokes=list(strokes), radius_m=radius_m)
        return self._request(keys.PAINT, request, Accepted).detail

    def inspect(self, point_world: tuple[float, float, float]) -> InspectReply:
        """Ask what the map knows of a voxel."""
        request = InspectRequest(point_world=point_world)
        return self._request(keys.INSPECT, request, InspectReply)

    def reorder(self, goal_id: int, action: Literal["first", "remove"]) -> str:
        """Let a waiting goal come next, or cancel it."""
        request = QueueRequest(goal_id=goal_id, action=action)
        return self._request(keys.QUEUE, request, Accepted).detail

    def preview(self, context: str | None, levels: dict[str, LevelName]) -> PreviewReply:
        """Ask what would be chosen next; nothing changes by it."""
        request = PreviewRequest(context=context, levels=levels)
        return self._request(keys.PREVIEW, request, PreviewReply, READ_S)

    def search(self, wanted: str, context: str, scenario: str) -> str:
        """Look for an object."""
        request = SearchRequest(
            object=wanted, context=context, scenario=scenario, requester=REQUESTER
        )
        accepted = self._request(keys.SEARCH, request, SearchAccepted)
        name = accepted.object.replace("_", " ")
        when = "" if accepted.position == 0 else f", after {_goals(accepted.position)}"
        notes = [f"{note[:1].upper()}{note[1:]}." for note in accepted.notes]
        return " ".join([f"Looking for: {name}{when}.", *notes])

    def read(self, sentence: str) -> SentenceReading:
        """Have one sentence taken apart; a language model may take its time over it."""
        request = SentenceRequest(sentence=sentence)
        return self._request(keys.SENTENCE, request, SentenceReading, READ_S)

    def add_label(self, label: str) -> str:
        """Tell one more kind of common object apart from now on."""
        request = VocabularyRequest(label=label, requester=REQUESTER)
        return self._request(keys.VOCABULARY, request, Accepted).detail

    def confirm_find(self) -> str:
        """Say that the find is the object."""
        self._request(keys.FEEDBACK, FeedbackRequest(verdict="confirm"), Accepted)
        return "Confirmed."

    def reject_find(self) -> str:
        """Say that the find is something else, and go on."""
        self._request(keys.FEEDBACK, FeedbackRequest(verdict="reject"), Accepted)
        return "Understood: the search goes on, and this place is remembered."

    def set_level(self, label: str, level: LevelName) -> str:
        """Change the proximity level of one label."""
        self._request(keys.GUIDANCE, GuidanceRequest(label=label, level=level), Accepted)
        return f"{label.replace('_', ' ')} is now {level}."


def _goals(count: int) -> str:
    return "1 other goal" if count == 1 else f"{count} other goals"
