"""Kinds of places: rooms, furniture, and what is searched inside."""

from collections.abc import Sequence
from functools import cache, lru_cache

from rapidfuzz.distance import OSA

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.language.words import word_set

_OPENED = word_set(
    "fridge refrigerator freezer cupboard cabinet drawer wardrobe closet bag box oven dishwasher "
    "toolbox backpack suitcase basket bin car bathtub sink shed safe"
)
"""Places that are searched inside."""
_STOREYS = word_set("floor storey level deck")
_STORES = word_set("closet cupboard cabinet press basket")
_SITED = word_set("front back rear main")
"""Before a place they belong to its name: the front desk is another place than a desk."""


def is_room(head: str) -> bool:
    """Tell whether a name is that of a room and of no thing."""
    knowledge = load_knowledge()
    numbered = head.startswith("room ") and head[-1].isdigit()
    named = numbered or knowledge.room(head) is not None or head.endswith(" room")
    return named and knowledge.find(head) is None


def named_place(head: str, attributes: Sequence[Attribute]) -> tuple[str, tuple[Attribute, ...]]:
    """Return the name of a place and its other attributes: "third floor", "linen cupboard"."""
    kept = list(attributes)
    while kept and _is_of_name(kept[-1], head):
        head = f"{kept.pop().value} {head}"
    return head, tuple(kept)


def _is_of_name(attribute: Attribute, head: str) -> bool:
    if attribute.negated or attribute.kind in ("owner", "content", "feature"):
        return False
    last = head.rpartition(" ")[2]
    if last in _STOREYS or head.split(maxsplit=1)[0] in _STOREYS:
        return attribute.kind == "which"  # "Third floor", "second floor kitchen".
    linen = attribute.kind == "material" and last in _STORES
    return last in ("room", "store") or attribute.value in _SITED or linen


def is_searched_inside(head: str) -> bool:
    """Tell whether a place to search is a room or something with an inside."""
    last, room = head.rpartition(" ")[2], load_knowledge().room
    return is_room(head) or room(head) is not None or room(last) is not None or last in _OPENED


@lru_cache(maxsize=512)
def holds_things(head: str) -> bool:
    """Tell whether a name is that of a room or of furniture, on or in which things are."""
    knowledge = load_knowledge()
    entry = knowledge.find(head)
    return is_room(head) or (entry is not None and entry.thing.name in _furniture())


@cache
def _furniture() -> frozenset[str]:
    things = load_knowledge().things.values()
    places = [place for thing in things for place in thing.places]
    holding = {place.name for place in places if place.relation in ("on", "in")}
    return frozenset(holding | {"rug", "carpet", "floor"})


@lru_cache(maxsize=512)
def room_spelt(place: str) -> str:
    """Correct the misspelt name of a room."""
    knowledge = load_knowledge()
    if len(place) < 5 or knowledge.find(place) or knowledge.room(place):
        return place
    near = [name for name in knowledge.room_names if OSA.distance(place, name) == 1]
    return near[0] if near and near[0][0] == place[0] else place
