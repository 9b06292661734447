"""Reading of the operator's context: where the object is, or is not.

Not a parser of English: it finds the places in a text (things of the knowledge table, rooms,
activities), the preposition before each, and negations and doubts in the same clause.
"""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ippon.guidance.knowledge import Knowledge, load_knowledge
from ippon.guidance.language import context_words as lexicon
from ippon.guidance.language.context_polarity import (
    Strength,
    is_gone,
    polarity,
    retracts,
    strength_of,
    was_placed,
)
from ippon.guidance.language.mentions import Mention, distinction, find_mentions, room_phrases
from ippon.guidance.language.naming import category_of
from ippon.guidance.language.words import ADJECTIVES, DETERMINERS, Token, tokenize
from ippon.vocabulary import in_words

MAX_CLAIMS = 12
_BREAK = re.compile(r"[.!?;:\n…]|\s[-–—]+\s")
_REACH = 4
"""Most words between a preposition and the place."""
_UNCLEAR = frozenset({"floor", "wall", "ceiling"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One statement about where the object is, or is not."""

    relation: str
    """on, in, under, above, next to, near, between, behind, in front of, at, to, from, …"""
    place: str
    """Canonical label of a thing, or a type of room."""
    kind: Literal["thing", "room"]
    label: str | None
    """Label of the vocabulary for the place, or for a wider thing."""
    room: str | None = None
    """Room type stated with a thing: the table in the kitchen."""
    negated: bool
    strength: Strength
    start: int
    """Offset in the context of the first character of the claim."""
    end: int
    text: str
    """The operator's words."""
    which: frozenset[str] = frozenset()
    """Words that tell the place from others of its type: "small", "anna's"."""

    @property
    def firm(self) -> bool:
        """Whether the place is stated, not given as a habit or a possibility."""
        return self.strength in ("sure", "likely")


@dataclass(frozen=True, slots=True, kw_only=True)
class ContextReading:
    """Result of reading a context."""

    claims: tuple[Claim, ...]
    notes: tuple[str, ...]
    """Messages about parts that were not understood."""


@dataclass(frozen=True, slots=True)
class _Clause:
    tokens: tuple[Token, ...]
    first: int = 0
    """Index of the first word after what the speaker does not know: "I'm not really sure"."""

    @property
    def words(self) -> list[str]:
        return [token.word for token in self.tokens]


def read_context(
    context: str,
    vocabulary: Sequence[str],
    *,
    ooi: str | None = None,
    rooms: Collection[str] = (),
) -> ContextReading:
    """Return the claims of a context.

    Args:
        context: Free text.
        vocabulary: Labels of the common objects.
        ooi: Canonical label of the goal; its own mentions are not places.
        rooms: Names of the map's rooms, as words in lower case.
    """
    knowledge = load_knowledge()
    claims: list[Claim] = []
    last = 0
    placed = False
    notes: list[str] = []
    for clause in _clauses(context):
        found = _read_clause(context, clause, knowledge, ooi, rooms)
        placed = was_placed(clause.words) if found else placed
        gone = is_gone(clause.words, placed=placed)
        if gone and found:
            found = [_retracted(claim, clause) for claim in found]
        elif not found and (gone or retracts(clause.words)):
            claims[last:] = [_retracted(claim, clause) for claim in claims[last:]]
        last = len(claims) if found else last
        claims += found
        notes += _not_understood(clause, found, knowledge, ooi)
    kept: list[Claim] = []
    for claim in claims:
        if claim.place in _UNCLEAR and claim.room is None:
            notes.append(f"“{claim.text}” does not narrow the search: it is in every room")
            continue
        kept = [other for other in kept if not _corrects(claim, other)]
        if len(kept) < MAX_CLAIMS and not any(_same(claim, other) for other in kept):
            kept.append(_labelled(claim, vocabulary, knowledge))
    notes += [
        f"“{name}” counts once a room of that name is known"
        for name in room_phrases(context)
        if name not in rooms
    ]
    if context.strip() and not kept and not notes:
        notes.append("no place was understood in the context")
    return ContextReading(claims=tuple(kept), notes=tuple(dict.fromkeys(notes)))


def _retracted(claim: Claim, by: _Clause) -> Claim:
    """Return a claim denied by a clause; what is usual is denied for now: "but today not"."""
    strength = strength_of(by.words)
    if strength == "sure" and not claim.firm:
        strength = "likely"
    return replace(claim, negated=True, strength=strength)


def _same(one: Claim, other: Claim) -> bool:
    return (one.place, one.room, one.negated) == (other.place, other.room, other.negated)


def _corrects(later: Claim, claim: Claim) -> bool:
    """Tell whether a claim takes an earlier one back: "in the hall, but it's not in the hall"."""
    if later.negated == claim.negated or claim.firm > later.firm:
        return False
    if later.negated and not later.which <= claim.which:
        return False  # "In a bathroom, but not in the guest bathroom".
    if later.negated and later.kind == "room" and claim.room == later.place:
        return later.relation not in lexicon.BESIDE
    beside = {later.relation, claim.relation} & lexicon.BESIDE
    if beside and later.relation != claim.relation:
        return False
    same_room = claim.room == later.room or (later.negated and later.room is None)
    return claim.place == later.place and same_room


def _labelled(claim: Claim, vocabulary: Sequence[str], knowledge: Knowledge) -> Claim:
    entry = knowledge.find(in_words(claim.place)) if claim.kind == "thing" else None
    return replace(claim, label=category_of(entry, vocabulary)) if entry else claim


def _clauses(context: str) -> list[_Clause]:
    clauses: list[list[Token]] = [[]]
    tokens = tokenize(context)
    for index, token in enumerate(tokens):
        gap = context[tokens[index - 1].end : token.start] if index else ""
        after_but = index and tokens[index - 1].word in {"anywhere", "everywhere"}
        if (
            _BREAK.search(gap)
            or ("," in gap and token.word in lexicon.CLAUSE_STARTS)
            or (token.word in lexicon.CLAUSE_WORDS and not after_but)
        ):
            clauses.append([])
        clauses[-1].append(token)
    return _merge_asides([_Clause(tuple(clause)) for clause in clauses if clause])


def _merge_asides(clauses: list[_Clause]) -> list[_Clause]:
    """Join clauses that only express certainty to the clause that they refer to."""
    merged: list[_Clause] = []
    pending: tuple[Token, ...] = ()
    for clause in clauses:
        if not set(clause.words) <= lexicon.ASIDES:
            known = [n for n, token in enumerate(pending) if token.word in lexicon.KNOWING]
            merged.append(_Clause(pending + clause.tokens, max(known, default=-1) + 1))
            pending = ()
        elif merged:
            merged[-1] = replace(merged[-1], tokens=merged[-1].tokens + clause.tokens)
        else:
            pending += clause.tokens
    return merged


def _read_clause(
    context: str, clause: _Clause, knowledge: Knowledge, ooi: str | None, rooms: Collection[str]
) -> list[Claim]:
    words = clause.words
    here = words[:2] in (["i", "am"], ["we", "are"]) or words[0] in {"i'm", "we're"}
    if here and not {"it", "left", "leave", "leaving", "sure", "certain"} & set(words):
        # The present position of the speaker is irrelevant.
        return []
    mentions = find_mentions(words, knowledge, ooi, rooms=rooms)
    places = {index for mention in mentions for index in range(mention.start, mention.end)}
    claims: list[Claim] = []
    last_end = 0
    inherited: str | None = None
    for number, mention in enumerate(mentions):
        relation, begin = _relation_before(words, mention, last_end, inherited)
        if mention.kind == "activity":
            relation, begin = relation or "while", mention.start
        elif relation is None and (
            mention.places[0] in lexicon.STOREYS or _is_bare(words, mentions, number)
        ):
            relation = "at"
        last_end = mention.end
        inherited = relation
        if relation is None:
            continue
        if len(claims) >= 2 * MAX_CLAIMS:
            break
        start, end = clause.tokens[begin].start, clause.tokens[mention.end - 1].end
        if relation == "outside" and mention.kind == "thing":
            relation = "near"  # "Outside the door" is near the door.
        activity = mention.kind == "activity"
        negated, strength = polarity(
            words, clause.first, begin, relation, places=places, activity=activity
        )
        text = context[start:end]
        claims += [
            Claim(
                relation="near" if mention.kind == "activity" else relation,
                place=place,
                kind="room" if mention.kind == "room" or place in knowledge.room_types else "thing",
                label=None,
                room=mention.room,
                negated=negated,
                strength=strength,
                start=start,
                end=end,
                text=text,
                which=distinction(words, begin, mention),
            )
            for place in mention.places
        ]
    return _join(claims, context)


def _relation_before(
    words: list[str], mention: Mention, last_end: int, inherited: str | None
) -> tuple[str | None, int]:
    """Return the relation of a mention and the index of the first word of its phrase."""
    index = mention.start
    steps = 0
    while index > last_end:
        for length in (4, 3, 2, 1):
            phrase = " ".join(words[max(last_end, index - length) : index])
            relation = lexicon.RELATIONS.get(phrase)
            if relation is None or index - length < last_end:
                continue
            if relation == "to" and index == mention.start and mention.kind == "thing":
                return None, mention.start
            return relation, index - length
        word = words[index - 1]
        if word in {"or", "and", "nor"} and inherited:
            return inherited, index
        if word == "of" and index - 1 == last_end and inherited:
            return "of", index - 1
        if word == "of" and index - 2 >= last_end and words[index - 2] in lexicon.PARTS:
            index -= 2
            continue
        if word in lexicon.SUGGESTIONS or word in lexicon.SEARCHED:
            return "at", index
        steps += word not in DETERMINERS and word not in ADJECTIVES
        if steps > _REACH or word in lexicon.NEGATIONS:
            return None, mention.start
        index -= 1
    if inherited and last_end and last_end == index:
        between = words[last_end : mention.start]
        if all(word in DETERMINERS or word in ADJECTIVES for word in between):
            return inherited, index
    return None, mention.start


def _is_bare(words: list[str], mentions: list[Mention], number: int) -> bool:
    """Tell whether a clause is little more than the name of a place: "the sofa, I think"."""
    inside = {index for mention in mentions for index in range(mention.start, mention.end)}
    rest = [word for index, word in enumerate(words) if index not in inside]
    small = DETERMINERS | ADJECTIVES | lexicon.FILLERS | lexicon.ASIDES
    loose = [word for word in rest if word not in small]
    if ADJECTIVES & set(words[mentions[-1].end :]):
        return False  # "the sofa is red" describes the sofa.
    return not loose and (number == 0 or bool({"or", "and"} & set(rest)))


def _join(claims: list[Claim], context: str) -> list[Claim]:
    """Join claims that name one place together.

    "The table" and "in the kitchen" after it are one place; so are "the window" and "of the
    study"; of "the drawer of the dresser" the dresser is the place.
    """
    joined: list[Claim] = []
    for claim in claims:
        before = joined[-1] if joined else None
        if before is None or context[before.end : claim.start].strip():
            joined.append(claim)
            continue
        within = claim.kind == "room" and before.kind == "thing" and before.room is None
        text = context[before.start : claim.end]
        if within and claim.relation in ("in", "at", "of") and before.negated == claim.negated:
            joined[-1] = replace(before, room=claim.place, end=claim.end, text=text)
        elif claim.relation == "of":
            place, room = claim.place, claim.room or before.room
            joined[-1] = replace(before, place=place, room=room, end=claim.end, text=text)
        else:
            joined.append(claim)
    return joined


def _not_understood(
    clause: _Clause, found: list[Claim], knowledge: Knowledge, ooi: str | None
) -> list[str]:
    """Return notes on unknown nouns after a preposition of place."""
    words = clause.words
    known = {
        index
        for mention in find_mentions(words, knowledge, ooi, own=True)
        for index in range(mention.start, mention.end)
    }
    notes: list[str] = []
    for index in range(1, len(words)):
        if words[index - 1] not in lexicon.RELATIONS or words[index - 1] in ("with", "where"):
            continue
        if words[index] not in DETERMINERS:
            continue
        noun: list[str] = []
        for position in range(index + 1, min(index + 4, len(words))):
            if position in known or words[position] in lexicon.ABSTRACT:
                noun = []
                break
            if words[position] in lexicon.RELATIONS or words[position] in {"and", "or", "i"}:
                break
            if words[position] not in ADJECTIVES:
                noun.append(words[position])
        if noun and noun[0] not in lexicon.CLAUSE_STARTS:
            start = clause.tokens[index + 1].start
            if not any(claim.start <= start < claim.end for claim in found):
                notes.append(f"“{noun[0]}” is not a known place")
    return notes
