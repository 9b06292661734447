"""Lists of objects: what separates them, what belongs to them, and what they share."""

from typing import Final

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.goals.absence import read_gone
from ippon.guidance.language.goals.drafts import Reading, draft
from ippon.guidance.language.goals.features import tells_of_part
from ippon.guidance.language.goals.goal import Order
from ippon.guidance.language.goals.list_end import settle
from ippon.guidance.language.goals.modifiers import read_modifier
from ippon.guidance.language.goals.pronouns import read_place_named
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.determiners import NUMBERS, count_again, is_person_at
from ippon.guidance.language.grammar.name_rows import begins_name
from ippon.guidance.language.grammar.noun_phrase import NounPhrase, read_noun_phrase
from ippon.guidance.language.grammar.phrases import PRONOUNS
from ippon.guidance.language.grammar.places import is_room
from ippon.guidance.language.grammar.relation_phrase import read_relation, relation_to
from ippon.guidance.language.grammar.utterance import Utterance, named_words
from ippon.guidance.language.lists.left_out import is_left_out
from ippon.guidance.language.lists.list_item import take_item
from ippon.guidance.language.lists.list_order import is_named_first, read_packages
from ippon.guidance.language.words import word_set

MAX_DRAFTS: Final = 60
BE = word_set("is are was were has have had will would can could should must might may says said")

_LEVELS = ("floor", "storey", "level")
_PARTS = ("drawer", "shelf", "compartment", "cupboard", "locker", "row", *_LEVELS)
_FOLLOWING = word_set(
    "and or then but with without that which please not pls it i they he she what called made "
    "named as plus followed left other preferably fell must should might slipped for "
    "of all also again asap too except after next nobody somebody someone"
)
"""Words that may follow an object which stands without a verb."""


_SUITING: Final = (
    "will do",
    "would do",
    "is fine",
    "are fine",
    "is ok",
    "is okay",
    "would be fine",
)


def separator(reading: Reading, index: int) -> tuple[Order, int, NounPhrase] | None:
    """Return order, place and noun phrase of the next object of a list."""
    said = reading.said
    goes_on = ";" in said.gap(index) or said.word(index) in ("and", "plus")
    if index >= len(said) or (said.ends(index) and not goes_on):
        return None
    order: Order = "and"
    length = 0
    for name in ("then", "or", "and"):
        found = said.starts(index, phrases.SEPARATORS[name])
        if found > length:
            length, order = found, name
    comma = said.breaks(index)
    if not length and not comma and not begins_name(said, index):
        return None
    start = index + length
    while start < len(said) and length and (end := reading.match(phrases.PADDING, start)) > start:
        if end == start + 1:
            break
        start = end
    if said.word(start) in ("then", "also", "maybe", "please", "either", "perhaps"):
        order = "then" if said.word(start) == "then" else order
        start += 1
    if length and _asks_again(reading, start):
        start += 1
    if start < len(said) and reading.match(phrases.DECLINED, start) > start:
        return None
    if start < len(said) and reading.match(phrases.ASKED, start) > start:
        known = load_knowledge().find(" ".join(said.words(start, start + 2)))
        if known is None:
            return None
    if said.breaks(start) and start > index and said.ends(start):
        return None
    phrase = read_noun_phrase(said, start)
    if phrase is None or not _is_item(reading, start, phrase, lone=not length):
        return None
    if is_left_out(said, phrase) or is_named_first(reading, phrase):
        return None
    return order, start, phrase


def _asks_again(reading: Reading, index: int) -> bool:
    """Tell whether "look" holds for one more object: "look for the cup, then for the book"."""
    said = reading.said
    if not reading.asked_for or said.word(index) != "for" or said.breaks(index + 1):
        return False
    # "A cushion for the sofa and for the armchair" is one object.
    goals = reading.drafts[reading.list_start :]
    return not any(one.value.startswith("for ") for goal in goals for one in goal.attributes)


