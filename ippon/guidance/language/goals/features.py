"""What belongs to an object: parts, measures, material, owner, side."""

from collections.abc import Sequence
from dataclasses import replace

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.goals.drafts import Draft
from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.attributes import UNITS, is_part, listed_kind
from ippon.guidance.language.grammar.determiners import NUMBERS, count_again, may_be_noun
from ippon.guidance.language.grammar.heads import CODE
from ippon.guidance.language.grammar.noun_ends import STANDS, stands_somewhere
from ippon.guidance.language.grammar.noun_phrase import NounPhrase, read_noun_phrase
from ippon.guidance.language.grammar.phrases import STOP
from ippon.guidance.language.grammar.relation_phrase import ENTERING
from ippon.guidance.language.grammar.utterance import Utterance
from ippon.guidance.language.words import word_set

SUBJECTS = word_set(
    "that which who it it's its they they're he he's she she's that's this these theirs those"
)
"""What stands for the object in a clause about it."""
BE = word_set("is are was were be looks look seems isn't aren't wasn't weren't")
COVERED = word_set(
    "wrapped covered dressed painted decorated printed soaked coated stained dipped smeared"
)
"""After these, "in gold paper" tells what a thing looks like, not where it is."""
_DIMENSIONS = word_set("long wide tall high deep thick")
PLACES_ON_IT = ("on it", "on them", "in it", "inside it", "on top")
_SIZES = word_set("xs s m l xl xxl extra medium")
_OWNING = word_set("has belongs")
_STATES = word_set("missing broken torn off open gone loose")
"""After a part, they say in which state it is: "one ear missing"."""


def read_feature(said: Utterance, start: int, goal: Draft) -> int:
    """Read "with wheels", "and has a dinosaur on it", "without a handle"."""
    index = start
    if said.word(index) == "whose":
        return _whose(said, index, goal)
    if (end := _part_is(said, index, goal)) > index:
        return end
    if (end := _next_part(said, index, goal.attributes)) > index:
        last = goal.attributes[-1]
        goal.add(replace(last, value=without_article(said.said(index + 1, end))))
        return end
    index += said.word(index) in ("and", "but")
    index += said.word(index) in SUBJECTS
    index += said.word(index) in ("only", "just", "also", "still") and index > start
    lacking = said.starts(index, phrases.LACKING)
    length = lacking or said.starts(index, phrases.HAVING)
    if (end := _measure(said, start)) > start:
        goal.add(Attribute(kind="size", value=said.said(start, end)))
        return end
    coded = CODE.match(said.word(start)) and said.breaks(start) and said.breaks(start + 1)
    if coded:
        goal.add(Attribute(kind="which", value=said.said(start, start + 1)))
        return start + 1  # "Bolts, M8".
    number = start + said.starts(start, ("number", "serial number", "model", "model number"))
    if number > start and said.breaks(start) and said.word(number)[:1].isdigit():
        goal.add(Attribute(kind="which", value=said.said(start, number + 1)))
        return number + 1  # "My key, number 48".
    if said.word(index + 1) == "than":
        return _than(said, index, goal)
    if not length or (said.word(index) == "have" and said.breaks(index)):
        return _on_it(said, start, goal)  # "..., have a look round".
    index += length
    standing = said.word(index) in STANDS or stands_somewhere(said, index)  # "Got stuck in".
    doing = said.word(index).endswith("ing") and said.word(index + 1) in ("the", "my", "our", "a")
    person = said.word(index) in ("me", "us", "him", "them")
    if standing or person or (lacking and (doing or said.word(index) in ENTERING)):
        return start  # "Without going into the nursery" is no part of it.
    phrase = read_noun_phrase(said, index)
    if phrase is None or (not phrase.head and not phrase.attributes):
        return start
    has = said.word(index - 1) in ("has", "have")
    own = is_part(phrase.head.rpartition(" ")[2]) or phrase.attributes
    if goal.is_owned and said.word(start) in ("he", "she") and not own:
        return start  # "Ella's goggles, she has a lesson".
    if has and not (phrase.determined or phrase.known or phrase.attributes or _is_plural(phrase)):
        return start  # "Has stopped working".
    end = phrase.end + (said.word(phrase.end) in _STATES and said.breaks(phrase.end + 1))
    if said.word(end) in ("on", "in", "at", "around") and said.word(end + 1) in ("its", "their"):
        part = read_noun_phrase(said, end + 1)
        end = end if part is None else part.end  # "With tennis balls on its feet".
    end += said.starts(end, phrases.SIDES)  # "A hook on the end".
    value = without_article(said.said(index, end))
    goal.add(Attribute(kind="feature", value=value, negated=bool(lacking)))
    while length := said.starts(end, PLACES_ON_IT):
        end += length
    return end


