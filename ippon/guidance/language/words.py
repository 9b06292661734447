"""English words: tokens, singulars, plurals, articles, adjectives."""

import re
import unicodedata
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import inflect


def word_set(text: str) -> frozenset[str]:
    """Split a list of words."""
    return frozenset(text.split())


DETERMINERS = word_set(
    "a an the teh hte my your our his her their its this that these those some any one another "
    "other each every both all whose own said please"
)
"""Words before a noun that select an instance."""

ADJECTIVES = word_set(
    "red green blue yellow orange black white brown grey gray pink purple violet beige golden "
    "gold silver turquoise navy khaki colourful colorful dark bright light pale striped checked "
    "dotted big small large little tiny huge tall short long thick thin wide narrow round square "
    "oval flat old new vintage antique modern dirty clean broken empty full open closed soft hard "
    "heavy warm cold hot favourite favorite beloved expensive cheap nice pretty beautiful ugly "
    "cute fancy wooden wood metal metallic steel iron plastic paper leather cotton woollen wool "
    "woolen silk velvet rubber ceramic porcelain stone marble concrete fluffy shiny transparent "
    "clear left right upper lower top bottom first second third last main spare extra missing "
    "lost good bad best same whole real only single double pair"
)
"""Words that describe a thing without making it another thing."""

_TOKEN = re.compile(r"[^\W_]+(?:['’][^\W_]+)*", re.UNICODE)
_PLURALS = word_set(
    "blinds chips clothes cosmetics cookies curtains drawers earphones flowers glasses goggles "
    "groceries headphones jeans keys notes objects others pajamas panties pants pills scissors "
    "shelves shoes slippers sneakers snacks spices stairs sunglasses supplies tongs tools "
    "trousers utensils vitamins weights sweets nuts boots gloves toys papers shorts heels matches "
    "tissues leggings crisps wipes appliances"
)
_MASS = word_set(
    "paper furniture lighting shelving seating equipment bread milk juice soap shampoo detergent "
    "medicine coffee clothing cutlery firewood laundry underwear toothpaste lotion bedding "
    "jewelry gear garbage trash money mail tea food fruit tape makeup rice pasta flour sugar salt "
    "wine paint cheese butter honey jam ketchup chocolate cereal rubbish cash luggage deodorant "
    "perfume floss mouthwash fabric yarn litter linen"
)
_IRREGULAR_PHRASES = {"chest of drawers": "chests of drawers"}
_IRREGULAR = {"knife": "knives", "shelf": "shelves", "scarf": "scarves", "loaf": "loaves"} | {
    "leaf": "leaves",
    "person": "people",
    "mouse": "mice",
    "child": "children",
    "man": "men",
    "woman": "women",
    "foot": "feet",
    "tooth": "teeth",
}
_SINGLES = {plural: single for single, plural in _IRREGULAR.items()}


@dataclass(frozen=True, slots=True)
class Token:
    """One word of a text."""

    word: str
    """Lower case, with plain apostrophes."""
    start: int
    end: int


def tokenize(text: str) -> list[Token]:
    """Split a text into words; `start` and `end` are offsets of `text`."""
    return [
        Token(match.group().lower().replace("’", "'"), match.start(), match.end())
        for match in _TOKEN.finditer(text)
    ]


_LETTERS = str.maketrans(dict.fromkeys("’‘ʼ‛′`´", "'") | {"İ": "I"})
"""How telephones and keyboards write an apostrophe, and a capital i in Turkish."""
_FRACTION = re.compile(r"(?:(\d+) ?)?([¼-¾⅐-⅞])")
_ZERO_WIDTH_SPACE = "\u200b"


def plain(text: str) -> str:
    """Normalise compatibility characters and apostrophes; drop control and format characters."""
    text = _FRACTION.sub(_decimal, text.translate(_LETTERS))
    return " ".join("".join(map(_visible, unicodedata.normalize("NFKC", text))).split())


def _decimal(match: re.Match[str]) -> str:
    """Return "2½" as "2.5"."""
    return f"{int(match[1] or 0) + unicodedata.numeric(match[2]):.4g}"


def _visible(char: str) -> str:
    """Return a character; nothing for one without width within a word: a soft hyphen."""
    category = unicodedata.category(char)
    if category == "Cf" and char != _ZERO_WIDTH_SPACE:
        return ""
    return " " if category.startswith("C") else char


def singular_candidates(word: str) -> tuple[str, ...]:
    """Return possible singulars of a word by the regular rules, the most likely first."""
    if word in _SINGLES:
        return (_SINGLES[word],)
    if len(word) < 4 or not word.endswith("s") or word.endswith("ss"):
        return ()
    found = [word[:-1]]
    if word.endswith("ies"):
        found.insert(0, word[:-3] + "y")
    elif word.endswith(("shes", "ches", "xes", "sses")):
        found.insert(0, word[:-2])
    elif word.endswith(("oes", "ses", "zes")):
        found.append(word[:-2])
    if word.endswith("ves"):
        found += [word[:-3] + "f", word[:-3] + "fe"]
    return tuple(found)


@lru_cache(maxsize=4096)
def singular(word: str) -> str:
    """Return the singular of a noun; a word that is not a plural is unchanged."""
    if not word.isascii() or not singular_candidates(word) or word in _PLURALS:
        return word
    if word.endswith(("us", "is", "as")):
        return word
    # The library's `Word` is a string of at least one letter.
    found = _inflection().singular_noun(word)  # pyright: ignore[reportArgumentType]
    return str(found) if found else word


@cache
def _inflection() -> "inflect.engine":
    """Return the library of English inflections, which only words outside the table need.

    While it is imported typeguard would add type checks to each of its methods, in three seconds.
    """
    import typeguard  # noqa: PLC0415

    checked = typeguard.typechecked
    typeguard.typechecked = lambda method: method  # pyright: ignore
    try:
        import inflect  # noqa: PLC0415
    finally:
        typeguard.typechecked = checked
    return inflect.engine()


def plural(word: str) -> str:
    """Return the regular plural of a noun."""
    if word in _IRREGULAR:
        return _IRREGULAR[word]
    if word.endswith("y") and word[-2:-1] not in "aeiou":
        return word[:-1] + "ies"
    return word + ("es" if word.endswith(("s", "x", "z", "ch", "sh")) else "s")


def generic(phrase: str) -> str:
    """Return a phrase as the subject of a general statement: "hats are", "toilet paper is"."""
    head, _, last = phrase.rpartition(" ")
    if phrase in _IRREGULAR_PHRASES:
        return f"{_IRREGULAR_PHRASES[phrase]} are"
    if last in _MASS:
        return f"{phrase} is"
    if last in _PLURALS:
        return f"{phrase} are"
    return f"{head} {plural(last)} are".strip()


def is_many(phrase: str) -> bool:
    """Tell whether a phrase is a plural: "keys", "scissors"."""
    return generic(phrase) == f"{phrase} are"


def is_mass(phrase: str) -> bool:
    """Tell whether a phrase names a stuff, not a thing: "milk"."""
    return phrase.rpartition(" ")[2] in _MASS


def with_article(phrase: str) -> str:
    """Return a phrase with its indefinite article; plurals and mass nouns have none."""
    last = phrase.rpartition(" ")[2]
    if last in _PLURALS or last in _MASS:
        return phrase
    return f"an {phrase}" if phrase[:1] in "aeio" or phrase.startswith("um") else f"a {phrase}"