def _is_item(reading: Reading, start: int, phrase: NounPhrase, *, lone: bool) -> bool:
    said = reading.said
    following = said.word(phrase.end)
    if any(place.place == phrase.head for goal in reading.drafts for place in goal.relations):
        return False
    if (said.word(start) in PRONOUNS and phrase.head) or is_room(phrase.head):
        return False
    if not phrase.head and not phrase.determined:
        return False
    verb = following in BE and not said.breaks(phrase.end)
    verb = verb and not said.starts(phrase.end, _SUITING)
    if verb and reading.match(phrases.GONE, phrase.end) == phrase.end:
        relation = read_relation(said, phrase.end)
        if relation is None:
            return False
    last = said.word(phrase.end - 1)
    acts = last.endswith("s") and " " in phrase.head and last.removesuffix("s") not in named_words()
    if acts and not phrase.known and not said.breaks(phrase.end):
        return False  # "The family arrives at six".
    if lone:
        # "Hat, pepper, and oil": what stands within a list belongs to it.
        within = said.word(phrase.end) in ("and", "or") and phrase.end - start <= 2
        listed = len(reading.drafts) - reading.list_start > 1 and said.breaks(phrase.end)
        listed = listed or _goes_on(reading, phrase.end)
        return phrase.determined or phrase.known or within or listed
    return (
        phrase.known
        or phrase.determined
        or phrase.corrected
        or not said.word(start).endswith("ing")
    )


def _goes_on(reading: Reading, index: int) -> bool:
    """Tell whether a comma and one more object follow: ", box cutter, tape gun"."""
    said = reading.said
    if said.gap(index).strip() != ",":
        return False
    if any(reading.match(known, index) > index for known in (phrases.PADDING, phrases.TAIL)):
        return False
    phrase = read_noun_phrase(said, index)
    named = phrase is not None and bool(phrase.head) and not is_room(phrase.head)
    return phrase is not None and named and said.breaks(phrase.end)


def read_goals(reading: Reading, start: int, asked: str) -> int:
    """Read a list of objects; returns the index after it, the same for none."""
    said = reading.said
    order: Order = reading.order or "and"
    phrase = _object_at(reading, start)
    if phrase is None:
        return start
    reading.list_start = len(reading.drafts)
    reading.asked_for = said.word(start - 1) == "for"
    apposed, commas = False, True
    while True:
        take_item(reading, phrase, order, asked, apposed=apposed)
        index = read_modifiers(reading, phrase.end)
        following = separator(reading, index)
        apposed = said.breaks(index) and said.word(index) in ("the", "my", "our", "his", "her")
        if following is None or len(reading.drafts) >= MAX_DRAFTS:
            break
        commas = commas and (following[1] == index or following[0] == "or")
        order, index, phrase = following
    if commas and order == "or":
        for one in reading.drafts[reading.list_start + 1 :]:
            one.order = "or"  # "Tea, coffee or juice".
    reading.order = None
    settle(reading)
    if said.word(index) == "instead":
        index += 1
    return index


def _object_at(reading: Reading, index: int) -> NounPhrase | None:
    """Return the noun phrase at an index; "not the red mug but" is left to the one after."""
    said = reading.said
    if said.word(index) in ("either", "both") and read_noun_phrase(said, index) is None:
        index += 1
    return read_noun_phrase(said, index)


def read_modifiers(reading: Reading, index: int) -> int:
    """Read all that follows an object and describes it."""
    said, goal = reading.said, reading.drafts[-1]
    while index < len(said):
        if said.word(index) in ("they", "they're") and len(reading.drafts) > reading.list_start + 1:
            break  # Said of the whole list.
        task = reading.match(phrases.TASK, index)
        if task > index and goal.trigger != "told" and reading.match(phrases.PADDING, index) < task:
            reading.unused.append(said.said(index, task))
            index = task
            continue
        if said.ends(index) or (said.breaks(index) and said.starts(index, phrases.CORRECTIONS)):
            break
        gone = read_gone(said, index, goal)
        if gone > index:
            index = gone
            continue
        padded = reading.match(phrases.PADDING, index)
        if padded >= index + 3:
            index = padded  # "It's cold outside".
            continue
        room = _bare_room(reading, index)
        if room > index:
            index = room
            continue
        index = read_packages(reading, index)
        about = index + (said.word(index) in ("about", "around", "roughly", "exactly"))
        counted = count_again(said, about) if said.breaks(index) else 0
        if counted > 1:
            goal.count = NUMBERS[said.word(about)]
            index = about + counted  # "Rope stands, six of them".
            continue
        end = reading.match(phrases.GONE, index)
        goal.gone = goal.gone or end > index
        end = max(end, read_place_named(reading, index))
        timed = reading.match(phrases.TIME, index)
        if timed > index:
            goal.note(said.said(index, timed))
            end = timed
        if end == index and not _listed_next(reading, index):
            end = read_modifier(said, index, goal)
        if end == index and not said.ends(index):
            end = reading.match(phrases.TAIL, index)
        if end == index:
            break
        if said.ends(end):
            return end
        index = end
    return index


