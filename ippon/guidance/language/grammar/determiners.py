"""What stands before a noun and says how many of it, whose, and whether another one."""

from dataclasses import dataclass, field
from typing import Final, Literal

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.context_words import NEGATIONS
from ippon.guidance.language.goals.goal import ALL, Attribute, Reference
from ippon.guidance.language.grammar.attributes import UNITS, listed_kind
from ippon.guidance.language.grammar.number_words import NUMBER_WORDS
from ippon.guidance.language.grammar.phrases import OWNERS, PREPOSITIONS, STOP
from ippon.guidance.language.grammar.utterance import Utterance
from ippon.guidance.language.languages import ENGLISH
from ippon.guidance.language.words import word_set

NUMBERS: Final = NUMBER_WORDS | {"hundred": 100}
COUNTS: Final[dict[str, int | Literal["all"]]] = {
    "every single": ALL, "each and every": ALL, "every one of": ALL, "each of": ALL, "every": ALL,
    "each": ALL, "all of": ALL, "all": ALL, "as many": ALL, "half a dozen": 6, "a dozen": 12,
    "two dozen": 24, "dozen": 12, "a couple of": 2, "a couple": 2, "couple of": 2, "couple": 2,
    "both of": 2, "both": 2, "a few": 3, "a good few": 3, "quite a few": 3, "few": 3, "several": 3,
    "a handful of": 3,
}  # fmt: skip
MEASURES = word_set(
    "pair bunch set piece bit stack pile kind type sort pack packet roll heap pairs bunches sets "
    "pieces bits stacks piles kinds types packs packets rolls heaps"
)
_LEADING = word_set(
    "the my our your a an this that these those some any its said whatever either more of at "
    "least most up to exactly maximum minimum only just about around me"
)
_KINDS: Final = ("colour", "color", "coloured", "colored", "size", "sized", "shape", "shaped")
_AT_LEAST = (["at", "least"], ["at", "most"], ["up", "to"], ["more", "than"])
_DID = word_set("had has bought gave used lent made sent wore took borrowed brought wants needs")
_OWNERS = word_set("his her their")
_ORDINALS = word_set("first last top bottom")
NO_OWNERS = word_set(
    "it's that's what's where's there's here's who's let's he's she's how's when's one's"
)


@dataclass(slots=True)
class Determiners:
    """What was read before a noun."""

    index: int
    """Index of the first word after it."""
    count: int | Literal["all"] | None = None
    reference: Reference = ""
    determined: bool = False
    owners: list[Attribute] = field(default_factory=list)


def read_determiners(said: Utterance, start: int) -> Determiners:
    """Read determiners, numbers and owners from a word on."""
    begun = Determiners(start)
    owners = begun.owners
    while begun.index < len(said) and begun.index - start < 12:
        index = begun.index
        if index > start and said.breaks(index):
            break
        word = said.word(index)
        following = said.word(index + 1)
        length = said.starts(index, COUNTS)
        if length and not (word in ("couple", "few", "dozen") and said.breaks(index + 1)):
            begun.count = COUNTS[" ".join(said.words(index, index + length))]
            begun.index += length
        elif said.hyphened(index + 1):
            break  # "Two-way".
        elif _number(said, index) is not None or _number_range(said, index):
            begun.index += 2 if _number_range(said, index) else 0
            index = begun.index
            begun.count = _number(said, index) if begun.count is None else begun.count
            begun.index += 1
        elif word in MEASURES and following == "of" and not said.breaks(index + 1):
            begun.index += 2
        elif word in _ORDINALS and begun.determined and (_number(said, index + 1) or 1) > 1:
            owners.append(Attribute(kind="which", value=word))
            begun.count = _number(said, index + 1)
            begun.index += 2  # "The last three bottles".
        elif (
            (word in ("another", "other") and (word == "another" or begun.determined))
            or (word == "different" and begun.determined)
            or (word == "more" and index > start)
        ):
            begun.reference = "other"
            begun.index += 2 if word == "different" and following in _KINDS else 1
        elif word == "same" and (begun.determined or index == 0):
            begun.reference = "same"
            begun.index += 1
        elif (owning := _owner_end(said, index)) > index:
            owner = said.said(index, owning).removesuffix("'s").removesuffix("’s")
            my = said.word(index - 1) in ("my", "his", "her", "our", "their") and index > start
            owner = f"{said.word(index - 1)} {owner}" if my else owner
            if my and owners and owners[-1].value == said.word(index - 1):
                owners.pop()
            owners.append(Attribute(kind="owner", value=owner.removesuffix("'s")))
            begun.index = owning
        elif word == "and" and owners and _owner_end(said, index + 1) > index + 1:
            begun.index += 1  # "Anna's and Ben's".
        elif word in _OWNERS:
            owners.append(Attribute(kind="owner", value=word))
            begun.index += 1
        elif said.words(index, index + 3) == ["no", "more", "than"]:
            begun.index += 3
        elif said.words(index, index + 2) in _AT_LEAST:
            begun.index += 2
        elif word in _LEADING and not (word in ("of", "at", "to", "up") and index == start):
            begun.index += 1
        else:
            break
        begun.determined = True
    return begun


