"""What somebody did with an object, which asks for it: "I left my phone in the kitchen"."""

from ippon.guidance.language.goals.drafts import Reading
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.noun_phrase import read_noun_phrase
from ippon.guidance.language.grammar.places import holds_things, is_room
from ippon.guidance.language.lists.goal_list import read_goals
from ippon.guidance.language.words import word_set

_UNNAMED = word_set("i we he she they i've we've somebody someone must may might you")
"""Of these it need not be told that they had the object."""
_ASKING = (phrases.ASKED, phrases.GONE_SENTENCE, phrases.TOLD)


def read_told(reading: Reading, index: int) -> int:
    """Read "I left my phone in the kitchen" as a request for the phone."""
    said = reading.said
    if reading.drafts:
        return index
    doing = _doing(reading, index)
    end = max(reading.match(phrases.TOLD, index), doing)
    after = read_goals(reading, end, "told") if end > index else end
    if after == end:
        return index
    if doing > index or said.word(index) not in _UNNAMED:
        reading.drafts[0].note(said.said(index, end))  # "Priya borrowed".
    return after


def _doing(reading: Reading, index: int) -> int:
    """Return the index after "the kids were playing with" where nothing else is asked for."""
    said, end = reading.said, reading.match(phrases.DOING, index)
    phrase = read_noun_phrase(said, end) if end > index else None
    if phrase is None or not phrase.head or is_room(phrase.head):
        return index
    if said.word(end - 1) in ("on", "in", "at") and holds_things(phrase.head):
        return index
    rest = range(phrase.end, len(said))
    asked = (reading.match(one, n) for n in rest for one in _ASKING if reading.match(one, n) > n)
    if any(said.word(after) not in ("it", "them") for after in asked):
        return index
    if said.word(phrase.end) == "with":
        reading.unused.append(said.said(index, end))  # "Fixing the bike with the wrench".
    return end
