"""Clauses beside a request: where they end, and what they tell of the place of an object."""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from ippon.guidance.language.context import Claim, read_context
from ippon.guidance.language.context_words import BELIEFS, DOUBTS, HABITS, MOVED, NEGATIONS
from ippon.guidance.language.goals.drafts import Draft, Reading
from ippon.guidance.language.goals.goal import Relation
from ippon.guidance.language.goals.modifiers import read_modifier
from ippon.guidance.language.grammar import phrases
from ippon.guidance.language.grammar.noun_phrase import read_noun_phrase
from ippon.guidance.language.grammar.places import holds_things, is_room, is_searched_inside
from ippon.guidance.language.grammar.relation_phrase import read_relation, relation_to
from ippon.guidance.language.grammar.utterance import Utterance, hear
from ippon.guidance.language.languages import ENGLISH
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.language.words import word_set

_SOFT: Final = ("likes to", "like to", "used to", "supposed to", "should be", "not sure", "i think")
_HAD = re.compile(r"(?<!\blast )\bhad (?:it|them|him|her|one)\b", re.IGNORECASE)
_ABOUT = word_set(
    "it it's its they they're them he he's she she's one ones left leave put forgot forgotten saw "
    "seen had kept keep dropped placed stored hid hidden laid looked checked searched"
)


_SOUGHT = word_set("bother look looking search searching check checking go going try trying enter")
_DECLINED_AT: Final = ("on", "under", "behind", "near", "beside", "above")
_RELATIVE: Final = ("which", "that", "who", "whose")
_PLACING = word_set("in on under at behind near inside upstairs downstairs outside above below")
_TIMES = word_set(
    "yesterday morning afternoon evening night noon tonight week weekend month year ago earlier "
    "recently breakfast lunch dinner supper monday tuesday wednesday thursday friday saturday "
    "sunday"
)


def clause_end(reading: Reading, start: int, *, whole: bool = True) -> int:
    """Return the index after the clause that begins at a word; without `whole`, up to a comma."""
    said = reading.said
    index = start + 1
    placed = None if reading.drafts else read_relation(said, start)
    while index < len(said) and not said.ends(index) and (whole or not said.breaks(index)):
        joint = said.word(index) in ("and", "but", "so", "oh", "then") or said.breaks(index)
        joint = joint or said.word(index - 1) in ("and", "but", "so")
        if joint and _begins_request(reading, index):
            break
        early = not reading.drafts
        if early and _asks_inside(reading, index):
            break
        after = placed is not None and placed.end == index  # "It's on the shelf my list".
        beside = early or said.word(start) in ("if", "when", "while")
        if beside and (after or said.breaks(index)) and _names_late(reading, index):
            break
        index += 1
    return index


def ends_clause(said: Utterance, index: int) -> bool:
    """Tell whether nothing more is said before a word of what stands before it."""
    if said.breaks(index) or index >= len(said):
        return True
    return said.word(index) in ("and", "or", "nor", "but", "then", "because", "please") or (
        read_relation(said, index) is not None
    )


def _asks_inside(reading: Reading, index: int) -> bool:
    """Tell whether a sentence that began with something else asks here, or leads to a place."""
    if reading.said.breaks(index) or reading.said.word(index - 1) in ("so", "but", "and", "then"):
        for leading in (phrases.GO, phrases.SEVERAL):
            after = reading.match(leading, index)
            if after > index and read_noun_phrase(reading.said, after) is not None:
                return True
    if reading.match(phrases.TOLD, index) > index:
        phrase = read_noun_phrase(reading.said, reading.match(phrases.TOLD, index))
        return phrase is not None
    if reading.said.word(index) not in phrases.STRONG:
        asked = reading.match(phrases.ASKED, index) - index
        if asked < 2:
            return False
    end = reading.match(phrases.ASKED, index)
    return end > index and read_noun_phrase(reading.said, end) is not None


def _names_late(reading: Reading, index: int) -> bool:
    """Tell whether a sentence ends in the object: "it's not on the fridge: my list"."""
    said = reading.said
    phrase = read_noun_phrase(said, index)
    if phrase is None or not phrase.head or is_room(phrase.head):
        return False
    owned = said.word(index) in ("my", "our", "your", "his", "her", "the", "a", "an", "some")
    return (owned or ":" in said.gap(index)) and said.ends(phrase.end)


