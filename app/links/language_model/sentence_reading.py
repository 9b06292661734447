"""A sentence that was read: the message that answers for it, and the searches that follow."""

from collections.abc import Sequence
from dataclasses import replace

from app.links.language_model.interface import SentenceAnswer
from app.messages.control import SearchRequest, SentenceReading
from app.messages.status import MOST_COUNTED, Count
from ippon.guidance.language.goals.goal import ALL, Goal, unchecked
from ippon.guidance.language.lists.same_objects import once_each
from ippon.guidance.language.requests.sentence import search_name
from ippon.rooms.room_names import known_rooms


def as_reading(
    answer: SentenceAnswer, elapsed_ms: float, room_names: Sequence[str] = ()
) -> SentenceReading:
    """Return the reading of a sentence: each object once, and all that a search does not use yet.

    A sentence that wants more of an object than are counted gives no goal.

    Args:
        answer: The goals.
        elapsed_ms: Time that the reading took.
        room_names: Names that people have given to rooms of the map.
    """
    request = answer.request
    too_many = next(filter(None, (count_refusal(goal.count) for goal in request.goals)), "")
    if too_many:
        request = replace(request, goals=(), doubtful=True, because=too_many)
    goals, notes = once_each(request.goals)
    notes = [
        *notes,
        *(
            note
            for goal in goals
            for note in unchecked(goal, known_rooms(goal.context, room_names))
        ),
    ]
    if any(goal.order == "or" for goal in goals):
        notes.append("“or” is not used yet: each of the objects is searched for")
    return SentenceReading(
        goals=list(goals),
        doubtful=request.doubtful,
        because=request.because,
        unused=list(request.unused),
        notes=list(dict.fromkeys(notes)),
        language=request.language,
        provider=answer.provider,
        elapsed_ms=elapsed_ms,
        note=answer.failed,
    )


def count_refusal(count: Count) -> str:
    """Return why so many of an object are not searched for; empty where they are."""
    if count == ALL or count <= MOST_COUNTED:
        return ""
    return f"at most {MOST_COUNTED} of one kind are counted; got {count}. Ask for all of them"


def search_of(goal: Goal, requester: str) -> SearchRequest:
    """Return the search for a goal that was read, by itself."""
    return SearchRequest(
        object=search_name(goal),
        context=goal.context,
        requester=requester,
        attributes=list(goal.attributes),
        count=goal.count,
        other=goal.refers_to == "other",
    )