def tells_of_part(said: Utterance, index: int, goal: Draft) -> bool:
    """Tell whether "and" goes on with a part of an object: "and a handle", "and the lid is red"."""
    named = _next_part(said, index, goal.attributes) > index
    return named or _part_is(said, index, goal.probe()) > index


def _next_part(said: Utterance, start: int, attributes: Sequence[Attribute]) -> int:
    """Return the index after "and a handle" where a part was told before; the same for none."""
    after = attributes and attributes[-1].kind == "feature"
    if not after or said.word(start) not in ("and", "or") or said.breaks(start + 1):
        return start
    phrase = read_noun_phrase(said, start + 1)
    part = phrase is not None and is_part(phrase.display.lower().rpartition(" ")[2])
    return phrase.end if phrase is not None and part else start


def _is_plural(phrase: NounPhrase) -> bool:
    return phrase.display.endswith("s") or is_part(phrase.head.rpartition(" ")[2])


def _than(said: Utterance, start: int, goal: Draft) -> int:
    """Read "longer than two metres"."""
    kind = listed_kind(said.word(start))
    if kind is None or said.word(start + 1) != "than":
        return start
    phrase = read_noun_phrase(said, start + 2)
    end = start + 3 if phrase is None else phrase.end
    goal.add(Attribute(kind=kind, value=said.said(start, end)))
    return end


def _measure(said: Utterance, start: int) -> int:
    """Return the index after "at least 30 cm long"; the same for none."""
    index = start + said.starts(start, ("at least", "at most", "about", "up to", "around"))
    number = said.word(index)[:1].isdigit() or said.word(index) in NUMBERS
    inside = said.word(index) in NUMBERS and said.word(index + 1) == "in"  # "One in the hall".
    if not number or inside or said.word(index + 1) not in UNITS:
        return start
    return index + 2 + (said.word(index + 2) in _DIMENSIONS)


def _on_it(said: Utterance, start: int, goal: Draft) -> int:
    """Read ", dinosaurs on it"."""
    phrase = read_noun_phrase(said, start) if said.breaks(start) else None
    if phrase is None or not phrase.head:
        return start
    if said.word(phrase.end) not in ("on", "in") or said.word(phrase.end + 1) not in ("it", "them"):
        return start
    goal.add(Attribute(kind="feature", value=without_article(said.said(start, phrase.end))))
    return phrase.end + 2


def _whose(said: Utterance, start: int, goal: Draft) -> int:
    """Read "whose leg is broken"."""
    phrase = read_noun_phrase(said, start + 1)
    if phrase is None or said.word(phrase.end) not in BE:
        return start
    end = phrase.end + 1
    while end < len(said) and not said.breaks(end) and said.word(end) not in ("and", "or"):
        end += 1
    goal.add(Attribute(kind="feature", value=said.said(start + 1, end)))
    return end


def _part_is(said: Utterance, start: int, goal: Draft) -> int:
    """Read ", the handle is broken" and "and one wheel is missing"."""
    joined = said.word(start) in ("and", "but", "because", "its")
    if not (joined or said.breaks(start)):
        return start
    begin = start + joined
    phrase = read_noun_phrase(said, begin)
    if phrase is None or not is_part(phrase.head.rpartition(" ")[2]) or said.breaks(phrase.end):
        return start
    end = phrase.end + 2
    state = said.word(end - 1) in _STATES or listed_kind(said.word(end - 1)) is not None
    if said.word(phrase.end) not in ("is", "are", "was", "looks") or not state:
        return start
    if not said.breaks(end):
        return start
    goal.add(Attribute(kind="feature", value=without_article(said.said(begin, end))))
    return end


