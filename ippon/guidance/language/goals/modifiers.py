"""What follows an object and describes it: attributes, relations, exclusions."""

from dataclasses import replace

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.context_words import NEGATIONS
from ippon.guidance.language.goals.absence import read_absence
from ippon.guidance.language.goals.adjectives import (
    is_adjective_at,
    read_adjectives,
    read_apposed,
    read_unlisted,
)
from ippon.guidance.language.goals.drafts import Draft
from ippon.guidance.language.goals.features import (
    BE,
    SUBJECTS,
    read_feature,
    read_material,
    read_owner,
    read_side,
    read_until,
    without_article,
)
from ippon.guidance.language.goals.goal import Attribute, Relation
from ippon.guidance.language.goals.placed import read_placed, read_spot
from ippon.guidance.language.goals.purposes import read_activity, read_purpose, read_topic
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.attributes import (
    is_intensity,
    is_part,
    listed_kind,
)
from ippon.guidance.language.grammar.heads import ONES
from ippon.guidance.language.grammar.noun_ends import CONTAINERS
from ippon.guidance.language.grammar.noun_phrase import NounPhrase, read_noun_phrase
from ippon.guidance.language.grammar.places import holds_things, is_room
from ippon.guidance.language.grammar.relation_phrase import (
    read_relation,
)
from ippon.guidance.language.grammar.utterance import Utterance
from ippon.guidance.language.naming import same_object
from ippon.guidance.language.words import is_mass, word_set

_CONTRACTED = word_set("it's its they're he's she's that's")
_OWNED = word_set("mine yours his hers ours theirs")
_CONDITIONS = ("but only if", "only if", "as long as", "so long as", "provided", "provided that")
_HOLDING = CONTAINERS | word_set("box packet pack tube tub")


def read_modifier(said: Utterance, index: int, goal: Draft) -> int:
    """Read one thing that is said of a goal; returns the index after it, the same for none."""
    for read in (
        _exclusion,
        read_until,
        read_absence,
        _predicate,
        read_feature,
        read_material,
        read_owner,
        read_apposed,
        _other_one,
        read_placed,
        read_side,
        read_spot,
        read_topic,
        read_purpose,
        read_activity,
        _aside,
    ):
        end = read(said, index, goal)
        if end > index:
            return end
    return index


def _exclusion(said: Utterance, start: int, goal: Draft) -> int:
    """Read "but not the blue one", "except the one in the hallway", "not red"."""
    length = said.starts(start, phrases.EXCLUDING)
    if not length and said.word(start) == "but" and not said.breaks(start):
        # "Any mug but the red one".
        length = int(bool({"any", "all", "every"} & set(said.words(max(0, start - 4), start))))
    if not length:
        return start
    index = start + length
    if (end := _not_one_that(said, index, goal)) > index:
        return end
    bare = index
    while listed_kind(said.word(bare)) is not None and not said.breaks(bare):
        bare += 1
    owner = said.word(index)
    if owner.endswith("'s") and said.breaks(index + 1):
        value = said.said(index, index + 1)[:-2]
        goal.add(Attribute(kind="owner", value=value, negated=True))
        return index + 1
    if owner in _OWNED:
        goal.add(Attribute(kind="owner", value=owner, negated=True))
        return index + 1
    phrase = read_noun_phrase(said, index)
    if phrase is not None and phrase.head in ("", goal.head):
        place = goal.relations[-1] if goal.relations else None
        for one in phrase.attributes:
            if one in goal.attributes:
                continue  # "Her blue scarf, not her green one".
            denied = Attribute(kind=one.kind, value=one.value, negated=True)
            if place is not None and one.kind in {other.kind for other in place.attributes}:
                goal.relations[-1] = replace(place, attributes=(*place.attributes, denied))
            else:
                goal.add(denied)
        if said.word(phrase.end) in ("with", "without") and phrase.end + 1 == len(said):
            goal.note(said.said(start, phrase.end + 1))  # "Not the one without".
            return phrase.end + 1
        probe, end = goal.probe(), phrase.end
        if not said.breaks(end) and not said.starts(end, phrases.EXCLUDING):
            end = read_modifier(said, end, probe)
        for one in probe.attributes:
            goal.add(replace(one, negated=not one.negated))
        for relation in probe.relations:
            goal.relate(replace(relation, negated=not relation.negated))
            goal.note("not " + said.said(phrase.end, end))
        return _or_other(said, end, goal) if end == phrase.end else end
    if phrase is None or said.word(start) == "nor":
        return read_adjectives(said, index, goal, negated=True) or start
    return _other_name(said, start, phrase, goal)


