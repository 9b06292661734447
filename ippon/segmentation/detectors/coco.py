"""The classes of COCO (Lin et al., ECCV 2014), with synonyms."""

from collections.abc import Collection
from typing import Final

NO_CLASS: Final = ""
"""Name of an output without a class."""

_NAMES: Final = """
    person bicycle car motorcycle airplane bus train truck boat traffic_light fire_hydrant
    stop_sign parking_meter bench bird cat dog horse sheep cow elephant bear zebra giraffe backpack
    umbrella handbag tie suitcase frisbee skis snowboard sports_ball kite baseball_bat
    baseball_glove skateboard surfboard tennis_racket bottle wine_glass cup fork knife spoon bowl
    banana apple sandwich orange broccoli carrot hot_dog pizza donut cake chair couch potted_plant
    bed dining_table toilet tv laptop mouse remote keyboard cell_phone microwave oven toaster sink
    refrigerator book clock vase scissors teddy_bear hair_drier toothbrush
"""
COCO_80: Final[tuple[str, ...]] = tuple(_NAMES.split())
"""The classes in the order of most detectors."""

_NUMBERS_WITHOUT_CLASS: Final = frozenset({0, 12, 26, 29, 30, 45, 66, 68, 69, 71, 83})
"""Category numbers up to 90 that the data set does not use."""


def _by_category_number() -> tuple[str, ...]:
    classes = iter(COCO_80)
    return tuple(
        NO_CLASS if number in _NUMBERS_WITHOUT_CLASS else next(classes) for number in range(91)
    )


COCO_91: Final = _by_category_number()
"""Classes by the data set's category numbers, 0 to 90, as in DETR and RF-DETR."""

SAME: Final[tuple[tuple[str, ...], ...]] = (
    ("sofa", "couch"),
    ("plant", "potted_plant", "houseplant"),
    ("tv", "television"),
    ("refrigerator", "fridge"),
    ("microwave", "microwave_oven"),
    ("computer_mouse", "mouse"),
    ("remote_control", "remote"),
    ("hair_dryer", "hair_drier"),
    ("cell_phone", "mobile_phone", "smartphone"),
    ("bicycle", "bike"),
    ("motorcycle", "motorbike"),
    ("airplane", "aeroplane"),
    ("donut", "doughnut"),
    ("backpack", "rucksack"),
    ("tennis_racket", "tennis_racquet"),
)
"""Synonyms, consistent with the knowledge table."""

ALSO: Final[dict[str, tuple[str, ...]]] = {
    "cup": ("mug", "coffee_cup", "coffee_mug", "teacup"),
    "tv": ("monitor", "screen", "tv_monitor", "computer_monitor"),
    "couch": ("settee",),
    "dining_table": ("table", "desk"),
    "potted_plant": ("flower_pot",),
    "cell_phone": ("phone",),
    "remote": ("tv_remote",),
    "sports_ball": ("ball",),
    "teddy_bear": ("teddy",),
    "airplane": ("plane",),
    "handbag": ("purse",),
}
"""Further labels of a class, because COCO's annotators gave these objects its name. Broader words
(seating, appliances) are excluded: a weak score of a bench at a chair would count for seating."""


BROADER: Final = frozenset({"table", "phone", "ball", "plane"})
"""Labels of `ALSO` that include the class; the others are kinds that COCO has no class for."""


def synonyms_of_class(name: str, classes: Collection[str] = ()) -> tuple[str, ...]:
    """Return the labels of a class, its own name first.

    Args:
        name: Canonical name of the class.
        classes: Labels with a class of their own. A detector that tells mugs from cups does not
            call its cups mugs, as one with COCO's classes does.
    """
    # Objects365 has names for several kinds, such as monitor/tv.
    kinds = [kind.strip("_") for kind in name.split("/")]
    same = [
        label
        for kind in kinds
        for label in next((group for group in SAME if kind in group), (kind,))
    ]
    also = [
        label
        for one in same
        for label in ALSO.get(one, ())
        if label in BROADER or label not in classes
    ]
    return tuple(filter(None, dict.fromkeys((name, *same, *also))))
