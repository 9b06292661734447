"""The knowledge table: typical places of things in homes, offices and laboratories.

The table is package data (`tables/*.yaml`), one entry per thing:

* `also`: synonyms; `kinds`: narrower things in the same places; `is`: wider things that it is an
  instance of;
* `rooms`: weights of the room types in which it occurs;
* `sure`, `on`, `in` and `by`: things at which it is found, always (`sure`) or typically;
* `size`: longest side of a large thing in metres, for things that do not come in rows;
* `small`: side of a small thing in an image, metres: the root of its width times its height;
* `high`: height above the floor that a thing which stands on it may reach, metres;
* `aloft: yes`: it hangs or stands higher than a person reaches;
* `spread`: it says little about a place: `pervasive` (walls), `broad` (catch-all categories such as
  "furniture") and `everywhere` (windows: in any room, but things stand at them).
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Final, Literal, cast, get_args

import yaml

from ippon.guidance.language.words import singular_candidates
from ippon.vocabulary import in_words

Relation = Literal["sure", "on", "in", "by"]
Spread = Literal["none", "everywhere", "broad", "pervasive"]

_FIELDS = frozenset(
    {
        "also",
        "kinds",
        "is",
        "rooms",
        "size",
        "small",
        "high",
        "spread",
        "aloft",
        *get_args(Relation),
    }
)
_ROOMS_FILE = "rooms.yaml"
WITHIN_REACH_M: Final = 2.3
"""Height below which people put and hang things: above wardrobes, below ceilings."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A thing at which another thing is found."""

    name: str
    """Name of an entry, or of a kind of an entry."""
    relation: Relation


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """One entry of the table."""

    name: str
    """Canonical label, words joined by underscores."""
    also: tuple[str, ...]
    kinds: tuple[str, ...]
    parents: tuple[str, ...]
    """Wider things, the most likely first."""
    rooms: Mapping[str, float]
    """Share of this thing in each room type; sums to 1, or empty for any room."""
    places: tuple[Place, ...]
    spread: Spread
    aloft: bool
    """Whether it may be higher than a person reaches."""
    size_m: float
    """Longest side of a large thing; infinite if not given."""
    high_m: float
    """Height above the floor that it may reach; infinite if not given."""
    small_m: float
    """Side in an image, for small things; infinite for others."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """Meaning of a phrase in the table."""

    label: str
    """Canonical label: that of the thing for a synonym, its own for a kind."""
    thing: Thing


@dataclass(frozen=True, slots=True, kw_only=True)
class Knowledge:
    """The indexed table."""

    things: Mapping[str, Thing]
    """By canonical label."""
    phrases: Mapping[str, Entry]
    """By phrase, lower-case words joined by single spaces."""
    room_names: Mapping[str, str]
    """Room type by phrase."""
    room_types: tuple[str, ...]
    activities: Mapping[str, tuple[str, ...]]
    """Places of activities: things or room types."""

    def find(self, phrase: str) -> Entry | None:
        """Look up a phrase as written, then with its last word in the singular."""
        for form in _forms(phrase):
            if form in self.phrases:
                return self.phrases[form]
        return None

    def thing(self, label: str) -> Thing | None:
        """Return the thing of a canonical label or of a kind's label."""
        direct = self.things.get(label)
        if direct is not None:
            return direct
        entry = self.phrases.get(in_words(label))
        return entry.thing if entry else None

    def highest_m(self, label: str) -> float:
        """Return the largest height of an object above the floor, metres; infinite if unknown."""
        thing = self.thing(label)
        if thing is None or thing.aloft:
            return math.inf
        parents = (self.things[name] for name in thing.parents)
        # "furniture" may hang, but that does not apply to a wardrobe.
        aloft = any(parent.aloft and parent.spread != "broad" for parent in parents)
        return math.inf if aloft else min(WITHIN_REACH_M, thing.high_m)

    def size_m(self, label: str) -> float:
        """Return the longest side of a large object, metres; infinite if unknown."""
        thing = self.thing(label)
        return math.inf if thing is None else thing.size_m

    def small_m(self, label: str) -> float:
        """Return the side of a small object in an image, metres; infinite for others."""
        thing = self.thing(label)
        return math.inf if thing is None else thing.small_m

    def room(self, phrase: str) -> str | None:
        """Return the room type of a phrase."""
        return next(
            (self.room_names[form] for form in _forms(phrase) if form in self.room_names), None
        )


@cache
def load_knowledge() -> Knowledge:
    """Return the table of the package, cached.

    Raises:
        ValueError: The table is inconsistent; the message names file and entry.
    """
    folder = files("ippon.guidance.tables")
    tables = {
        path.name: _parse(path.read_text(encoding="utf-8"))
        for path in sorted(folder.iterdir(), key=lambda path: path.name)
        if path.name.endswith(".yaml")
    }
    rooms = tables.pop(_ROOMS_FILE)
    return build_knowledge(tables, rooms)