def _begins_request(reading: Reading, index: int) -> bool:
    said = reading.said
    also = said.starts(index, ("and also", "oh and", "oh and also", "and then", "then", "plus"))
    start = index + also
    while start < len(said) and reading.match(phrases.ASKED, start) == start:
        padded = reading.match(phrases.PADDING, start)
        if padded == start:
            break
        start = padded
    asked = reading.match(phrases.ASKED, start) if start < len(said) else start
    if asked > start:
        return read_noun_phrase(said, asked) is not None or said.word(asked) in ("it", "them")
    if also and read_noun_phrase(said, start) is not None:
        return True
    if reading.drafts:
        phrase = read_noun_phrase(said, index + 1) if said.word(index) == "and" else None
        if phrase is not None and said.word(phrase.end) in ("too", "also"):
            return True
        if not said.breaks(index):
            return False
        probe = reading.drafts[-1].probe()
        corrected = said.starts(index, phrases.CORRECTIONS) > 0
        return corrected or read_modifier(said, index, probe) > index
    while said.word(index) in ("and", "but", "so", "now", "then", "today", "oh"):
        index += 1
    gone = index < len(said) and reading.match(phrases.GONE_SENTENCE, index) > index
    return gone or (index < len(said) and reading.match(phrases.TOLD, index) > index)


def state(reading: Reading, words: str, targets: list[Draft]) -> None:
    """Take what a clause says about the place of objects."""
    told = False
    heard = hear(words).words(0, 400)
    content = [word for word in heard if word not in ENGLISH]
    kept = (
        bool(content)
        or bool((_TIMES | _PLACING) & set(heard))
        or (len(heard) > 1 and heard[0] in _RELATIVE)
    )
    soft = any(phrase in words.lower() for phrase in _SOFT) or _is_memory(words)
    for goal in targets:
        ooi = resolve_object(goal.head, ()).canonical if goal.head else None
        claims = _joined(read_context(words, (), ooi=ooi).claims, words)
        moved = None if soft else _moved_to(words)
        if moved is not None:
            goal.relations = [moved]
            goal.note(words)
            told = True
            continue
        about = _is_about_object(words, owned=goal.is_owned)
        for claim in claims:
            told = True
            if claim.strength != "sure" or soft or not about:
                continue
            said_first = [one.place for one in reading.places if one.negated == claim.negated]
            for one in _relations_of(claim.text) or _named_place(claim):
                if not any(one.place in place for place in said_first):
                    goal.relate(replace(one, negated=claim.negated))
        if not claims and not soft:
            for one in _relations_of(words):
                told = True
                goal.relate(one)
        if told or claims or kept:
            goal.note(words)
    placed = any(one.place.lower() in words.lower() for one in reading.places)
    if not told and content and not placed:
        reading.unused.append(words.strip())


def _moved_to(words: str) -> Relation | None:
    """Return where an object was brought: "Anna moved them from the sofa to the hall"."""
    said = hear(words)
    heard = said.words(0, len(said))
    moved = next((n for n, word in enumerate(heard) if word in MOVED), len(heard))
    unsure = (NEGATIONS | BELIEFS | DOUBTS | HABITS) & set(heard)
    if unsure or not {"it", "them", "him", "her"} & set(heard[moved:]):
        return None
    for index in range(moved, len(heard)):
        place = read_noun_phrase(said, index + 1) if heard[index] in ("to", "into") else None
        if place is not None and holds_things(place.head):
            relation = "in" if is_searched_inside(place.head) else "at"
            return relation_to(said, index + 1, place, relation)
    return None


def _is_memory(words: str) -> bool:
    """Tell whether somebody had a thing at a time and a place, where it need not be now."""
    return bool(_HAD.search(words) and phrases.TIME.search(words))


