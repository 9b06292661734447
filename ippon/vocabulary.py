"""Names of the common objects.

`MATTERPORT_40` are the categories of Habitat ObjectNav; `LABORATORY_40` those that the paper's
authors chose for the building of their laboratory.
"""

import unicodedata

MATTERPORT_40: tuple[str, ...] = (
    "wall",
    "floor",
    "chair",
    "door",
    "table",
    "picture",
    "cabinet",
    "cushion",
    "window",
    "sofa",
    "bed",
    "curtain",
    "chest_of_drawers",
    "plant",
    "sink",
    "stairs",
    "ceiling",
    "toilet",
    "stool",
    "towel",
    "mirror",
    "tv",
    "shower",
    "column",
    "bathtub",
    "counter",
    "fireplace",
    "lighting",
    "beam",
    "railing",
    "shelving",
    "blinds",
    "gym_equipment",
    "seating",
    "board_panel",
    "furniture",
    "appliances",
    "clothes",
    "objects",
    "others",
)

LABORATORY_40: tuple[str, ...] = (
    "wall",
    "floor",
    "stairs",
    "ceiling",
    "railing",
    "window",
    "lighting",
    "shelving",
    "sink",
    "door",
    "chair",
    "table",
    "counter",
    "chest_of_drawers",
    "sofa",
    "metal_cabinet",
    "kitchen_cabinet",
    "plant",
    "tv",
    "monitor",
    "computer",
    "poster",
    "whiteboard",
    "coat_rack",
    "trash_can",
    "fire_extinguisher",
    "toolbox",
    "cart",
    "robot",
    "crane",
    "charger",
    "fridge",
    "printer",
    "microwave_oven",
    "coffee_machine",
    "dishwasher",
    "equipment",
    "phone_booth",
    "ping_pong_table",
    "others",
)

HABITAT_GOALS: tuple[str, ...] = ("chair", "bed", "plant", "toilet", "tv", "sofa")


def canonical_label(text: str) -> str:
    """Return a label in the form of the vocabularies: lower case, words joined by underscores.

    Letters with marks are single characters, however they were typed.
    """
    whole = unicodedata.normalize("NFC", text)
    return "_".join(whole.replace("_", " ").replace("-", " ").lower().split())


def in_words(label: str) -> str:
    """Return a label as it is written in a sentence: words with spaces between."""
    return label.replace("_", " ")
