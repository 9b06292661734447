"""All services that answer requests, and the table of their endpoints."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal

import msgspec
import zenoh

from app.links.language_model.interface import LanguageModelInterface
from app.links.network.latched_topic import LatchedTopic
from app.links.network.query_queue import QueryQueue
from app.links.network.requests import Authorize, allow_all, serve, serve_with_credential
from app.links.network.sender import Sender
from app.messages import keys
from app.messages.control import (
    BidRequest,
    ControlRequest,
    FeedbackRequest,
    GuidanceRequest,
    InspectRequest,
    PictureRequest,
    PreviewRequest,
    QueueRequest,
    SavedSearchRequest,
    SearchRequest,
    SentenceRequest,
    VocabularyRequest,
    is_stop,
)
from app.messages.driving import DriveRequest, GotoRequest, PaintRequest
from app.messages.lease import Credential, LeaseRequest, TakeRequest
from app.messages.memory import RoomNameRequest, RoomsRequest
from app.nodes.navigator.command.command_mux import CommandMux
from app.nodes.navigator.command.command_stream import CommandStream
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.event_publisher import EventPublisher
from app.nodes.navigator.services.bid_service import BidService
from app.nodes.navigator.services.drive_service import DriveService
from app.nodes.navigator.services.goal_service import GoalService
from app.nodes.navigator.services.guidance_service import GuidanceService
from app.nodes.navigator.services.lease_service import LeaseService
from app.nodes.navigator.services.operation_queue import OperationQueue
from app.nodes.navigator.services.opinion_service import OpinionService
from app.nodes.navigator.services.preview_service import PreviewService
from app.nodes.navigator.services.queue_service import QueueService
from app.nodes.navigator.services.room_service import RoomService
from app.nodes.navigator.services.saved_search_service import SavedSearchService
from app.nodes.navigator.services.sentence_service import SentenceService
from app.nodes.navigator.state.goal_queue import GoalQueue
from ippon.planning.floor_ways import FloorSurvey


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A key, its type of request, and the method that answers it."""

    key: str
    request: type[msgspec.Struct]
    service: type
    handle: Callable[..., msgspec.Struct]
    """Method of `service`; called in the thread of the key, which answers one
    request at a time."""
    access: Literal["holder", "everyone", "credential"]
    """Whose requests are accepted: the holder's of the lease, everyone's, or everyone's with the
    credential handed to the method."""
    on_stop: Callable[[Any], None] | None = None
    """Method of `service` for a Stop, called in zenoh's network thread."""


ENDPOINTS: Final = (
    Endpoint(keys.SEARCH, SearchRequest, GoalService, GoalService.search, "holder"),
    Endpoint(keys.BID, BidRequest, BidService, BidService.bid, "credential"),
    Endpoint(
        keys.CONTROL, ControlRequest, GoalService, GoalService.control, "holder", GoalService.hold
    ),
    Endpoint(keys.FEEDBACK, FeedbackRequest, GoalService, GoalService.feedback, "holder"),
    Endpoint(keys.GUIDANCE, GuidanceRequest, GuidanceService, GuidanceService.set_level, "holder"),
    Endpoint(
        keys.VOCABULARY, VocabularyRequest, GuidanceService, GuidanceService.add_label, "holder"
    ),
    Endpoint(keys.SENTENCE, SentenceRequest, SentenceService, SentenceService.read, "everyone"),
    Endpoint(
        keys.PICTURE, PictureRequest, SentenceService, SentenceService.read_picture, "everyone"
    ),
    Endpoint(keys.DRIVE, DriveRequest, DriveService, DriveService.drive, "holder"),
    Endpoint(keys.GOTO, GotoRequest, DriveService, DriveService.go_to, "holder"),
    Endpoint(keys.QUEUE, QueueRequest, QueueService, QueueService.queue, "holder"),
    Endpoint(
        keys.SEARCHES, SavedSearchRequest, SavedSearchService, SavedSearchService.change, "holder"
    ),
    Endpoint(keys.PAINT, PaintRequest, DriveService, DriveService.paint, "holder"),
    Endpoint(keys.INSPECT, InspectRequest, PreviewService, PreviewService.inspect, "everyone"),
    Endpoint(keys.PREVIEW, PreviewRequest, PreviewService, PreviewService.preview, "everyone"),
    Endpoint(keys.ROOMS, RoomsRequest, RoomService, RoomService.rooms, "everyone"),
    Endpoint(keys.ROOM_NAME, RoomNameRequest, RoomService, RoomService.rename, "holder"),
    Endpoint(keys.LEASE, LeaseRequest, LeaseService, LeaseService.ask, "credential"),
    Endpoint(keys.LEASE_TAKE, TakeRequest, LeaseService, LeaseService.take, "credential"),
)