def _number_range(said: Utterance, index: int) -> bool:
    """Tell whether "one or two" begins."""
    numbers = (said.word(index), said.word(index + 2))
    return said.word(index + 1) in ("or", "to") and all(
        word in NUMBERS or (word.isascii() and word.isdigit() and int(word) > 0) for word in numbers
    )


def _owner_end(said: Utterance, index: int) -> int:
    """Return the index after "Mr Brown's" or "little sister's"; the same where no owner stands."""
    if said.word(index) in OWNERS and may_be_noun(said, index + 1):
        return index + 1
    if said.word(index + 1) == "and" and said.word(index + 2).endswith("'s"):
        first = said.word(index)
        named = said.said(index, index + 1)[0].isupper() and load_knowledge().find(first) is None
        if f"{first}s" in OWNERS or (named and not first.endswith("'s")):
            return index + 3  # "Tom and Anna's".
    if _is_bare_owner(said, index):
        return index + 1
    for end in range(index, min(index + 3, len(said))):
        word = said.word(end)
        if (end > index and said.breaks(end)) or listed_kind(said.word(index)) == "colour":
            return index
        if word.endswith("'s") and word not in NO_OWNERS:
            return index if said.breaks(end + 1) else end + 1
        if word in STOP or word in PREPOSITIONS or word in _LEADING or word in _OWNERS:
            return index
    return index


def _is_bare_owner(said: Utterance, index: int) -> bool:
    """Tell whether a name owns what follows without its apostrophe: "Olivers goggles"."""
    word = said.word(index)
    named = index > 0 and not said.ends(index) and said.said(index, index + 1)[:1].isupper()
    find = load_knowledge().find
    unknown = word not in ENGLISH and find(word) is None
    thing = any(find(owned) for owned in said.words(index + 1, index + 4))  # Not "Annas Zimmer".
    owns = named and word.endswith("s") and len(word) > 3 and unknown and thing
    return owns and not word.endswith(("'s", "ss")) and may_be_noun(said, index + 1)


def _number(said: Utterance, index: int) -> int | None:
    """Return a number that counts, not one that measures: "10 mm wrench"."""
    word, following = said.word(index), said.word(index + 1)
    if word == "one" and following in PREPOSITIONS and following != "of":
        return None  # "The one at the till".
    if following in UNITS or (word == "one" and not may_be_noun(said, index + 1)):
        return None
    if word.isascii() and word.isdigit() and len(word) <= 3 and int(word) > 0:
        return int(word) if may_be_noun(said, index + 1) else None
    return NUMBERS.get(word)


def may_be_noun(said: Utterance, index: int) -> bool:
    """Tell whether a noun, or a word before one, may stand at an index."""
    word = said.word(index)
    if (
        not word
        or said.breaks(index)
        or word in NEGATIONS
        or " ".join(said.words(index, index + 2)) in PREPOSITIONS
    ):
        return False
    return word == "of" or (word not in STOP and word not in PREPOSITIONS) or word in _LEADING


def count_again(said: Utterance, index: int) -> int:
    """Return the number of words of "four of them" or "two" that count what was named before."""
    if said.word(index) not in NUMBERS:
        return 0
    if said.words(index + 1, index + 3) in (["of", "them"], ["of", "those"], ["of", "these"]):
        return 3
    return 1 if said.ends(index + 1) else 0


def is_person_at(said: Utterance, index: int) -> bool:
    """Tell whether somebody is named who did something with a thing: "the mug Dave had"."""
    named = said.said(index, index + 1)[0].isupper() and not said.breaks(index)
    did = said.word(index + 1)
    return named and (did in _DID or (did.endswith("ed") and len(did) > 4))
