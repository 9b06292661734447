"""The operator's wishes for where to go and what to weigh: drive, goto, paint."""

from functools import partial

import zenoh

from app.links.network.latched_topic import LatchedTopic
from app.links.network.requests import Authorize, RequestRefusedError, allow_all, serve
from app.links.network.sender import Sender
from app.messages import keys
from app.messages.control import Accepted, QueueRequest, encode
from app.messages.driving import (
    DriveRequest,
    GotoRequest,
    PaintedRegions,
    PaintedStroke,
    PaintRequest,
)
from app.nodes.navigator.command.command_mux import CommandMux
from app.nodes.navigator.services.mission_queries import Enqueue, MissionQueries
from app.nodes.navigator.state.goal_queue import GoalQueue
from ippon.control.drive import DriveMode
from ippon.mission.mission import Mission
from ippon.planning.visibility.region_weights import RegionWeights, Stroke

MAX_STROKES = 200


class DriveService:
    """Answers in threads of its own, so that a request that takes its time holds up no Stop."""

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        helm: CommandMux,
        put: Enqueue,
        sender: Sender,
        goals: GoalQueue,
        authorize: Authorize = allow_all,
    ) -> None:
        self._helm = helm
        self._put = put
        self._goals = goals
        self._questions = MissionQueries(put)
        self._strokes: list[PaintedStroke] = []
        self._painted = LatchedTopic(session, f"{robot}/{keys.PAINTED}", sender)
        self._queryables = [
            serve(session, f"{robot}/{keys.DRIVE}", DriveRequest, self.drive, authorize),
            serve(session, f"{robot}/{keys.GOTO}", GotoRequest, self.go_to, authorize),
            serve(session, f"{robot}/{keys.QUEUE}", QueueRequest, self.queue, authorize),
            serve(session, f"{robot}/{keys.PAINT}", PaintRequest, self.paint, authorize),
        ]

    def drive(self, request: DriveRequest) -> Accepted:
        """Set the drive mode and speed limit."""
        mode = DriveMode(request.mode)
        self._put(lambda mission: mission.drive(mode))
        self._helm.set_mode(mode, request.speed_limit)
        return Accepted(detail=f"{request.mode}, at most {request.speed_limit:.0%} of the speed")

    def go_to(self, request: GotoRequest) -> Accepted:
        """Send the robot to a point, if there is a way."""
        if request.cancel:
            self._put(lambda mission: mission.cancel_go_to())
            return Accepted(detail="going nowhere")
        way_m = self._questions.ask(lambda mission: mission.go_to((request.x_m, request.y_m)))
        if way_m is None:
            raise RequestRefusedError(
                f"no way is known to ({request.x_m:.1f}, {request.y_m:.1f}); choose a point on "
                "floor that the robot has seen"
            )
        return Accepted(detail=f"going there, {way_m:.1f} m")

    def queue(self, request: QueueRequest) -> Accepted:
        """Let a waiting goal come next, or none."""
        first = request.action == "first"
        change = self._goals.move_first if first else self._goals.remove
        if not change(request.goal_id):
            raise RequestRefusedError(f"no goal {request.goal_id} waits any more")
        return Accepted(detail="it comes next" if first else "it is cancelled")

    def paint(self, request: PaintRequest) -> Accepted:
        """Weigh a part of the floor, or take that back."""
        detail = self._repaint(request)
        strokes = [
            Stroke(wish=s.kind, points=tuple(s.strokes), radius_m=s.radius_m) for s in self._strokes
        ]
        self._put(partial(_weigh, RegionWeights(strokes) if strokes else None))
        self._painted.put(encode(PaintedRegions(regions=list(self._strokes))))
        return Accepted(detail=detail)

    def _repaint(self, request: PaintRequest) -> str:
        if request.action == "clear":
            self._strokes.clear()
            return "nothing is painted any more"
        if request.action == "undo":
            if not self._strokes:
                raise RequestRefusedError("nothing is painted that could be undone")
            self._strokes.pop()
            return f"undone; {len(self._strokes)} left"
        if not request.strokes:
            raise RequestRefusedError("a stroke needs at least one point of the floor")
        if len(self._strokes) >= MAX_STROKES:
            raise RequestRefusedError(f"{MAX_STROKES} strokes are painted; clear them first")
        self._strokes.append(
            PaintedStroke(kind=request.action, strokes=request.strokes, radius_m=request.radius_m)
        )
        return "looking there first" if request.action == "look_here" else "not looking there"


def _weigh(regions: RegionWeights | None, mission: Mission) -> None:
    mission.set_regions(regions)