def declare_endpoints(
    session: zenoh.Session, robot: str, service: object, authorize: Authorize = allow_all
) -> list[QueryQueue]:
    """Declare the endpoints of one service; they exist as long as the returned objects.

    Args:
        session: An open session.
        robot: Key prefix.
        service: Instance of a service of `ENDPOINTS`.
        authorize: Checks requests that only the holder of the lease may send.
    """
    return [
        _declare(session, f"{robot}/{endpoint.key}", endpoint, service, authorize)
        for endpoint in ENDPOINTS
        if isinstance(service, endpoint.service)
    ]


def _declare(
    session: zenoh.Session, key: str, endpoint: Endpoint, service: object, authorize: Authorize
) -> QueryQueue:
    def handle(*request: Any) -> msgspec.Struct:
        return endpoint.handle(service, *request)

    if endpoint.access == "credential":
        return serve_with_credential(session, key, endpoint.request, handle)
    check = authorize if endpoint.access == "holder" else allow_all
    on_stop = None if endpoint.on_stop is None else partial(endpoint.on_stop, service)
    return serve(session, key, endpoint.request, handle, check, on_stop)


class RequestServices:
    """Makes the services and declares their endpoints; their state is owned by the caller."""

    def __init__(
        self,
        session: zenoh.Session,
        config: NavigatorConfig,
        goals: GoalQueue,
        stream: CommandStream,
        *,
        operations: OperationQueue,
        events: EventPublisher,
        sender: Sender,
        model: LanguageModelInterface | None,
    ) -> None:
        robot = config.robot
        self._operations = operations
        self.control = LeaseService()
        self.guidance = GuidanceService(
            config.labels,
            goals,
            model=model,
            look_every_s=config.look_every_s,
            operations=operations,
            report_event=events.report,
        )
        self.goals = GoalService(goals, self.guidance, stop_latch=stream, operations=operations)
        survey = FloorSurvey(config.mission.planner.traversability, config.profile)
        self.bids = BidService(survey, operations, self.goals, self.control)
        self.mux = CommandMux(
            session,
            robot,
            config.profile,
            stream,
            config.stale_s,
            refusal=self.control.teleop_refusal,
            on_takeover=lambda: operations.enqueue(lambda mission: mission.operator.cancel_go_to()),
        )
        painted = LatchedTopic(session, f"{robot}/{keys.PAINTED}", sender)
        self.drive = DriveService(self.mux, operations, painted, config.profile)
        self.queue = QueueService(goals, self.guidance, self.goals)
        saved = LatchedTopic(session, f"{robot}/{keys.SEARCHES_SAVED}", sender)
        keep = Path(config.keep_searches) if config.keep_searches else None
        self.saved = SavedSearchService(self.goals, saved, keep)
        self.sentences = SentenceService(model, goals)
        self.opinions = (
            OpinionService(model, operations)
            if model is not None and config.second_opinion
            else None
        )
        self.preview = PreviewService(goals, operations)
        served = (
            self.control, self.guidance, self.goals, self.bids, self.drive, self.queue, self.saved,
            self.sentences, self.preview,
        )  # fmt: skip
        self._endpoints = [
            declare_endpoints(session, robot, service, self.authorize) for service in served
        ]

    def hear_of_rooms(self, rooms: RoomService) -> None:
        """Let the requests of a search use the names of rooms, and painted regions tell theirs."""
        for service in (self.bids, self.guidance, self.preview, self.sentences):
            service.room_names = lambda: rooms.names
        self.drive.room_of = rooms.room_of

    def authorize(self, message: msgspec.Struct, who: Credential | None) -> None:
        """Accept a command of the lease's holder while there is room for it, and every Stop.

        Raises:
            RequestRefusedError: Somebody else has control, or too many requests wait.
        """
        self.control.authorize(message, who)
        if not is_stop(message):
            self._operations.check_room()
