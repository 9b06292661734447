"""Names of rooms as words: which room type a name means, and when two names are one."""

import re
from collections.abc import Iterable
from typing import Final

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.mentions import room_phrases
from ippon.guidance.language.words import tokenize

_ZIMMER_OF: Final = re.compile(r"^(\w+)s zimmer$")


def known_rooms(context: str, names: Iterable[str]) -> frozenset[str]:
    """Return the words that name rooms of the map, and neither a type nor a thing, in lower case.

    Args:
        context: Free text.
        names: Names that people have given to rooms.
    """
    given = frozenset(filter(None, map(plain_name, names)))
    said = frozenset(
        phrase
        for phrase in room_phrases(context)
        if any(is_same_name(name, phrase, kind_of_name(phrase)) for name in given)
    )
    knowledge = load_knowledge()
    names_only = given | said
    return frozenset(
        name for name in names_only if not (knowledge.room(name) or knowledge.find(name))
    )


def is_same_name(given: str, place: str, kind: str) -> bool:
    """Return whether a given name is that of a place of a room type, both in lower case."""
    if _key(given) == _key(place) or _key(_in_english(given)) == _key(_in_english(place)):
        return True
    # "Anna's bedroom" may have been named "Anna".
    owner = _owner(place)
    return bool(owner) and owner == _owner(given) and "" in (kind_of_name(given), kind)


def kind_of_name(name: str) -> str:
    """Return the room type that a name is or ends with; empty for none."""
    knowledge, parts = load_knowledge(), name.split()
    kinds = (knowledge.room(" ".join(parts[start:])) for start in range(len(parts)))
    return next(filter(None, kinds), "")


def plain_name(name: str) -> str:
    """Return the words of a name in lower case, without article."""
    return " ".join(token.word for token in tokenize(name)).removeprefix("the ")


def _in_english(name: str) -> str:
    """Return a German name of a room as it is said in English: "annas zimmer", "zimmer 12"."""
    return _ZIMMER_OF.sub(r"\1's room", name).replace("zimmer ", "room ")


def _key(name: str) -> tuple[str, ...]:
    kept = [word.removesuffix("'s") for word in name.split()]
    return tuple(word for word in kept if word not in ("room", "the")) or tuple(kept)


def _owner(name: str) -> str:
    """Return whose room it is: "anna" of "anna's bedroom" and of "anna"."""
    first = name.split(" ", maxsplit=1)[0]
    return first.removesuffix("'s") if first.endswith("'s") or " " not in name else ""