def _not_one_that(said: Utterance, start: int, goal: Draft) -> int:
    """Read "one that's empty" after "but not"; returns the index after it, the same for none."""
    index = start + (said.word(start) in ("one", "ones", "any", "those"))
    if said.word(index) not in ("that", "that's", "which"):
        return start
    probe = goal.probe()
    end = read_modifier(said, index, probe)
    for one in probe.attributes:
        goal.add(replace(one, negated=not one.negated))
    for relation in probe.relations:
        goal.relate(replace(relation, negated=not relation.negated))
    return end if end > index else start


def _or_other(said: Utterance, index: int, goal: Draft) -> int:
    """Read "or green one" after "no red", and "or the brown one"."""
    named = said.word(index + 1) == "the" or is_adjective_at(said, index + 1)
    if said.word(index) not in ("or", "nor") or not named:
        return index
    phrase = read_noun_phrase(said, index + 1)
    if phrase is None or phrase.head not in ("", goal.head):
        return index
    for one in phrase.attributes:
        goal.add(replace(one, negated=True))
    return phrase.end


def _other_name(said: Utterance, start: int, phrase: NounPhrase, goal: Draft) -> int:
    """Read "not the sunglasses" as what is not meant, and "not the kitchen" as no place of it."""
    knowledge = load_knowledge()
    after = said.word(phrase.end)
    placed = goal.relations[-1] if goal.relations and phrase.determined else None
    ended = not after or said.breaks(phrase.end) or after in ("and", "or", "please")
    if not phrase.known and phrase.determined and ended and not is_room(phrase.head):
        # "Not the Lenovo".
        value = without_article(phrase.display)
        goal.add(Attribute(kind="other", value=value, negated=True))
        return phrase.end
    if not phrase.known or (after and not said.breaks(phrase.end) and after not in ("and", "or")):
        return start
    if knowledge.room(phrase.head) is not None and knowledge.find(phrase.head) is None:
        goal.relate(Relation(relation="in", place=phrase.head, negated=True))
        goal.note(f"not in the {phrase.head}")
    elif placed is not None and holds_things(phrase.head):
        # "In the drawer, not the fridge".
        goal.relate(Relation(relation=placed.relation, place=phrase.head, negated=True))
        goal.note(said.said(start, phrase.end))
    else:
        goal.add(Attribute(kind="other", value=phrase.display, negated=True))
    return phrase.end


def _predicate(said: Utterance, start: int, goal: Draft) -> int:
    """Read "which is blue and heavy", "it's the white one", "isn't broken"."""
    index, negated = start, False
    index += said.starts(index, _CONDITIONS) or said.word(index) in ("and", "but")
    subject = said.word(index) in SUBJECTS
    relative = said.word(index) in ("that", "that's", "which")
    be = said.word(index) in _CONTRACTED
    index += subject
    if said.word(index) in BE and not said.breaks(index):
        be, negated = True, said.word(index).endswith("n't")
        index += 1
    person = goal.is_owned and said.word(start) in ("he", "she", "he's", "she's")
    if not be or (person and listed_kind(said.word(index)) in ("condition", "feel")):
        return start  # "Eva's coat, she is cold".
    if said.word(index) in ("not", "neither", "never"):
        negated, index = True, index + 1
    while is_intensity(said.word(index)) or said.word(index) in ("also", "all", "just", "only"):
        index += 1
    if said.word(index) == "last" and said.word(index + 2) == "by":
        user = read_noun_phrase(said, index + 3)
        goal.note(said.said(start, user.end if user is not None else index + 2))
        return user.end if user is not None else start  # "Was last used by Carol".
    article = said.word(index) in ("a", "an", "the", "my", "one", "that")
    if article:
        phrase = read_noun_phrase(said, index)
        if phrase is None or phrase.head not in ("", goal.head):
            return start
        if not phrase.attributes:
            # "It's the one with two handles".
            described = not negated and read_modifier(said, phrase.end, goal.probe()) > phrase.end
            return phrase.end if described else start
        for one in phrase.attributes:
            goal.add(Attribute(kind=one.kind, value=one.value, negated=negated))
        return phrase.end
    owner = said.word(index)
    if owner in _OWNED or (owner.endswith("'s") and said.breaks(index + 1)):
        value = said.said(index, index + 1).removesuffix("'s")
        goal.add(Attribute(kind="owner", value=value, negated=negated))
        return index + 1
    end = read_adjectives(said, index, goal, negated=negated)
    does = said.word(end + 1)
    joined = end and said.word(end) == "and" and does.endswith("s") and said.breaks(end + 2)
    if joined and load_knowledge().find(does) is None:
        goal.add(Attribute(kind="feature", value=does))  # "It's yellow and squeaks".
        return end + 2
    if not end and (relative or negated):
        end = read_unlisted(said, index, goal, negated=negated)
    return end or start


