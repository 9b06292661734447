import math
from typing import Any

import pytest

from ippon.guidance.knowledge import build_knowledge, load_knowledge

ROOMS: dict[str, Any] = {"names": {"kitchen": ["kitchen"]}, "activities": {"cooking": ["kitchen"]}}


def build(**table: dict[str, Any]) -> None:
    build_knowledge({"test.yaml": table}, ROOMS)


def test_the_table_is_worth_the_name() -> None:
    knowledge = load_knowledge()
    assert len(knowledge.things) >= 300
    assert len(knowledge.phrases) >= 1500


def test_rooms_are_distributions() -> None:
    for thing in load_knowledge().things.values():
        if thing.rooms:
            assert sum(thing.rooms.values()) == pytest.approx(1.0)
            assert min(thing.rooms.values()) > 0.0
        else:
            assert thing.spread != "none", thing.name


def test_an_object_of_a_place_can_be_in_its_room() -> None:
    knowledge = load_knowledge()
    for thing in knowledge.things.values():
        for place in thing.places:
            other = knowledge.thing(place.name)
            assert other is not None
            shared = sum(
                min(share, other.rooms.get(room, 0.0)) for room, share in thing.rooms.items()
            )
            assert shared >= 0.05 or not other.rooms, (thing.name, place.name)


def test_kinds_of_a_kind_end() -> None:
    knowledge = load_knowledge()
    for thing in knowledge.things.values():
        seen = {thing.name}
        queue = list(thing.parents)
        while queue:
            name = queue.pop()
            assert name != thing.name
            if name not in seen:
                seen.add(name)
                parent = knowledge.thing(name)
                queue += parent.parents if parent else ()


def test_finds_plurals() -> None:
    knowledge = load_knowledge()
    assert [
        entry.label for entry in map(knowledge.find, ("knives", "couches", "berries")) if entry
    ] == [
        "knife",
        "sofa",
    ]
    assert knowledge.room("bedrooms") == "bedroom"


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"pan": {"room": {}}}, "test.yaml: pan: unknown field .'room'.; known: "),
        ({"pan": {"rooms": {"moon": 1}}}, "test.yaml: pan: unknown room .'moon'."),
        ({"pan": {"spread": "wide"}}, "test.yaml: pan: unknown spread 'wide'; known: "),
        ({"pan": {"aloft": "maybe"}}, "test.yaml: pan: aloft is yes or no; got 'maybe'"),
        (
            {"pan": {"size": "big"}},
            "test.yaml: pan: size is a positive number of metres; got 'big'",
        ),
        ({"pan": {"size": "0"}}, "test.yaml: pan: size is a positive number of metres; got '0'"),
        ({"pan": {"by": ["pot"]}}, "pan: 'pot' is not in the table"),
        ({"pan": {}, "pot": {"also": ["pan"]}}, "test.yaml: pot: 'pan' already stands for pan"),
    ],
)
def test_error_texts(table: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        build(**table)


def test_how_high_things_may_be() -> None:
    knowledge = load_knowledge()
    low = ("toilet", "hat", "cap", "chair", "wardrobe")
    assert [label for label in low if knowledge.highest_m(label) > 2.5] == []
    assert knowledge.highest_m("couch") == knowledge.highest_m("sofa") == 1.2
    assert knowledge.highest_m("toilet") < knowledge.highest_m("bed") < knowledge.highest_m("hat")
    high = ("lighting", "chandelier", "floor_lamp", "curtain", "shower_curtain", "painting")
    assert [label for label in (*high, "gizmo") if knowledge.highest_m(label) < 1e9] == []


def test_how_large_things_may_be() -> None:
    knowledge = load_knowledge()
    assert knowledge.size_m("coffee_mug") == knowledge.size_m("mug") < 0.5 < knowledge.size_m("tv")
    assert math.isinf(knowledge.size_m("gizmo"))
    assert math.isinf(knowledge.size_m("book")), "a row of books is no error"


def test_which_things_are_small_in_an_image() -> None:
    knowledge = load_knowledge()
    assert knowledge.small_m("coffee_mug") == knowledge.small_m("mug") < knowledge.small_m("hat")
    assert math.isinf(knowledge.small_m("gizmo"))
    assert math.isinf(knowledge.small_m("sofa"))
    small = [name for name, thing in knowledge.things.items() if math.isfinite(thing.small_m)]
    assert [name for name in small if knowledge.small_m(name) >= knowledge.size_m(name)] == []


def test_an_activity_needs_a_known_place() -> None:
    rooms = {"names": {"kitchen": ["kitchen"]}, "activities": {"fishing": ["lake"]}}
    with pytest.raises(ValueError, match="'fishing': 'lake' is neither a thing nor a type of room"):
        build_knowledge({}, rooms)
