"""Mentions of things, rooms and activities of the knowledge table in a sentence."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

from rapidfuzz.distance import OSA

from ippon.guidance.knowledge import Knowledge, load_knowledge
from ippon.guidance.language.context_words import RELATIONS, STOREYS
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.language.words import ADJECTIVES, DETERMINERS, tokenize, word_set
from ippon.vocabulary import in_words

_LONGEST = 5
_VERBS = word_set("can may left right saw light clean watch see back present last iron")
"""Words of the table that usually mean something else in running text; they need an article."""

_OWNERS = word_set("my our your his her their")
_ANY = DETERMINERS - _OWNERS - {"other", "another"} | {"whole", "entire"}
"""Words before a place that do not tell it from others of its type."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mention:
    """A place in a sentence."""

    start: int
    """Index of its first word."""
    end: int
    """Index after its last word."""
    kind: Literal["thing", "room", "activity"]
    places: tuple[str, ...]
    """One place; for an activity, the places where it is done."""
    room: str | None = None
    """Type of room named with a thing: "bedroom closet"."""


def find_mentions(
    words: list[str],
    knowledge: Knowledge,
    ooi: str | None,
    *,
    own: bool = False,
    rooms: Collection[str] = (),
) -> list[Mention]:
    """Return the mentions in a sentence, from left to right, the longest names first.

    Args:
        words: The sentence in lower case.
        knowledge: The table.
        ooi: Canonical label of the goal; it is left out.
        own: Whether to keep the mentions of the goal.
        rooms: Further names of rooms, as words in lower case.
    """
    mentions: list[Mention] = []
    index = 0
    while index < len(words):
        mention = _mention_at(words, index, knowledge, rooms)
        if mention is None:
            index += 1
            continue
        before = mentions[-1] if mentions else None
        in_room = before is not None and (before.kind, before.end) == ("room", index)
        index = mention.end
        if before is not None and in_room and mention.kind == "thing":
            mention = replace(mention, start=before.start, room=before.places[0])
            mentions.pop()
        if own or not _is_goal(mention, knowledge, ooi):
            mentions.append(mention)
    return mentions


def room_phrases(text: str) -> tuple[str, ...]:
    """Return the phrases that can only name rooms: "anna's room", "room 12", "upstairs"."""
    tokens = [token.word for token in tokenize(text)]
    found: list[str] = []
    for n, word in enumerate(tokens):
        if word in STOREYS:
            found.append(word)
        if word == "room" and n + 1 < len(tokens) and any(c.isdigit() for c in tokens[n + 1]):
            found.append(f"room {tokens[n + 1]}")
        if not (word.endswith("'s") or word in _OWNERS):
            continue
        for end in (n + 3, n + 2):
            room = " ".join(tokens[n + 1 : end])
            owned = room == "room" or (word.endswith("'s") and load_knowledge().room(room))
            if owned and end <= len(tokens):
                found.append(f"{word} {room}")
                break
    return tuple(dict.fromkeys(found))


def distinction(words: list[str], begin: int, mention: Mention) -> frozenset[str]:
    """Return the words that tell a place from others of its type: "guest", "anna's", "upstairs".

    Args:
        words: The sentence in lower case.
        begin: Index of the first word of the place's phrase.
        mention: The place.
    """
    end = mention.end - 1 if mention.kind == "room" else mention.start
    said = {word for place in mention.places for word in in_words(place).split()}
    told = set(words[mention.end : mention.end + 1]) & STOREYS
    for word in reversed(words[begin:end]):
        if word in RELATIONS or word == "of":
            break
        told.add(word)
    return frozenset(told - _ANY - said)


def _is_goal(mention: Mention, knowledge: Knowledge, ooi: str | None) -> bool:
    if ooi is None or mention.kind != "thing":
        return False
    thing = knowledge.thing(mention.places[0])
    return mention.places[0] == ooi or (thing is not None and thing.name == ooi)


def _mention_at(
    words: list[str], index: int, knowledge: Knowledge, rooms: Collection[str]
) -> Mention | None:
    for length in range(min(_LONGEST, len(words) - index), 0, -1):
        end = index + length
        phrase = " ".join(words[index:end])
        if phrase in rooms:
            return Mention(start=index, end=end, kind="room", places=(phrase,))
        if phrase in knowledge.activities:
            places = knowledge.activities[phrase]
            return Mention(start=index, end=end, kind="activity", places=places)
        room = knowledge.room(phrase)
        if room is not None:
            return Mention(start=index, end=end, kind="room", places=(room,))
        if length == 1 and not _is_noun(words, index):
            continue
        if end < len(words) and words[end] == "room":
            continue  # "The server room" is no server.
        entry = knowledge.find(phrase)
        if entry is not None and entry.thing.spread != "broad":
            inside = knowledge.room(words[index]) if length > 1 else None
            return Mention(start=index, end=end, kind="thing", places=(entry.label,), room=inside)
    return _misspelt(words, index, knowledge)


def _is_noun(words: list[str], index: int) -> bool:
    word = words[index]
    if word not in _VERBS and word not in ADJECTIVES and word not in RELATIONS:
        return True
    at_end = index + 1 == len(words) or words[index + 1] in RELATIONS
    return index > 0 and words[index - 1] in DETERMINERS and at_end and word not in RELATIONS


def _misspelt(words: list[str], index: int, knowledge: Knowledge) -> Mention | None:
    """Return the place for a word in the position of a place, if it is clearly a misspelling."""
    word = words[index]
    if len(word) < 4 or index == 0 or word in ADJECTIVES:
        return None
    if words[index - 1] == "its" and word.endswith("ing"):
        return None  # "Its raining".
    if words[index - 1] not in DETERMINERS and words[index - 1] not in RELATIONS:
        return None
    kind, place = _spelt(word, knowledge.room_types)
    if kind == "room":
        return Mention(start=index, end=index + 1, kind="room", places=(place,))
    if kind == "thing":
        return Mention(start=index, end=index + 1, kind="thing", places=(place,))
    return None


@lru_cache(maxsize=1024)
def _spelt(word: str, rooms: tuple[str, ...]) -> tuple[str, str]:
    for room in rooms:
        if len(word) >= 5 and word[0] == room[0] and OSA.distance(word, room) == 1:
            return "room", room
    found = resolve_object(word, ())
    if found.known and found.suggestion:
        return "thing", found.canonical
    return "", ""
