"""The operator's wishes for where to go and what to weigh: drive, goto."""

from collections.abc import Callable
from concurrent.futures import Future
from typing import Final, TypeVar

import zenoh

from app.links.requests import Permit, RequestRefusedError, anyone, serve
from app.messages import keys
from app.messages.control import Accepted, DriveRequest, GotoRequest
from app.nodes.navigator.helm import Helm
from ippon.control.drive import DriveMode
from ippon.mission.mission import Mission

T = TypeVar("T")
ANSWER_S: Final = 1.8
"""So long a request waits for the mission's thread, which may be in the middle of a step."""

Put = Callable[[Callable[[Mission], None]], None]


class Steering:
    """Answers in threads of its own, so that a request that takes its time holds up no Stop."""

    def __init__(
        self, session: zenoh.Session, robot: str, helm: Helm, put: Put, permit: Permit = anyone
    ) -> None:
        self._helm = helm
        self._put = put
        self._queryables = [
            serve(session, f"{robot}/{keys.DRIVE}", DriveRequest, self.drive, permit),
            serve(session, f"{robot}/{keys.GOTO}", GotoRequest, self.go_to, permit),
        ]

    def drive(self, request: DriveRequest) -> Accepted:
        """Say who drives."""
        mode = DriveMode(request.mode)
        self._put(lambda mission: mission.drive(mode))
        self._helm.set_mode(mode, request.speed_limit)
        return Accepted(detail=f"{request.mode}, at most {request.speed_limit:.0%} of the speed")

    def go_to(self, request: GotoRequest) -> Accepted:
        """Send the robot to a point, if there is a way."""
        if request.cancel:
            self._put(lambda mission: mission.cancel_go_to())
            return Accepted(detail="going nowhere")
        way_m = self._ask(lambda mission: mission.go_to((request.x_m, request.y_m)))
        if way_m is None:
            raise RequestRefusedError(
                f"no way is known to ({request.x_m:.1f}, {request.y_m:.1f}); choose a point on "
                "floor that the robot has seen"
            )
        return Accepted(detail=f"going there, {way_m:.1f} m")

    def _ask(self, question: Callable[[Mission], T]) -> T:
        """Have the mission's thread answer."""
        answer: Future[T] = Future()

        def run(mission: Mission) -> None:
            try:
                answer.set_result(question(mission))
            except ValueError as error:
                answer.set_exception(RequestRefusedError(str(error)))

        self._put(run)
        try:
            return answer.result(timeout=ANSWER_S)
        except TimeoutError as error:
            raise RequestRefusedError(
                f"the navigator is busy and did not answer within {ANSWER_S:g} s; try again"
            ) from error