def _other_one(said: Utterance, start: int, goal: Draft) -> int:
    """Read ", the blue one" and "the one on the sofa" as more about the same object."""
    if said.word(start) in ("and", "or") or said.word(start) in NEGATIONS:
        return start
    if start >= len(said) or phrases.ASKED.match(said.text, said.tokens[start].start):
        return start  # "Bring another one".
    if said.word(start) == "last" and read_relation(said, start) is not None:
        return start  # "Last seen in the hall".
    phrase = read_noun_phrase(said, start, of=False)
    if phrase is None or phrase.reference:
        return start
    if not phrase.head and said.word(phrase.end - 1) in ONES:
        several = goal.count not in (None, 1) and said.word(start) in ("a", "an", "one", "the")
        several = several and said.word(phrase.end - 1) == "one"
        stated = said.word(phrase.end) in BE and not said.breaks(phrase.end)
        kind = said.word(phrase.end - 1) == "ones" and goal.count == 1 and not goal.attributes
        if phrase.count not in (None, 1) or several or (stated and not kind):
            return start  # "The big box, the small one is empty".
        more = read_noun_phrase(said, phrase.end + 1) if said.word(phrase.end) == "and" else None
        if more is not None and not more.head and said.word(start) in ("a", "an"):
            return start  # "A red pen, a blue one and a black one".
        for one in phrase.attributes:
            goal.add(one)
        return phrase.end
    owned = any(one.kind == "owner" and one.negated for one in goal.attributes)
    if owned and not phrase.head and said.word(phrase.end - 1).endswith("'s"):
        for one in phrase.attributes:
            goal.add(one)  # "Not today's, yesterday's".
        return phrase.end
    bare = not phrase.head and said.breaks(start) and phrase.shared
    part = bool(phrase.head) and is_part(phrase.head.split()[-1]) and phrase.attributes
    if bare:
        for one in phrase.attributes:
            goal.add(one)
        last = said.word(phrase.end) in ("and", "or") and said.breaks(phrase.end + 2)
        more = read_adjectives(said, phrase.end + 1, goal, negated=False) if last else 0
        return more or phrase.end  # "Markers: red, black and blue".
    contained = is_mass(goal.head) and phrase.head in _HOLDING and bool(phrase.attributes)
    if said.breaks(start) and said.word(start) == "the" and contained:
        goal.add(Attribute(kind="feature", value=without_article(phrase.display)))
        return phrase.end  # "The milk, the small carton".
    if said.breaks(start) and said.word(start) == "the" and _is_same(phrase.head, goal.head):
        for one in phrase.attributes:
            goal.add(one)
        return phrase.end
    if part and said.breaks(start):
        goal.add(Attribute(kind="feature", value=without_article(phrase.display)))
        return phrase.end
    return start


def _is_same(one: str, other: str) -> bool:
    """Tell whether two different names stand for one thing: "my medicine, the white pills"."""
    return bool(one) and one != other and same_object(one, other)


def _aside(said: Utterance, start: int, goal: Draft) -> int:
    """Read "(the blue ones)" and "preferably red"."""
    if "(" in said.gap(start):
        end = start + 1
        while end < len(said) and ")" not in said.gap(end) and end - start < 6:
            end += 1
        phrase = read_noun_phrase(said, start)
        if phrase is not None and phrase.end == end and phrase.head and phrase.known:
            goal.note(said.said(start, end))  # "(kitchen drawer)".
        else:
            goal.add(Attribute(kind="feature", value=said.said(start, end)))
        return end
    length = said.starts(start, ("preferably", "ideally", "if possible", "best"))
    if not length:
        return start
    found = read_adjectives(said, start + length, goal, negated=False)
    return found or max(_other_one(said, start + length, goal), start)
