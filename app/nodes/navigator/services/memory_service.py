"""Requests about what is remembered: questions are answered at once in threads of their own."""

import threading

import zenoh

from app.links.network.requests import Authorize, RequestRefusedError, allow_all, serve
from app.messages import keys
from app.messages.memory import MemoryNoteRequest, MemoryReply, MemoryRequest, RememberedThing
from app.nodes.navigator.memory_keeper import MemoryKeeper
from app.nodes.navigator.services.operation_queue import OperationQueue
from ippon.guidance.language.words import singular
from ippon.memory.lookup import Match, find_instances, match_of


class MemoryService:
    """Answers every requester; what changes the memory needs control."""

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        keeper: MemoryKeeper,
        operations: OperationQueue,
        authorize: Authorize = allow_all,
    ) -> None:
        """Declare the endpoints.

        Args:
            session: An open session.
            robot: Key prefix.
            keeper: What is remembered.
            operations: Gives access to the mission's thread.
            authorize: Checks who may change the memory.
        """
        self._keeper, self._operations = keeper, operations
        # The plural of a word outside the table takes a library that loads for seconds.
        threading.Thread(target=singular, args=("flurbles",), name="words", daemon=True).start()
        self._queryable = serve(session, f"{robot}/{keys.MEMORY}", MemoryRequest, self.answer)
        key = f"{robot}/{keys.MEMORY_NOTE}"
        self._notes = serve(session, key, MemoryNoteRequest, self.note, authorize)

    def answer(self, request: MemoryRequest) -> MemoryReply:
        """Return the things that answer a question."""
        keeper = self._keeper
        try:
            matches = find_instances(keeper.instances, request.find, keeper.labels)
        except ValueError as error:
            raise RequestRefusedError(str(error)) from error
        picture = None if request.picture is None else keeper.picture(request.picture)
        return MemoryReply(
            things=[thing_of(match) for match in matches[: request.limit]],
            count=len(matches),
            picture=picture or b"",
            note=keeper.problem,
        )

    def note(self, request: MemoryNoteRequest) -> RememberedThing:
        """Keep what a person says of a thing."""
        noted = self._operations.ask(
            lambda mission: self._keeper.note(request, mission.goals.running)
        )
        return thing_of(match_of(noted))


def thing_of(match: Match) -> RememberedThing:
    """Return a remembered thing as a message."""
    one = match.instance
    return RememberedThing(
        instance_id=one.instance_id,
        label=one.believed,
        probability=round(match.probability, 4),
        alternatives=[(label, round(p, 4)) for label, p in one.beliefs[1:]],
        source=one.source,
        position_world=one.position_world,
        size_m=one.size_m,
        room=one.room,
        first_seen_ns=one.first_seen_ns,
        last_seen_ns=one.last_seen_ns,
        gone_ns=one.gone_ns,
        has_picture=one.view_score > 0.0,
        attributes=list(one.attributes),
        name=one.name,
        denied=list(one.denied),
    )
