"""Phrases that say where a thing is: "next to the white fridge", "not in Anna's room"."""

from dataclasses import dataclass, replace
from typing import Final

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.context_words import (
    ABSTRACT,
    NEGATIONS,
    PARTS,
)
from ippon.guidance.language.goals.goal import ALL, Relation
from ippon.guidance.language.grammar.determiners import NUMBERS
from ippon.guidance.language.grammar.noun_ends import STANDS, stands_somewhere
from ippon.guidance.language.grammar.noun_phrase import NounPhrase, read_noun_phrase
from ippon.guidance.language.grammar.phrases import PREPOSITIONS
from ippon.guidance.language.grammar.places import holds_things, is_room, named_place, room_spelt
from ippon.guidance.language.grammar.utterance import Utterance, read_once
from ippon.guidance.language.words import word_set

_STANDING = word_set(
    "that which who is are was were it's its be been being lying sitting standing hanging located "
    "placed stored kept left put hidden resting stuck somewhere right just still only also over "
    "down up back out what's they're he's she's what found it they he she definitely certainly "
    "that's who's asleep surely currently now must anywhere there somewhere even but or and either "
    "behind directly exactly immediately close sat stands lies sits hangs lives placed both all "
    "fell fallen slipped rolled have has had got gone used seen spotted worn last will "
    "off away dropped ran come came popped slid"
)
"""Words that may stand before a preposition without changing where."""
SOFT = word_set(
    "probably maybe perhaps possibly likely presumably usually normally often sometimes might may "
    "could should supposedly apparently mostly prob probs i'd guess generally typically"
)
_JOINTS: Final = ("or", "nor", "and")
_STOREYS: Final = {
    "upstairs": "upstairs", "downstairs": "downstairs", "outdoors": "outdoors",
    "outside": "outdoors", "indoors": "indoors",
}  # fmt: skip
_DENYING = ("away from", "far from")
_ONLY_PLACES = word_set("where to through along until about")
_OWN_ROOMS = word_set("room bedroom office study room's bathroom studio flat house place apartment")
_GROUPS = word_set("men's women's people's children's")
SPOTS = word_set("corner middle side back front end edge center centre top bottom")
_SIDED = word_set("the left right hand far very top bottom back other opposite near wrong")
ENTERING: Final = word_set(
    "look search check go bother try looking searching checking going entering trying"
)
"""After a denial, these lead to a place not to search."""
_MAX_PLACES = 6


@dataclass(frozen=True, slots=True)
class RelationPhrase:
    """Relations that one phrase states."""

    relations: tuple[Relation, ...]
    soft: bool
    """They are offered as likely, not stated."""
    begin: int
    end: int


@read_once
def read_relation(said: Utterance, start: int, *, verbs: bool = True) -> RelationPhrase | None:
    """Read the relation phrase that begins at a word; None where there is none.

    Args:
        said: The sentence.
        start: Index of the first word.
        verbs: Allow words such as "which is lying" before the preposition.
    """
    index, negated, soft = start, False, False
    while index < len(said) and index - start < 8:
        word = said.word(index)
        if said.ends(index) and index > start:
            return None
        prepositions, at = prepositions_at(said, index)
        if prepositions:
            relations, end = _read_places(said, prepositions, at, negated=negated)
            if relations:
                more, end = (
                    _also_denied(said, end) if negated else _also_at(said, end, relations[-1])
                )
                return RelationPhrase((*relations, *more), soft, start, end)
        if word in ("from", "at") and said.word(index + 1) in _STOREYS:
            index, word = index + 1, said.word(index + 1)
        if word in _STOREYS:
            place = Relation(relation="at", place=_STOREYS[word], negated=negated)
            more, end = _also_denied(said, index + 1) if negated else ([], index + 1)
            return RelationPhrase((place, *more), soft, start, end)
        if word in NEGATIONS or (word == "no" and said.word(index + 1) == "longer"):
            negated = True
        elif negated and word in ENTERING:
            pass
        elif said.words(index, index + 2) == ["used", "to"]:
            soft, index = True, index + 1  # "Used to be on".
        elif word in SOFT:
            soft = soft or (word, said.word(index + 1)) != ("could", "not")
        elif word in ("longer", "but", "or", "and") or (verbs and _may_precede(said, index)):
            pass
        else:
            return None
        index += 1
    return None


def _also_denied(said: Utterance, index: int) -> tuple[list[Relation], int]:
    """Read ", or in the hall" after a place that is denied: it is denied, too."""
    relations: list[Relation] = []
    while said.word(index) in ("or", "nor") and not said.ends(index):
        skipped = said.word(index + 1) in ("anywhere", "even", "still", "somewhere")
        prepositions, at = prepositions_at(said, index + 1 + skipped)
        more, end = _read_places(said, prepositions, at, negated=True) if prepositions else ([], 0)
        if not more:
            break
        relations, index = [*relations, *more], end
    return relations, index