def _listed_next(reading: Reading, index: int) -> bool:
    """Tell whether the next object of a list begins: "and the blue one"."""
    if tells_of_part(reading.said, index, reading.drafts[-1]):
        return False
    said = reading.said
    listed = said.word(index) in ("and", "or")
    listed = listed or (reading.asked_for and said.starts(index, phrases.SEPARATORS["then"]) > 0)
    return listed and separator(reading, index) is not None


def _bare_room(reading: Reading, index: int) -> int:
    """Read ", kitchen" and ", third drawer down" after an object."""
    said = reading.said
    if said.ends(index):
        return index
    phrase = read_noun_phrase(said, index, of=False)
    if phrase is not None and phrase.head in _PARTS and said.word(phrase.end) == "of":
        phrase = read_noun_phrase(said, index)  # "Top shelf of the cupboard".
    if phrase is None:
        return index
    end = phrase.end + (said.word(phrase.end) in ("down", "up"))
    part = phrase.shared and phrase.head.endswith(" floor")
    part = part or (phrase.shared and phrase.head in _PARTS and phrase.attributes)
    if not (is_room(phrase.head) or part) or not said.breaks(end):
        return index
    level = phrase.head in ("shelf", *_LEVELS) or phrase.head.endswith(" floor")
    relation = "on" if level else "in"
    place = relation_to(said, index, phrase, relation)
    reading.drafts[-1].relate(place)
    reading.drafts[-1].note(place.text)
    return end


def _is_room_at(said: Utterance, index: int) -> bool:
    phrase = read_noun_phrase(said, index, of=False)
    return phrase is not None and is_room(phrase.head)


def stands_alone(reading: Reading, index: int, phrase: NounPhrase) -> bool:
    """Tell whether a noun phrase is not the subject of a sentence about something else."""
    said = reading.said
    if not reading.drafts and reading.match(phrases.TOLD_OF_IT, index) > index:
        return False  # "My wife left it in the kitchen. Find my hat".
    if not phrase.known and not phrase.corrected:
        last = said.word(phrase.end - 1)
        if last.endswith("ing") or said.word(index) in phrases.OTHER_TASKS:
            return False
    end = phrase.end
    if end >= len(said) or said.breaks(end) or not phrase.head:
        return True
    if (
        said.word(end) in _FOLLOWING
        or is_person_at(said, end)
        or _is_room_at(said, end)
        or (phrase.known and said.word(end) in ("my", "our", "you"))
        or said.corrected(end, phrases.CORRECTIONS) > end
        or begins_name(said, end)
    ):
        return True
    if reading.match(phrases.PADDING, end) == len(said):
        return True  # "Keys, keys, where are they".
    if said.word(end) in ("was", "were") and said.word(end + 1).endswith("ed"):
        return True  # "Was delivered this morning".
    if reading.match(phrases.TAIL, end) > end or reading.match(phrases.GONE, end) > end:
        return True
    probe = draft(phrase)
    return read_modifier(said, end, probe) > end


def continues(reading: Reading, index: int) -> bool:
    """Tell whether "and" or "but" goes on with the object before, or with a list."""
    return (
        separator(reading, index) is not None
        or read_modifier(reading.said, index, reading.drafts[-1].probe()) > index
    )
