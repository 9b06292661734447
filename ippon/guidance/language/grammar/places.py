"""Kinds of places: rooms, furniture, and what is searched inside."""

from functools import cache, lru_cache

from rapidfuzz.distance import OSA

from ippon.guidance.knowledge import load_knowledge
from ippon.guidance.language.words import word_set

_OPENED = word_set(
    "fridge refrigerator freezer cupboard cabinet drawer wardrobe closet bag box oven dishwasher "
    "toolbox backpack suitcase basket bin car bathtub sink shed safe"
)
"""Places that are searched inside."""


def is_room(head: str) -> bool:
    """Tell whether a name is that of a room and of no thing."""
    knowledge = load_knowledge()
    named = knowledge.room(head) is not None or head.endswith(" room")
    return named and knowledge.find(head) is None


def is_searched_inside(head: str) -> bool:
    """Tell whether a place to search is a room or something with an inside."""
    return is_room(head) or head.rpartition(" ")[2] in _OPENED


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
