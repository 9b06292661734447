"""Requests that direct the robot: drive mode, waypoint, painted regions."""

from collections.abc import Callable, Sequence
from functools import partial

import msgspec

from app.links.network.latched_topic import Topic
from app.links.network.requests import RequestRefusedError
from app.messages.control import Accepted, encode
from app.messages.driving import (
    DriveRequest,
    GotoRequest,
    PaintedRegions,
    PaintedStroke,
    PaintRequest,
)
from app.nodes.navigator.command.command_mux import CommandMux
from app.nodes.navigator.services.operation_queue import OperationQueue
from ippon.control.drive_mode import DriveMode
from ippon.mission.mission import Mission
from ippon.planning.visibility.region_weights import (
    LONGEST_PAINTED_M,
    Stroke,
    painted_corners,
)
from ippon.robot import RobotProfile

MAX_STROKES = 200


class DriveService:
    """Handles requests in threads of their own; the mission's thread runs the operations."""

    def __init__(
        self,
        mux: CommandMux,
        operations: OperationQueue,
        painted: Topic,
        profile: RobotProfile,
    ) -> None:
        self._profile = profile
        self._mux = mux
        self._operations = operations
        self._strokes: list[PaintedStroke] = []
        self._painted = painted
        self.room_of: Callable[[Sequence[tuple[float, float]]], str] = lambda _: ""
        """Returns the room of points of the floor; the navigator sets it."""

    def drive(self, request: DriveRequest) -> Accepted:
        """Set the drive mode and speed limit; what the request does not name stays.

        A mode cancels the point that the robot drives to, also the present one; another limit alone
        does not.
        """
        now = self._mux.status()
        mode = DriveMode(request.mode or now.mode)
        limit = request.speed_limit
        if limit is None:
            # A robot that navigates by itself chooses its own speed: the limit was the hand's.
            is_own = self._profile.takes_goals and mode is DriveMode.AUTO
            limit = 1.0 if is_own else now.speed_limit
        problem = drive_refusal(self._profile, mode, limit)
        if problem:
            raise RequestRefusedError(problem)
        names_mode = request.mode is not None
        if names_mode and (mode.value != now.mode or limit == now.speed_limit):
            self._operations.enqueue(lambda mission: mission.operator.drive(mode))
        self._operations.enqueue(lambda mission: mission.operator.limit_speed(limit))
        self._mux.set_mode(mode, limit)
        return Accepted(detail=f"{mode.value}, at most {limit:.0%} of the speed")

    def go_to(self, request: GotoRequest) -> Accepted:
        """Send the robot to a point that a known path leads to."""
        if request.cancel:
            self._operations.enqueue(lambda mission: mission.operator.cancel_go_to())
            return Accepted(detail="waypoint cancelled")
        way_m, is_held = self._operations.ask(
            lambda mission: (
                mission.operator.go_to((request.x_m, request.y_m)),
                mission.operator.held is not None,
            )
        )
        if way_m is None:
            raise RequestRefusedError(
                f"no path is known to ({request.x_m:.1f}, {request.y_m:.1f}); choose a point on "
                "floor that the robot has seen"
            )
        if is_held:
            return Accepted(detail=f"the robot drives there after Resume, {way_m:.1f} m")
        return Accepted(detail=f"driving there, {way_m:.1f} m")

    def paint(self, request: PaintRequest) -> Accepted:
        """Add, undo or clear painted regions, which weigh the gain of viewpoints."""
        detail = self._repaint(request)
        self._operations.enqueue(partial(_weigh, _regions(self._strokes)))
        self._painted.put(encode(PaintedRegions(regions=list(self._strokes))))
        return Accepted(detail=detail)

    def _repaint(self, request: PaintRequest) -> str:
        if request.action == "clear":
            self._strokes.clear()
            return "all painted regions are removed"
        if request.action == "undo":
            if not self._strokes:
                raise RequestRefusedError("there is no painted region to undo")
            self._strokes.pop()
            return f"undone; {len(self._strokes)} left"
        if not request.strokes:
            raise RequestRefusedError("a stroke needs at least one point of the floor")
        if len(self._strokes) >= MAX_STROKES:
            raise RequestRefusedError(f"{MAX_STROKES} strokes are painted; clear them first")
        stroke = PaintedStroke(
            kind=request.action, strokes=request.strokes, radius_m=request.radius_m
        )
        low, high = painted_corners(_regions([*self._strokes, stroke]))
        longest_m = float((high - low).max())
        if longest_m > LONGEST_PAINTED_M:
            raise RequestRefusedError(
                f"the painted floor would be {longest_m:.0f} m long, at most "
                f"{LONGEST_PAINTED_M:.0f} m are possible; give points in metres, or clear what is "
                "painted"
            )
        try:
            room = self.room_of(request.strokes)
        except RequestRefusedError:
            # The region counts all the same.
            room = ""
        self._strokes.append(msgspec.structs.replace(stroke, room=room))
        return "searching there first" if request.action == "look_here" else "not searching there"


def drive_refusal(profile: RobotProfile, mode: DriveMode, speed_limit: float) -> str:
    """Return why a robot cannot be driven in a mode; empty where it can."""
    if profile.is_carried:
        by_hand = mode is not DriveMode.AUTO or speed_limit < 1.0
        return f"a person carries {profile.name}: there is nothing to drive" if by_hand else ""
    if not profile.takes_goals:
        return ""
    if mode is not DriveMode.AUTO and not profile.takes_velocities:
        return (
            f"{profile.name} navigates by itself and takes no velocities: send it to a point of "
            "the floor instead; a profile with `takes: [goals, velocities]` allows driving by hand"
        )
    if mode is DriveMode.ASSISTED:
        return (
            f"{profile.name} navigates by itself: the planner has no velocities to assist with; "
            "drive it in manual mode, or send it to a point of the floor"
        )
    if mode is DriveMode.AUTO and speed_limit < 1.0:
        return f"{profile.name} navigates by itself and chooses its own speed: no limit can be set"
    return ""


def _regions(strokes: Sequence[PaintedStroke]) -> list[Stroke]:
    return [Stroke(kind=s.kind, points=tuple(s.strokes), radius_m=s.radius_m) for s in strokes]


def _weigh(strokes: Sequence[Stroke], mission: Mission) -> None:
    mission.operator.set_regions(strokes)
