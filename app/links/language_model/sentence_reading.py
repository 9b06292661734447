"""A sentence that was read, as the message that answers for it."""

from app.links.language_model.interface import SentenceAnswer
from app.messages.control import SentenceReading
from ippon.guidance.language.requests.goals import unchecked


def as_reading(answer: SentenceAnswer, elapsed_ms: float) -> SentenceReading:
    """Return the reading of a sentence, with all that a search does not use yet."""
    request = answer.request
    notes = [note for goal in request.goals for note in unchecked(goal)]
    if any(goal.order == "or" for goal in request.goals):
        notes.append("“or” is not used yet: each of the objects is searched for")
    return SentenceReading(
        goals=list(request.goals),
        doubtful=request.doubtful,
        because=request.because,
        unused=list(request.unused),
        notes=list(dict.fromkeys(notes)),
        language=request.language,
        provider=answer.provider,
        elapsed_ms=elapsed_ms,
        note=answer.failed,
    )