def _also_at(said: Utterance, index: int, place: Relation) -> tuple[list[Relation], int]:
    """Read "or behind it" after a place: another relation to the same place."""
    prepositions, at = prepositions_at(said, index + 1) if said.word(index) == "or" else ([], 0)
    if not prepositions or said.word(at) not in ("it", "them"):
        return [], index
    return [replace(place, relation=relation) for relation in prepositions], at + 1


def _may_precede(said: Utterance, index: int) -> bool:
    """Tell whether a word may stand before a preposition without changing where."""
    particle = said.word(index) in ("in", "on", "up", "out") and said.word(index - 1).endswith("ed")
    word = said.word(index)
    adverb = index > 0 and said.word(index - 1) in STANDS and stands_somewhere(said, index - 1)
    return (
        particle
        or adverb
        or word in _STANDING
        or word in STANDS
        or stands_somewhere(said, index)
        or _before_somewhere(said, index)
    )


def _before_somewhere(said: Utterance, index: int) -> bool:
    """Tell whether a word stands between "is" and "somewhere": "is adrift somewhere in"."""
    for after in (index + 1, index + 2):
        if said.breaks(after):
            return False
        if said.word(after) == "somewhere" and prepositions_at(said, after + 1)[0]:
            return bool({"is", "are", "was", "were"} & set(said.words(max(0, after - 3), index)))
    return False


@read_once
def prepositions_at(said: Utterance, index: int) -> tuple[list[str], int]:
    """Return the prepositions at an index ("on or under"), and where the place begins."""
    found: list[str] = []
    while True:
        length = _preposition_length(said, index)
        hyphened = said.hyphened(index) or said.hyphened(index + 1)
        if not length or said.breaks(index + length) or hyphened:
            return [], index
        if said.word(index) in _ONLY_PLACES:
            relation, at = _side(said, "", index + 1)
            return ([relation], at) if relation else ([], index)
        phrase = " ".join(said.words(index, index + length))
        if phrase == "with":
            return [], index
        relation = "just outside" if phrase in ("outside", "outside of") else PREPOSITIONS[phrase]
        index += length
        if relation == "from" and not found and (length := _preposition_length(said, index)):
            if PREPOSITIONS[" ".join(said.words(index, index + length))] == "from":
                continue  # "From off the bed".
            inner, place = prepositions_at(said, index)
            if inner:
                return inner, place  # "From beside the bed".
        relation, index = _side(said, relation, index)
        part = index + 1 + (said.word(index + 1) in ("far", "left", "right", "top", "bottom"))
        if said.word(index) == "the" and said.word(part) in SPOTS and said.word(part + 1) != "of":
            inner, place = prepositions_at(said, part + 1) if not said.breaks(part + 1) else ([], 0)
            if inner:
                return inner, place  # "In the corner behind the sofa".
        found.append(relation)
        more = said.word(index) in ("or", "and") and said.word(index + 1) in PREPOSITIONS
        if not more or len(found) > 2:
            return found, index
        index += 1


def _preposition_length(said: Utterance, index: int) -> int:
    """Return the number of words of the longest preposition at an index; 0 for none."""
    lengths = (4, 3, 2, 1)
    return next((n for n in lengths if " ".join(said.words(index, index + n)) in PREPOSITIONS), 0)


def _side(said: Utterance, relation: str, index: int) -> tuple[str, int]:
    """Read "the left side of" after a preposition: it says beside."""
    at = index
    while said.word(at) in _SIDED:
        at += 1
    chosen = at > index + 1 and said.word(at) in ("drawer", "compartment")  # "The top drawer of".
    at += said.word(at) in PARTS and said.word(at) != "shelf" and not chosen
    if at == index or said.word(at) != "of" or at > index + 4:
        return relation, index
    words = set(said.words(index, at))
    if words & {"left", "right", "side", "sides"}:
        relation = "next to"
    elif "top" in words:
        relation = "on"
    return relation, at + 1


