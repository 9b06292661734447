"""Names of the common objects: the 40 Matterport categories of Habitat ObjectNav."""

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

HABITAT_GOALS: tuple[str, ...] = ("chair", "bed", "plant", "toilet", "tv", "sofa")


def canonical_label(text: str) -> str:
    """Write a label the way vocabularies do: lower case, words joined by single underscores."""
    return "_".join(text.replace("_", " ").replace("-", " ").lower().split())