def build_knowledge(tables: Mapping[str, Mapping[str, Any]], rooms: Mapping[str, Any]) -> Knowledge:
    """Index and check parsed tables.

    Args:
        tables: Entries by file name; the names are used in messages only.
        rooms: `names` (phrases by type of room) and `activities` (places by phrase).

    Raises:
        ValueError: An entry has an unknown field, room or place, or a phrase occurs twice.
    """
    names = cast("Mapping[str, list[str]]", rooms["names"])
    things: dict[str, Thing] = {}
    phrases: dict[str, Entry] = {}
    for file, table in tables.items():
        for name, fields in table.items():
            where = f"{file}: {name}"
            thing = _thing(name, fields, names.keys(), where)
            things[name] = thing
            for label, phrase in _phrases(thing):
                if phrase in phrases:
                    raise ValueError(
                        f"{where}: {phrase!r} already stands for {phrases[phrase].thing.name}"
                    )
                phrases[phrase] = Entry(label=label, thing=thing)
    known = {entry.label for entry in phrases.values()}
    for thing in things.values():
        for other in (*thing.parents, *(place.name for place in thing.places)):
            if other not in known:
                raise ValueError(f"{thing.name}: {other!r} is not in the table")
    activities = cast("Mapping[str, list[str]]", rooms["activities"])
    for phrase, places in activities.items():
        for place in places:
            if place not in known and place not in names:
                raise ValueError(f"{phrase!r}: {place!r} is neither a thing nor a type of room")
    return Knowledge(
        things=things,
        phrases=phrases,
        room_names={phrase: room for room, also in names.items() for phrase in also},
        room_types=tuple(names),
        activities={phrase: tuple(places) for phrase, places in activities.items()},
    )


def _parse(text: str) -> Mapping[str, Any]:
    # The base loader leaves every scalar a string: `on` is a relation here, not a boolean. The C
    # version reads the table in 20 ms, the Python one in 250.
    loader = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
    return cast("Mapping[str, Any]", yaml.load(text, Loader=loader))  # noqa: S506 - builds strings only


def _forms(phrase: str) -> Iterable[str]:
    yield phrase
    head, _, last = phrase.rpartition(" ")
    for word in singular_candidates(last):
        yield f"{head} {word}".strip()


def _thing(name: str, fields: Mapping[str, Any], rooms: Iterable[str], where: str) -> Thing:
    unknown = set(fields) - _FIELDS
    if unknown:
        raise ValueError(f"{where}: unknown field {sorted(unknown)}; known: {sorted(_FIELDS)}")
    weights = {room: float(weight) for room, weight in fields.get("rooms", {}).items()}
    strange = set(weights) - set(rooms)
    if strange:
        raise ValueError(f"{where}: unknown room {sorted(strange)}; known: {sorted(rooms)}")
    spread = cast("Spread", fields.get("spread", "none"))
    if spread not in get_args(Spread):
        raise ValueError(f"{where}: unknown spread {spread!r}; known: {get_args(Spread)}")
    total = sum(weights.values())
    return Thing(
        name=name,
        also=tuple(fields.get("also", ())),
        kinds=tuple(fields.get("kinds", ())),
        parents=tuple(fields.get("is", ())),
        rooms={room: weight / total for room, weight in weights.items()},
        places=tuple(
            Place(name=place, relation=relation)
            for relation in get_args(Relation)
            for place in fields.get(relation, ())
        ),
        spread=spread,
        aloft=spread != "none" or _yes(fields.get("aloft", "no"), f"{where}: aloft"),
        size_m=_metres(fields.get("size", "inf"), f"{where}: size"),
        high_m=_metres(fields.get("high", "inf"), f"{where}: high"),
        small_m=_metres(fields.get("small", "inf"), f"{where}: small"),
    )


def _metres(value: str, where: str) -> float:
    try:
        metres = float(value)
    except ValueError:
        metres = math.nan
    if not metres > 0.0:
        raise ValueError(f"{where} is a positive number of metres; got {value!r}")
    return metres


def _yes(value: str, where: str) -> bool:
    if value not in ("yes", "no"):
        raise ValueError(f"{where} is yes or no; got {value!r}")
    return value == "yes"


def _phrases(thing: Thing) -> Iterable[tuple[str, str]]:
    yield thing.name, in_words(thing.name)
    for phrase in thing.also:
        yield thing.name, phrase
    for phrase in thing.kinds:
        yield phrase.replace(" ", "_"), phrase
