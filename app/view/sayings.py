"""Sentences of the navigator in another language, found by their English templates.

The navigator speaks English on the wire, in recordings and to programs. A template is an English
text with named fields, and its translation has the same fields. The name of a field says how its
value is translated, see `Sayings`.
"""

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Final, NamedTuple, Protocol

MOST_CHARACTERS: Final = 2000
"""Longer texts are shown as they came."""
MOST_STEPS: Final = 4000
"""Bound of the work for one text, in comparisons of a template with a place in the text."""
MOST_PARTS: Final = 40
_MOST_PIECES: Final = 3
_WHOLE_STEPS: Final = 10
"""Cost of looking through all templates."""
MOST_DEPTH: Final = 5
"""A sentence may hold a sentence that holds another."""
_KEPT: Final = 2048
"""Translations that are kept; a status repeats most of its texts."""
_JOINED: Final = " and "
"""Between the names of the goals of a tour."""
_WORDS: Final = {"level": "panel.level", "mode": "mode", "outcome": "panel.outcome"}
"""Fields that are one of some words, and where those are in the table."""
_NUMBER: Final = re.compile(r"-?[0-9]+(?:\.[0-9]+)?%?")
_FIELD: Final = re.compile(r"\{(\w+)\}")
_ARTICLE: Final = re.compile(r"^(?:the|an?) ")
_VERB: Final = re.compile(r" (?:is|are)$")


class Vocabulary(Protocol):
    """The words that values of fields are written with."""

    def __call__(self, key: str, /, **values: object) -> str:
        """Return the text of a key with its values filled in."""
        ...

    def knows(self, key: str) -> bool:
        """Return whether there is a text of a key."""
        ...

    def name(self, label: str) -> str:
        """Return what people call a label; a text that is none that is known as it came."""
        ...

    def room(self, name: str) -> str:
        """Return what people call a type of room; the name of a room as it came."""
        ...

    def attribute(self, value: str) -> str:
        """Return the word for a colour or a size; another attribute as it came."""
        ...


class _Told(NamedTuple):
    text: str
    known: int
    """Number of characters of the English text that are not just a name: of several translations
    that with the most is right."""
    is_complete: bool = True
    """Every sentence that it holds is known."""

    @property
    def rank(self) -> tuple[int, bool]:
        return self.known, self.is_complete


class _ExhaustedError(Exception):
    """A text takes more work than a sentence may."""


@dataclass(slots=True)
class _Work:
    left: int = MOST_STEPS
    found: dict[str, _Told | None] = field(default_factory=dict[str, _Told | None])
    """What was found of parts of the text."""

    def step(self, steps: int = 1) -> None:
        self.left -= steps
        if self.left < 0:
            raise _ExhaustedError


@dataclass(frozen=True, slots=True)
class Template:
    """One English text with fields, and its translation.

    The literals around the fields are searched for one after the other, without a regular
    expression, so that no text takes long.
    """

    english: str
    translation: str
    literals: tuple[str, ...] = field(init=False)
    fields: tuple[str, ...] = field(init=False)
    longest: str = field(init=False)
    """Longest literal: texts without it are passed over at once."""

    def __post_init__(self) -> None:
        parts = _FIELD.split(self.english)
        object.__setattr__(self, "literals", tuple(parts[::2]))
        object.__setattr__(self, "fields", tuple(parts[1::2]))
        object.__setattr__(self, "longest", max(parts[::2], key=len))
        if not all(self.literals[1:-1]):
            raise ValueError(f"two fields follow each other without a literal: {self.english}")

    @property
    def weight(self) -> int:
        """Number of literal characters: the more, the less may match by chance."""
        return sum(map(len, self.literals))

    def values(self, text: str, work: _Work) -> Iterator[tuple[str, ...]]:
        """Yield the values of the fields for each way in which the template matches a text."""
        first = self.literals[0]
        if text.startswith(first) and text.endswith(self.literals[-1]):
            yield from self._rest(text, len(first), 0, (), work)

    def _rest(
        self, text: str, start: int, n: int, values: tuple[str, ...], work: _Work
    ) -> Iterator[tuple[str, ...]]:
        literal = self.literals[n + 1]
        is_last = n + 1 == len(self.fields)
        end = len(text) - len(literal) if is_last else text.find(literal, start + 1)
        while end > start:
            work.step()
            value = text[start:end]
            if len(self.fields[n]) > 1 or _NUMBER.fullmatch(value):
                if is_last:
                    yield (*values, value)
                else:
                    yield from self._rest(text, end + len(literal), n + 1, (*values, value), work)
            end = -1 if is_last else text.find(literal, end + 1)


