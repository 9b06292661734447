"""All services that answer requests, wired to one goal queue and one command stream."""

import zenoh

from app.links.language_model.interface import LanguageModelInterface
from app.links.network.sender import Sender
from app.nodes.navigator.command.command_mux import CommandMux
from app.nodes.navigator.command.command_stream import CommandStream
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.event_publisher import EventPublisher
from app.nodes.navigator.services.control_service import ControlService
from app.nodes.navigator.services.drive_service import DriveService
from app.nodes.navigator.services.goal_service import GoalService
from app.nodes.navigator.services.guidance_service import GuidanceService
from app.nodes.navigator.services.mission_queue import MissionQueue
from app.nodes.navigator.services.opinion_service import OpinionService
from app.nodes.navigator.services.preview_service import PreviewService
from app.nodes.navigator.services.sentence_service import SentenceService
from app.nodes.navigator.state.goal_queue import GoalQueue


class RequestServices:
    """Declares the endpoints of every service; their state is owned by the parts passed in."""

    def __init__(
        self,
        session: zenoh.Session,
        config: NavigatorConfig,
        goals: GoalQueue,
        stream: CommandStream,
        *,
        operations: MissionQueue,
        events: EventPublisher,
        sender: Sender,
        model: LanguageModelInterface | None,
    ) -> None:
        robot = config.robot
        self.control = ControlService(session, robot)
        authorize = self.control.authorize
        self.guidance = GuidanceService(
            session,
            robot,
            config.labels,
            goals,
            model=model,
            look_every_s=config.look_every_s,
            operations=operations,
            report_event=events.report,
            authorize=authorize,
        )
        self.goals = GoalService(
            session,
            robot,
            goals,
            self.guidance,
            stop_latch=stream,
            operations=operations,
            authorize=authorize,
        )
        self.mux = CommandMux(
            session,
            robot,
            config.profile,
            stream,
            config.stale_s,
            refusal=self.control.teleop_refusal,
            on_takeover=lambda: operations.enqueue(lambda mission: mission.operator.cancel_go_to()),
        )
        self.drive = DriveService(session, robot, self.mux, operations, sender, goals, authorize)
        self.sentences = SentenceService(session, robot, model)
        self.opinions = (
            OpinionService(model, operations)
            if model is not None and config.second_opinion
            else None
        )
        self.preview = PreviewService(session, robot, goals, operations)