def _read_places(
    said: Utterance, prepositions: list[str], start: int, *, negated: bool
) -> tuple[list[Relation], int]:
    relations: list[Relation] = []
    index = start
    while len(relations) < _MAX_PLACES:
        phrase = read_noun_phrase(said, index)
        if phrase is None or _is_abstract(said, index, phrase):
            break
        for preposition in prepositions:
            relation, denied = _stated(preposition, phrase.head, negated=negated)
            relations.append(relation_to(said, index, phrase, relation, negated=denied))
        index = phrase.end
        joint = said.word(index)
        again = index + 1
        if joint == "and" and not _joins_places(said, again, phrase, prepositions, denied=negated):
            break
        if joint not in ("or", "nor", "and") or said.word(again) in PREPOSITIONS:
            break
        following = read_noun_phrase(said, again)
        if following is None or _is_abstract(said, again, following):
            break
        index = again
    else:
        return relations, index
    if relations and said.word(index - 1) in ("or", "nor", "and"):
        index -= 1
    for begin, phrase in _listed_places(said, index, denied=negated) if relations else []:
        for preposition in prepositions:
            relation, denied = _stated(preposition, phrase.head, negated=negated)
            relations.append(relation_to(said, begin, phrase, relation, negated=denied))
        index = phrase.end
    return relations, index


def _listed_places(said: Utterance, index: int, *, denied: bool) -> list[tuple[int, NounPhrase]]:
    """Return the further places of a list: ", the hall or the attic"; empty for other lists."""
    listed: list[tuple[int, NounPhrase]] = []
    joint = ""
    while not joint:
        joint = said.word(index) if said.word(index) in _JOINTS else ""
        if said.gap(index).strip() != "," and not (listed and joint):
            return []
        begin = index + bool(joint)
        phrase = read_noun_phrase(said, begin)
        if phrase is None or (joint and said.breaks(begin)) or not holds_things(phrase.head):
            return []
        listed.append((begin, phrase))
        index = phrase.end
    rooms = all(is_room(phrase.head) for _, phrase in listed)
    return listed if joint != "and" or rooms or denied else []


def _joins_places(
    said: Utterance, index: int, before: NounPhrase, prepositions: list[str], *, denied: bool
) -> bool:
    """Tell whether "and" joins two places, not two objects: "in the kitchen and the hall"."""
    if "between" in prepositions:
        return True
    return (denied or is_room(before.head)) and _room_at(said, index) != ""


def _room_at(said: Utterance, index: int) -> str:
    phrase = read_noun_phrase(said, index, of=False)
    if phrase is None:
        return ""
    return load_knowledge().room(phrase.head) or ""


def _is_abstract(said: Utterance, index: int, phrase: NounPhrase) -> bool:
    """Tell whether what follows a preposition is no place: "in the morning"."""
    last = said.word(phrase.end - 1)
    if phrase.count == ALL and last in ("room", "rooms", "corner"):
        return True
    if last in NUMBERS and phrase.head and phrase.end - index > 1:
        return False  # "Aisle three".
    if said.word(index) == "this" and last in ("floor", "storey", *_OWN_ROOMS):
        return True
    mine = said.word(index) in ("my", "our", "your")
    if mine and last in _OWN_ROOMS - {"house", "flat", "place", "apartment"}:
        return False
    if is_room(phrase.head) or _is_own_room(phrase):
        return False
    if last in _OWN_ROOMS and phrase.head and (phrase.attributes or " " in phrase.head):
        return False
    if last in ("case", "line") and said.word(index) in ("a", "an", "the", "its", "my"):
        return False
    return last in ABSTRACT or phrase.head in ABSTRACT or not phrase.head or last == "party"


def _is_own_room(phrase: NounPhrase) -> bool:
    return any(one.kind == "owner" for one in phrase.attributes) and phrase.head in _OWN_ROOMS


def _is_of_group(said: Utterance, start: int, phrase: NounPhrase) -> bool:
    """Tell whether a group's name belongs to that of a place: "the nurses' station"."""
    owner = said.word(start + (said.word(start) == "the"))
    group = owner.endswith("s's") or owner in _GROUPS
    return group and bool(phrase.head) and load_knowledge().find(phrase.head) is None


def _stated(preposition: str, place: str, *, negated: bool) -> tuple[str, bool]:
    if preposition == "just outside":
        return ("in", not negated) if is_room(place) else ("near", negated)  # "Outside the door".
    if preposition == "outside":
        return "in", not negated
    if preposition == "away from":
        return "near", not negated
    return preposition, negated


def relation_to(
    said: Utterance, start: int, phrase: NounPhrase, relation: str, *, negated: bool = False
) -> Relation:
    """Return the relation to the place that a noun phrase at a word names."""
    place, attributes = named_place(room_spelt(phrase.head), phrase.attributes)
    if _is_own_room(phrase) or _is_of_group(said, start, phrase):
        # The name of a room: the operator may have given it to one.
        place = said.said(start, phrase.end)
        place = place[4:] if place.lower().startswith("the ") else place
        attributes = tuple(one for one in attributes if one.kind != "owner")
    elif phrase.head in _OWN_ROOMS and said.word(start) in ("my", "our", "your"):
        place = said.said(start, phrase.end)
    return Relation(relation=relation, place=place, negated=negated, attributes=attributes)