class Sayings:
    """The sentences of the navigator in one language.

    Fields by the beginning of their names:

    - one letter: a number
    - `text`: a sentence or a part of one, translated
    - `by`: the name of a model or of somebody, or words for it
    - `parts`: several words, "white and it is not large"
    - `object`, `label`, `other`: the name of a thing, translated if the table has it
    - `labels`: such names with commas between them
    - `value`, `values`: a colour or size, or another attribute; several with commas between them
    - `room`: a type of room, or the name of one
    - `either`, `rooms`: alternatives, "the sofa or the bed", "the kitchen or the bathroom"
    - `subject`: "hats are", without the verb
    - `thing`: "a hat", without the article
    - `list`: names with commas between them, "colour (1.2 s), depth"
    - `when`: a time, "Monday 18:40"
    - `level`, `mode`, `outcome`: a word of the panels
    - anything else: a name or a number, as it came

    Args:
        pairs: English templates and their translations.
        words: The words of the language.
    """

    def __init__(self, pairs: Iterable[tuple[str, str]], words: Vocabulary) -> None:
        self._words = words
        self._exact: dict[str, str] = {}
        self._templates: list[Template] = []
        for english, translation in pairs:
            if _FIELD.search(english):
                self._templates.append(Template(english, translation))
            else:
                self._exact[english] = translation
        self._templates.sort(key=lambda one: -one.weight)
        self._kept: dict[str, str] = {}

    def __call__(self, text: str) -> str:
        """Return a text of the navigator in the language; one that is not known as it came."""
        if not text or len(text) > MOST_CHARACTERS:
            return text
        known = self._kept.get(text)
        if known is None:
            told = self._told(text)
            known = text if told is None else told.text
            if len(self._kept) >= _KEPT:
                self._kept.clear()
            self._kept[text] = known
        return known

    def covers(self, text: str) -> bool:
        """Return whether every sentence of a text is known."""
        told = self._told(text)
        return told is not None and told.is_complete

    def _told(self, text: str) -> _Told | None:
        try:
            return self._found(text, _Work())
        except _ExhaustedError:
            return None

    def _found(self, text: str, work: _Work, depth: int = 0) -> _Told | None:
        """Return the translation that knows most of a text; None where no part of it is known."""
        if depth > MOST_DEPTH:
            return None
        if text not in work.found:
            told = [self._whole(text, work, depth), self._as_sentence(text, work, depth)]
            told += [self._parted(text, mark, work, depth) for mark in ("; ", ". ", ": ")]
            known = filter(None, told)
            work.found[text] = max(known, key=lambda one: one.rank, default=None)
        return work.found[text]

    def _whole(self, text: str, work: _Work, depth: int) -> _Told | None:
        """Return the translation by one template."""
        work.step(_WHOLE_STEPS)
        exact = self._exact.get(text)
        if exact is not None:
            return _Told(exact, len(text))
        best: _Told | None = None
        for template in (one for one in self._templates if one.longest in text):
            for values in template.values(text, work):
                told = self._filled(template, values, work, depth)
                if told is not None and (best is None or told.rank > best.rank):
                    best = told
        return best

    def _as_sentence(self, text: str, work: _Work, depth: int) -> _Told | None:
        """Return the translation of a text that was made a sentence, as one."""
        plain = f"{text[:1].lower()}{text[1:]}".removesuffix(".")
        told = None if plain == text else self._whole(plain, work, depth)
        if told is None:
            return None
        stop = "." if text.endswith(".") and not told.text.endswith((".", "?")) else ""
        first = told.text[:1].upper() if text[:1].isupper() else told.text[:1]
        return told._replace(text=f"{first}{told.text[1:]}{stop}")

    def _filled(
        self, template: Template, values: tuple[str, ...], work: _Work, depth: int
    ) -> _Told | None:
        """Return the translation with its values; None where one of them does not fit."""
        told: dict[str, _Told] = {}
        for name, value in zip(template.fields, values, strict=True):
            said = self._value(name, value, work, depth + 1)
            if said is None and name.partition("_")[0] in _WORDS:
                return None
            told[name] = said or _Told(value, 0, is_complete=False)
        return _Told(
            template.translation.format(**{name: one.text for name, one in told.items()}),
            template.weight + sum(one.known for one in told.values()),
            all(one.is_complete for one in told.values()),
        )

    def _parted(self, text: str, mark: str, work: _Work, depth: int) -> _Told | None:
        """Return a text part by part, parted so that most of it is known.

        A part has one piece between the marks, or several where a template has marks of its own.
        """
        pieces = text.split(mark)
        if not 1 < len(pieces) <= MOST_PARTS:
            return None
        best: list[_Told] = [_Told("", 0)]
        """Of all that follows each piece, from the last one on."""
        for begin in reversed(range(len(pieces))):
            ways: list[_Told] = []
            for count in range(1, min(_MOST_PIECES, len(pieces) - begin) + 1):
                part = mark.join(pieces[begin : begin + count])
                find = self._found if count == 1 else self._whole
                told = find(part, work, depth + 1) or _Told(part, 0, is_complete=False)
                rest = best[-count]
                ways.append(_joined([told, rest], mark) if begin + count < len(pieces) else told)
            best.append(max(ways, key=lambda one: one.rank))
        return best[-1] if best[-1].known else None

    # -- values --------------------------------------------------------------------------------

    def _value(self, name: str, value: str, work: _Work, depth: int) -> _Told | None:
        """Return the value of a field; None for a sentence that is not known."""
        if len(name) == 1:
            return _Told(self._number(value), len(value))
        match name.partition("_")[0]:
            case "text":
                return self._found(value, work, depth)
            case "by":
                return self._found(value, work, depth) or _Told(value, 0)
            case "parts":
                parts = [
                    self._found(part, work, depth) or _Told(self._words.attribute(part), 0)
                    for part in value.split(" and it is ")
                ]
                return _joined(parts, f" {self._words('panel.understood.and')} ")
            case "list":
                return _joined([self._named(one, work, depth) for one in value.split(", ")], ", ")
            case "when":
                words = (self._exact.get(word, word) for word in value.split(" "))
                return self._found(value, work, depth) or _Told(" ".join(words), 0)
            case "object" | "label" | "other":
                return _Told(self._goal(value), 0)
            case "labels":
                return _Told(", ".join(map(self._words.name, value.split(", "))), 0)
            case "value" | "values":
                return _Told(", ".join(map(self._words.attribute, value.split(", "))), 0)
            case "room":
                return _Told(self._words.room(value), 0)
            case "either":
                return _Told(self._either(value, self._words.name), 0)
            case "rooms":
                return _Told(self._either(value, self._words.room), 0)
            case "subject" | "thing":
                return _Told(self._words.name(_VERB.sub("", _ARTICLE.sub("", value))), 0)
            case kind if kind in _WORDS:
                key = f"{_WORDS[kind]}.{value}"
                return _Told(self._words(key), len(value)) if self._words.knows(key) else None
            case _:
                return _Told(value, 0)

    def _named(self, one: str, work: _Work, depth: int) -> _Told:
        """Return a name of a list, with a time in parentheses if there is one."""
        name, opened, rest = one.partition(" (")
        seconds = rest.removesuffix(" s)")
        whole = self._found(one, work, depth)
        if whole is not None or not _NUMBER.fullmatch(seconds):
            return whole or _Told(self._words.room(one), 0)
        told = self._found(name, work, depth) or _Told(name, 0)
        return told._replace(text=f"{told.text}{opened}{self._number(seconds)} s)")

    def _number(self, value: str) -> str:
        """Return a number of the text as the language writes it."""
        number = value.removesuffix("%").replace(".", self._words("number.decimal"))
        return self._words("panel.percent", n=number) if value.endswith("%") else number

    def _goal(self, value: str) -> str:
        """Return the name of an object, or those of the objects of a tour."""
        name, joined = self._words.name(value), f" {self._words('panel.understood.and')} "
        parts = value.split(_JOINED)
        return name if name != value else joined.join(map(self._words.name, parts))

    def _either(self, value: str, name: Callable[[str], str]) -> str:
        joined = f" {self._words('panel.understood.or')} "
        return joined.join(
            ", ".join(name(_ARTICLE.sub("", one)) for one in part.split(", "))
            for part in value.split(" or ")
        )


def _joined(parts: list[_Told], mark: str) -> _Told:
    return _Told(
        mark.join(one.text for one in parts),
        sum(one.known for one in parts),
        all(one.is_complete for one in parts),
    )
