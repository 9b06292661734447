"""Words that describe a thing, and their kinds."""

import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import cast

import yaml

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.context_words import STOREYS
from ippon.guidance.language.goals.goal import AttributeKind
from ippon.guidance.language.words import ADJECTIVES, word_set

UNITS = word_set(
    "l litre litres liter liters ml cl cm mm m metre metres meter meters km inch inches in ft "
    "foot feet kg g gram grams kilo kilos lb lbs pound pounds oz ounce ounces gallon gallons pint "
    "pints watt watts w volt volts v gb tb euro euros dollar dollars piece pieces seat seater "
    "person ply centimetre centimetres centimeter centimeters millimetre millimetres millimeter "
    "millimeters"
)
_ENDING = re.compile(r"^\w{2,}(?:y|ed|ish|ful|less|ous|able|ible|al|ic|ive|en|est)$")
_KINDS: tuple[AttributeKind, ...] = (
    "colour", "size", "material", "pattern", "shape", "condition", "feel", "which", "quality",
)  # fmt: skip


@cache
def _table() -> Mapping[str, list[str]]:
    text = (files("ippon.guidance.tables.speech") / "attributes.yaml").read_text(encoding="utf-8")
    # The base loader leaves every word a string.
    return cast("Mapping[str, list[str]]", yaml.load(text, Loader=yaml.BaseLoader))  # noqa: S506


@cache
def _kinds() -> Mapping[str, AttributeKind]:
    kinds: dict[str, AttributeKind] = {}
    for kind in _KINDS:
        for word in _table()[kind]:
            kinds.setdefault(word, kind)
    for word in ADJECTIVES:
        kinds.setdefault(word, "other")
    return kinds


@cache
def _words(name: str) -> frozenset[str]:
    return frozenset(_table()[name])


def listed_kind(word: str) -> AttributeKind | None:
    """Return the kind of attribute of a word that the table lists; None for others."""
    return _kinds().get(word)


def attribute_kind(word: str) -> AttributeKind | None:
    """Return the kind of attribute of a word before a noun; None where it is a noun itself."""
    kind = listed_kind(word)
    if kind is not None or "-" in word:
        return kind or "other"
    knowledge = load_knowledge()
    if word in _words("noun") or knowledge.find(word) or knowledge.room(word):
        return None
    if word in STOREYS:
        return "which"
    return "other" if _ENDING.match(word) else None


def is_shade(word: str) -> bool:
    """Tell whether a word makes another colour of one: dark, light, pale."""
    return word in _words("shade")


def is_intensity(word: str) -> bool:
    """Tell whether a word only strengthens or weakens an adjective: very, half."""
    return word in _words("intensity")


def is_part(word: str) -> bool:
    """Tell whether a noun names a part of things: cover, handle, lid."""
    return word in _words("part")