def read_material(said: Utterance, start: int, goal: Draft) -> int:
    """Read "made of oak", "in blue", "in size 42"."""
    index = start + (said.word(start) == "and")
    index += said.word(index) in SUBJECTS
    index += said.word(index) in BE
    length = said.starts(index, phrases.MADE)
    word = said.word(index + length)
    of = said.word(index + length - 1) == "of" and word not in STOP
    if not length or not (of or listed_kind(word) in ("material", "colour")):
        colour = said.word(index) == "in" and listed_kind(said.word(index + 1)) == "colour"
        sized = said.word(start + 1) in ("size", "sized") and said.word(start) != "any"
        if said.breaks(start) and sized and not said.breaks(start + 1):
            goal.add(Attribute(kind="size", value=said.said(start, start + 2)))
            return start + 2  # ", child size".
        if colour and not (said.word(start - 1) in COVERED and may_be_noun(said, index + 2)):
            goal.add(Attribute(kind="colour", value=said.word(index + 1)))
            return index + 2
        if (end := _size(said, index)) > index:
            goal.add(Attribute(kind="size", value=said.said(index + 1, end)))
            return end
        index += said.word(index) == "in"
        if said.word(index) == "size" and not said.breaks(index + 1):
            goal.add(Attribute(kind="size", value=said.said(index, index + 2)))
            return index + 2
        return start
    goal.add(Attribute(kind="material", value=word))
    return index + length + 1


def _size(said: Utterance, start: int) -> int:
    """Return the index after "in extra large", "in XL" or "in 42"; the same for none."""
    if said.word(start) != "in":
        return start
    index = start + 1 + (said.word(start + 1) in ("a", "an"))
    end = index
    while said.word(end) in _SIZES or listed_kind(said.word(end)) == "size":
        end += 1
    end += said.word(end).isdigit() if end == index else said.word(end) in ("size", "one")
    over = said.breaks(end) or said.word(end) in ("and", "or", "please")
    return end if end > index and over else start


def read_owner(said: Utterance, start: int, goal: Draft) -> int:
    """Read "that belongs to Max"."""
    index = start + (said.word(start) in SUBJECTS)
    length = said.starts(index, ("belongs to", "belong to", "belonging to", "owned by"))
    phrase = read_noun_phrase(said, index + length) if length else None
    if phrase is None:
        return start
    goal.add(Attribute(kind="owner", value=said.said(index + length, phrase.end)))
    return phrase.end


def read_side(said: Utterance, start: int, goal: Draft) -> int:
    """Read "on the left" where no "of" follows."""
    length = said.starts(start, phrases.SIDES)
    if not length or said.word(start + length) == "of":
        return start
    side = Attribute(kind="which", value=said.said(start, start + length))
    place = goal.relations[-1] if goal.relations else None
    if place is not None and place.place.endswith(said.word(start - 1)):
        # "On the second shelf from the top".
        goal.relations[-1] = replace(place, attributes=(*place.attributes, side))
    else:
        goal.add(side)
    return start + length


def read_until(said: Utterance, start: int, goal: Draft) -> int:
    """Read "until you have found six"."""
    if said.word(start) not in ("until", "till"):
        return start
    for index in range(start + 1, min(start + 6, len(said))):
        length = count_again(said, index)
        if length:
            goal.count = NUMBERS[said.word(index)]
            return index + length
    return start


def is_maker(said: Utterance, start: int, name: str) -> bool:
    """Tell whether "by" or "from" says who made or sent it: "by Agatha Christie"."""
    if said.word(start) not in ("by", "from") or not said.said(start + 1, start + 2)[:1].isupper():
        return False
    knowledge = load_knowledge()
    return knowledge.find(name) is None and knowledge.room(name) is None


def without_article(value: str) -> str:
    """Return words without their article."""
    first, _, rest = value.partition(" ")
    return rest if rest and first.lower() in ("a", "an", "the", "some", "its") else value
