"""Where an object is, as what follows it says."""

from ippon.guidance.language.context_words import MISSING, MOVED
from ippon.guidance.language.goals.drafts import Draft
from ippon.guidance.language.goals.features import BE, COVERED, SUBJECTS, is_maker
from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.language.grammar.guesses import as_guessed, is_guessed
from ippon.guidance.language.grammar.noun_ends import STANDS
from ippon.guidance.language.grammar.noun_phrase import NounPhrase, read_noun_phrase
from ippon.guidance.language.grammar.places import is_room
from ippon.guidance.language.grammar.relation_phrase import (
    SPOTS,
    RelationPhrase,
    prepositions_at,
    read_relation,
)
from ippon.guidance.language.grammar.utterance import Utterance
from ippon.guidance.language.words import word_set

_COVERS = word_set("frame cover sleeve binding wrapping")
"""Of these, "in a wooden frame" tells what a thing looks like, not where it is."""
_CROSSING = word_set(
    "flew flown went gone blew blown rolled jumped climbed threw thrown kicked tossed bounced came"
)
_EVENTS = word_set(
    "party wedding meeting match game concert class lesson funeral break shift school work lunch "
    "breakfast dinner supper"
)
_POSTURES = word_set("lying sitting standing hanging resting leaning hiding waiting sleeping being")
_NEAR = 6


def read_placed(said: Utterance, start: int, goal: Draft) -> int:
    """Read "on the sofa", "which fell behind the piano"; returns the index after it."""
    phrase = read_relation(said, start)
    if phrase is None or (goal.is_owned and said.word(start) in ("he", "she", "he's", "she's")):
        return start
    covered = phrase.relations[0].place in _COVERS or said.word(start - 1) in COVERED
    if covered or is_maker(said, start, phrase.relations[0].place):
        goal.add(Attribute(kind="feature", value=said.said(phrase.begin, phrase.end)))
        return phrase.end
    for index in range(start, phrase.end):
        if said.word(index) in COVERED:  # "That isn't soaked in oil".
            denied = phrase.relations[0].negated
            value = said.said(index, phrase.end)
            goal.add(Attribute(kind="feature", value=value, negated=denied))
            return phrase.end
    crossed = said.words(max(0, start - _NEAR), phrase.end)
    over = [n for n in range(start, phrase.end) if said.word(n) == "over"]
    across = any(said.word(n + 1) not in ("there", "here") for n in over)
    if across and _CROSSING & set(crossed):
        goal.note(said.said(phrase.begin, phrase.end))
        return phrase.end  # "It flew over the fence".
    contracted = said.word(start) == "that's"
    doing = said.word(start + 2 - contracted)
    relative = said.word(start) in ("that", "which") and said.word(start + 1) in BE
    relative = relative or contracted
    if relative and doing.endswith("ing") and doing not in _POSTURES:
        goal.add(Attribute(kind="feature", value=doing))  # "That is dripping in the kitchen".
    of = goal.is_owned and " of " in goal.phrase.display
    if of and start == goal.phrase.end and _is_of_person(phrase.relations[0].place):
        goal.note(said.said(phrase.begin, phrase.end))
        return phrase.end  # "The glasses of the lady in room 2".
    guessed = phrase.soft or is_guessed(said, phrase, goal.phrase.end)
    for place in phrase.relations:
        # "It should be in the hall, but not on the floor": what is denied is certain.
        if not guessed or (place.negated and not phrase.soft):
            goal.relate(place)
    if guessed and not phrase.soft and not all(place.negated for place in phrase.relations):
        goal.note(as_guessed(said, phrase.begin, phrase.end))
    else:
        goal.note(_taken(said, phrase, goal.phrase) + said.said(phrase.begin, phrase.end))
    return phrase.end


def _taken(said: Utterance, phrase: RelationPhrase, thing: NounPhrase) -> str:
    """Return "took " of "who took the torch from the shelf": it is no longer there.

    "The missing page from the study" only describes the object.
    """
    if phrase.relations[0].relation != "from":
        return ""
    index = phrase.begin
    while index > 0 and not said.breaks(index) and said.word(index - 1) not in ("and", "or", "but"):
        index -= 1
        asked = said.word(index) == "take" and "did" not in said.words(0, index)
        inside = index < thing.end and said.word(index) in thing.display.lower().split()
        if said.word(index) in MOVED | MISSING and not asked and not inside:
            return said.word(index) + " "
    return ""


def read_spot(said: Utterance, start: int, goal: Draft) -> int:
    """Read "in the corner" and "at the party", which name no place: they are kept as said."""
    index = start
    while said.word(index) in SUBJECTS | BE | STANDS:
        index += 1
    relations, at = prepositions_at(said, index)
    phrase = read_noun_phrase(said, at) if relations else None
    last = phrase.head.rpartition(" ")[2] if phrase is not None else ""
    event = last in _EVENTS and relations != ["between"]
    if phrase is None or not (event or (last in SPOTS and phrase.determined)):
        return start
    goal.note(said.said(start, phrase.end))
    return phrase.end


def _is_of_person(place: str) -> bool:
    """Tell whether a place is rather that of a person: "of the lady in room 2"."""
    return is_room(place) or place[-1:].isdigit()
