"""What people say of remembered things: that one is not what it was taken for, and its name."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final
from unicodedata import normalize

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.goals.goal import Goal
from ippon.guidance.language.naming import resolve_object
from ippon.memory.instance import Instance
from ippon.memory.lookup import instance_named, plain_name
from ippon.vocabulary import canonical_label, in_words

MAX_NAME: Final = 40
_DENYING: Final = frozenset({"not", "never", "nor", "no", "except", "without", "than"})
_PLACING: Final = frozenset(
    {"in", "on", "under", "beside", "near", "behind", "by", "with", "from", "of", "inside"}
    | {"between", "above", "below"}
)


def checked_name(
    name: str, one: Instance, instances: Iterable[Instance], vocabulary: Sequence[str]
) -> str:
    """Return a name for a thing without needless spaces; empty to remove one.

    Args:
        name: As a person types it.
        one: The thing.
        instances: Everything that is remembered.
        vocabulary: Labels of the common objects.

    Raises:
        ValueError: It is no name, that of another thing, or that of a kind of things.
    """
    clean = " ".join(name.split())
    if not clean:
        return ""
    plain = plain_name(clean)
    if len(clean) > MAX_NAME or not clean.isprintable() or not any(map(str.isalnum, plain)):
        raise ValueError(
            f"the name of a thing has letters or digits, and at most {MAX_NAME} printable "
            f"characters; got {clean[:80]!r}"
        )
    if load_knowledge().find(plain) is not None or canonical_label(plain) in vocabulary:
        raise ValueError(f'{clean!r} is a kind of things; a name is of one, such as "Anna\'s mug"')
    other = instance_named(instances, clean)
    if other is not None and other.instance_id != one.instance_id:
        if other.room:
            raise ValueError(
                f"{other.name!r} is already the name of a {_kind(other)} in the {other.room}"
            )
        raise ValueError(f"{other.name!r} is already the name of a {_kind(other)}")
    return clean


def denied_labels(one: Instance, deny: str, allow: str) -> tuple[str, ...]:
    """Return the labels that a thing does not have, with one more or one less.

    Args:
        one: The thing.
        deny: A label that it may have until now; empty for none.
        allow: A label that was denied; empty for none.

    Raises:
        ValueError: It is not one of these.
    """
    denied = one.denied
    if allow:
        if allow not in denied:
            raise ValueError(f"nobody said that it is not a {in_words(allow)}")
        denied = tuple(label for label in denied if label != allow)
    if deny:
        known = [label for label, _ in one.beliefs]
        if deny not in known:
            kinds = " or ".join(map(in_words, known)) or "nothing"
            raise ValueError(f"it is not taken for a {in_words(deny)}, but for {kinds}")
        denied = (*denied, deny)
    return denied


def without_names(sentence: str, instances: Iterable[Instance]) -> tuple[str, tuple[Instance, ...]]:
    """Return a sentence with kinds of things in place of their names, and the things.

    A thing that is denied keeps its name, and one that only says where another is, is not returned.

    Args:
        sentence: "find Anna's mug" becomes "find the mug".
        instances: What is remembered.
    """
    plain = normalize("NFC", sentence).replace("\N{RIGHT SINGLE QUOTATION MARK}", "'")
    used: list[tuple[int, Instance]] = []
    named = [one for one in instances if one.name and one.believed]
    for one in sorted(named, key=lambda one: -len(one.name)):
        # As names are compared: ß counts as the two letters ss.
        folded = plain.casefold()
        at = [n for n, letter in enumerate(plain) for _ in letter.casefold()]
        name = r"\s+".join(map(re.escape, plain_name(one.name).split()))
        found = re.search(rf"(?<!\w)(?:(?:the|my|our)\s+)?{name}(?!\w)", folded)
        if found is None:
            continue
        start, end = at[found.start()], at[found.end() - 1] + 1
        before = folded[: found.start()].split()[-2:]
        if _DENYING.isdisjoint(before):
            if _PLACING.isdisjoint(before[-1:]) and before != ["next", "to"]:
                used.append((start, one))
            kind = f"the {_kind(one)}"
            plain = plain[:start] + kind + plain[end:]
    return plain, tuple(one for _, one in sorted(used, key=lambda pair: pair[0]))


def with_names(goals: Iterable[Goal], things: Iterable[Instance]) -> tuple[Goal, ...]:
    """Return the goals that were read from `without_names`, each by the name of its thing.

    Args:
        goals: In the order in which they were named.
        things: Likewise.
    """
    named = list(goals)
    free = dict(enumerate(named))
    for one in things:
        kind = resolve_object(_kind(one), ()).canonical
        same = (k for k, goal in free.items() if resolve_object(goal.object, ()).canonical == kind)
        at = next(same, None)
        if at is not None:
            named[at] = replace(free.pop(at), object=one.name, display=one.name)
    return tuple(named)


def _kind(one: Instance) -> str:
    return in_words(one.believed) or "thing"