def _joined(claims: Sequence[Claim], words: str) -> list[Claim]:
    """Return the claims with two nouns beside each other as one place: "in the bread bin"."""
    joined: list[Claim] = []
    for claim in claims:
        last = joined[-1] if joined else None
        beside = last is not None and not words[last.end : claim.start].strip()
        if last is not None and beside and hear(claim.text).word(0) not in phrases.PREPOSITIONS:
            text = words[last.start : claim.end]
            joined[-1] = replace(last, place=claim.place, end=claim.end, text=text)
        else:
            joined.append(claim)
    return joined


def _relations_of(words: str) -> list[Relation]:
    said, index = hear(words), 0
    relations: list[Relation] = []
    while (phrase := read_relation(said, index)) is not None:
        relations += phrase.relations
        index = phrase.end
    return relations


def _named_place(claim: Claim) -> list[Relation]:
    """Return the place of a claim that stands without its own preposition: "or the hall"."""
    if claim.relation not in phrases.PREPOSITIONS.values() or claim.relation == "of":
        return []
    phrase = read_noun_phrase(hear(claim.text), 0)
    return [Relation(relation=claim.relation, place=phrase.head)] if phrase else []


def _is_about_object(words: str, *, owned: bool) -> bool:
    """Tell whether a clause says where the object is, not where somebody was."""
    said = hear(words)
    heard = set(said.words(0, len(said)))
    if owned and {"he", "she", "he's", "she's"} & heard and not {"it", "them", "left"} & heard:
        return False
    if _ABOUT & heard:
        return True
    return read_relation(said, 0) is not None


def note_subject(reading: Reading, start: int, end: int) -> None:
    """Note the first thing that a clause before the first object names."""
    for index in range(start, end):
        phrase = read_noun_phrase(reading.said, index)
        named = phrase is not None and phrase.known and phrase.head
        if phrase is not None and named and (phrase.determined or index == start):
            reading.subject = None if is_room(phrase.head) else phrase
            return


def skip_declined(reading: Reading, index: int) -> int:
    """Skip an object not to be searched for ("don't look for the cup"), and note it as not used.

    Returns:
        Index after it; `index` where no such words stand.
    """
    said = reading.said
    end = _skip_place(reading, index)
    if end > index:
        return end
    start = reading.match(phrases.DECLINED, index)
    phrase = read_noun_phrase(said, start) if start > index else None
    if phrase is None:
        return index
    end = phrase.end
    while end < len(said) and not said.breaks(end) and said.word(end) not in ("but", "and"):
        if reading.match(phrases.ASKED, end) > end + 1:
            break  # "I don't want the cup I want the plate".
        end += 1
    reading.unused.append(said.said(index, end))
    reading.declined = phrase
    return end


def _skip_place(reading: Reading, index: int) -> int:
    """Skip a place not to be searched: "don't look under the bed for", "don't look upstairs"."""
    said = reading.said
    start = reading.match(phrases.PLACE_DECLINED, index)
    if start == index:
        return index
    storey = read_relation(said, start, verbs=False)
    if storey is not None and storey.end == start + 1:
        place, end = replace(storey.relations[0], negated=True), storey.end
    else:
        phrase = read_noun_phrase(said, start)
        if phrase is None:
            return index
        before = said.word(start - 1)
        relation = phrases.PREPOSITIONS[before] if before in _DECLINED_AT else "in"
        heard = set(said.words(index, start))
        named = not phrase.known or relation != "in" or said.word(phrase.end) == "for"
        named = named or (holds_things(phrase.head) and "bother" not in heard)
        if not (is_room(phrase.head) or (_SOUGHT & heard and named)):
            return index
        place = relation_to(said, start, phrase, relation, negated=True)
        end = phrase.end
        other = read_noun_phrase(said, end + 1) if said.word(end) in ("or", "nor", "and") else None
        if other is not None and holds_things(other.head):
            decline_place(reading, relation_to(said, end + 1, other, relation, negated=True))
            end = other.end
    decline_place(reading, place)
    return end + (said.word(end) == "for" and not reading.drafts)


def decline_place(reading: Reading, place: Relation) -> None:
    """Take a place as that of no object: of the list before, else of those that follow."""
    for goal in reading.drafts[reading.list_start :]:
        goal.relate(place)
        goal.note(place.text)
    if not reading.drafts:
        reading.places.append(place)
        reading.before.append(place.text)
