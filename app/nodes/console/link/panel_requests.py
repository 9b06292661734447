"""Requests of the panels to the navigator."""

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
    M,
    PreviewReply,
    PreviewRequest,
    QueueRequest,
    SavedSearchRequest,
    SearchAccepted,
    SearchRequest,
    SentenceReading,
    SentenceRequest,
    VocabularyRequest,
)
from app.messages.driving import GotoRequest, PaintRequest
from app.messages.memory import (
    MemoryNoteRequest,
    MemoryReply,
    MemoryRequest,
    RememberedThing,
    RoomNameRequest,
    RoomsReply,
    RoomsRequest,
)
from app.messages.plain_text import as_sentence
from app.messages.recording import RecordingStatus, RecordRequest
from app.nodes.console.link.commands import PaintAction, RecordAction, StartedSearch
from app.view.words import Words
from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.levels import LevelName

REQUESTER: Final = "console"
PLACES_S: Final = 6.0
"""Timeout for rooms, which are inferred from the map when they are asked for."""
RECORD_S: Final = 10.0
"""Timeout for the recorder, which refuses after 5 s what it has not begun."""
THINGS: Final = 5_000
READ_S: Final = 12.0
"""Timeout for reading a sentence; longer than the navigator's timeout for its language model."""


class PanelRequests(ABC):
    """The `Actions` that are a single request and its reply."""

    recorded = False
    say: Words

    @abstractmethod
    def _request(
        self, topic: str, message: msgspec.Struct, kind: type[M], timeout_s: float | None = None
    ) -> M:
        """Send a request and return its reply.

        Raises:
            CommandError: It was not delivered, or was refused.
        """

    def go_to(self, x_m: float, y_m: float) -> str:
        """Send the robot to a point on the floor."""
        return self._request(keys.GOTO, GotoRequest(x_m=x_m, y_m=y_m), Accepted).detail

    def record(self, action: RecordAction, text: str) -> str:
        """Start or stop recording, or add a note or mark."""
        request = RecordRequest(action=action, text=text, requester=REQUESTER)
        status = self._request(keys.RECORD, request, RecordingStatus, RECORD_S)
        return self.say("reply.stored") if action in {"note", "mark"} else status.text

    def cancel_go_to(self) -> str:
        """Cancel the waypoint."""
        return self._request(keys.GOTO, GotoRequest(cancel=True), Accepted).detail

    def paint(
        self, action: PaintAction, strokes: Sequence[tuple[float, float]], radius_m: float
    ) -> str:
        """Paint or clear search weights on the floor."""
        request = PaintRequest(action=action, strokes=list(strokes), radius_m=radius_m)
        return self._request(keys.PAINT, request, Accepted).detail

    def inspect(self, point_world: tuple[float, float, float]) -> InspectReply:
        """Return what the map stores about a voxel."""
        request = InspectRequest(point_world=point_world)
        return self._request(keys.INSPECT, request, InspectReply)

    def rooms(self) -> RoomsReply:
        """Return the rooms of the map."""
        return self._request(keys.ROOMS, RoomsRequest(), RoomsReply, PLACES_S)

    def name_room(self, x_m: float, y_m: float, name: str) -> str:
        """Name the room at a point; an empty name removes it."""
        request = RoomNameRequest(x_m=x_m, y_m=y_m, name=name)
        self._request(keys.ROOM_NAME, request, RoomsReply, PLACES_S)
        return self.say("reply.room.named" if name.strip() else "reply.room.unnamed")

    def things(self) -> MemoryReply:
        """Return everything that the robot remembers."""
        return self._request(keys.MEMORY, MemoryRequest(limit=THINGS), MemoryReply, PLACES_S)

    def thing_picture(self, instance_id: int) -> bytes:
        """Return the picture of a remembered thing as JPEG; empty if there is none."""
        request = MemoryRequest(limit=1, picture=instance_id)
        return self._request(keys.MEMORY, request, MemoryReply, PLACES_S).picture

    def note_thing(self, request: MemoryNoteRequest) -> str:
        """Say something of a remembered thing."""
        thing = self._request(keys.MEMORY_NOTE, request, RememberedThing)
        kind = self.say.name(thing.label) or self.say("reply.thing")
        if request.deny:
            return self.say("reply.denied", label=self.say.name(request.deny))
        if request.allow:
            return self.say("reply.allowed", label=self.say.name(request.allow))
        return self.say(
            "reply.named" if thing.name else "reply.unnamed", kind=kind, name=thing.name
        )

    def search_for(self, wanted: str) -> str:
        """Start a search for an object of which nothing else is known."""
        return self.search(wanted, "", SearchRequest(object=wanted).scenario).text

    def change_queue(self, request: QueueRequest) -> str:
        """Change the queue of goals."""
        return as_sentence(self._request(keys.QUEUE, request, Accepted).detail)

    def change_saved(self, request: SavedSearchRequest) -> str:
        """Save a search, run or delete a saved one."""
        return as_sentence(self._request(keys.SEARCHES, request, Accepted).detail)

    def preview(self, context: str | None, levels: dict[str, LevelName]) -> PreviewReply:
        """Return the next choice, without changing the search."""
        request = PreviewRequest(context=context, levels=levels)
        return self._request(keys.PREVIEW, request, PreviewReply, READ_S)

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
        request = SearchRequest(
            object=wanted,
            context=context,
            scenario=scenario,
            requester=REQUESTER,
            joins=joins,
            attributes=list(attributes),
            count=count,
            other=other,
        )
        accepted = self._request(keys.SEARCH, request, SearchAccepted)
        name = self.say.name(accepted.object)
        key = "reply.looking" + ".after" * (accepted.position > 0)
        key += ".joined" * (accepted.joined is not None)
        before = accepted.position
        looking = self.say.count(key, before, name=name) if before else self.say(key, name=name)
        text = " ".join([looking, *(as_sentence(note) for note in accepted.notes)])
        return StartedSearch(text, accepted.goal_id)

    def read(self, sentence: str) -> SentenceReading:
        """Read the goals of a sentence; a language model may need seconds for it."""
        request = SentenceRequest(sentence=sentence)
        return self._request(keys.SENTENCE, request, SentenceReading, READ_S)

    def add_label(self, label: str) -> str:
        """Add a label to the vocabulary."""
        request = VocabularyRequest(label=label, requester=REQUESTER)
        return self._request(keys.VOCABULARY, request, Accepted).detail

    def confirm_find(self, goal_id: int | None = None, number: int | None = None) -> str:
        """Confirm the find, in a tour that of a goal, or one of several by its number."""
        request = FeedbackRequest(verdict="confirm", goal_id=goal_id, find=number)
        self._request(keys.FEEDBACK, request, Accepted)
        return self.say("reply.confirmed")

    def reject_find(self, goal_id: int | None = None, number: int | None = None) -> str:
        """Reject the find, or one of several by its number, and continue the search."""
        request = FeedbackRequest(verdict="reject", goal_id=goal_id, find=number)
        self._request(keys.FEEDBACK, request, Accepted)
        return self.say("reply.rejected")

    def set_level(self, label: str, level: LevelName) -> str:
        """Change the proximity level of one label."""
        self._request(keys.GUIDANCE, GuidanceRequest(label=label, level=level), Accepted)
        return self.say(
            "reply.level", label=self.say.name(label), level=self.say(f"panel.level.{level}")
        )
