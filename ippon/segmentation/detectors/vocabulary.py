"""What a detector with a closed vocabulary can tell."""

from collections.abc import Sequence
from typing import Final

from rapidfuzz import process

COCO_80: Final = (
    "person", "bicycle", "car", "motorcycle", "airplane", "bus", "train", "truck", "boat",
    "traffic_light", "fire_hydrant", "stop_sign", "parking_meter", "bench", "bird", "cat", "dog",
    "horse", "sheep", "cow", "elephant", "bear", "zebra", "giraffe", "backpack", "umbrella",
    "handbag", "tie", "suitcase", "frisbee", "skis", "snowboard", "sports_ball", "kite",
    "baseball_bat", "baseball_glove", "skateboard", "surfboard", "tennis_racket", "bottle",
    "wine_glass", "cup", "fork", "knife", "spoon", "bowl", "banana", "apple", "sandwich", "orange",
    "broccoli", "carrot", "hot_dog", "pizza", "donut", "cake", "chair", "couch", "potted_plant",
    "bed", "dining_table", "toilet", "tv", "laptop", "mouse", "remote", "keyboard", "cell_phone",
    "microwave", "oven", "toaster", "sink", "refrigerator", "book", "clock", "vase", "scissors",
    "teddy_bear", "hair_drier", "toothbrush",
)  # fmt: skip
"""Categories of COCO, in their order (Lin et al., ECCV 2014)."""
SAME: Final[dict[str, tuple[str, ...]]] = {
    "couch": ("sofa", "settee"),
    "dining_table": ("table", "desk"),
    "potted_plant": ("plant", "houseplant", "flower_pot"),
    "tv": ("television", "monitor", "screen", "tv_monitor", "computer_monitor"),
    "cup": ("mug", "coffee_cup", "coffee_mug", "teacup"),
    "cell_phone": ("phone", "mobile_phone", "smartphone"),
    "refrigerator": ("fridge",),
    "hair_drier": ("hair_dryer",),
    "remote": ("remote_control", "tv_remote"),
    "donut": ("doughnut",),
    "teddy_bear": ("teddy",),
    "airplane": ("aeroplane", "plane"),
    "motorcycle": ("motorbike",),
    "bicycle": ("bike",),
    "sports_ball": ("ball",),
    "handbag": ("purse",),
    "microwave": ("microwave_oven",),
    "mouse": ("computer_mouse",),
}
"""Other canonical labels of what a COCO category shows."""
_NEAREST: Final = 3


class Vocabulary:
    """The names of a network's classes, and what people may call them.

    Args:
        names: One a class, canonical.
    """

    def __init__(self, names: Sequence[str] = COCO_80) -> None:
        self.names = tuple(names)
        self._class_of = {name: k for k, name in enumerate(names)}
        for name, others in SAME.items():
            for other in others:
                if name in self._class_of:
                    self._class_of.setdefault(other, self._class_of[name])

    def class_of(self, label: str) -> int | None:
        """Return the class that shows a label, None where the network cannot tell it."""
        return self._class_of.get(label)

    def cannot_see(self, label: str) -> str | None:
        """Return why a label cannot be found, for people; None where it can."""
        if label in self._class_of:
            return None
        near = process.extract(label, list(self._class_of), limit=_NEAREST, score_cutoff=80.0)
        like = sorted({name for name, _, _ in near})
        hint = f" (the nearest names are {', '.join(like)})" if like else ""
        return (
            f"this detector knows {len(self.names)} kinds of thing, and {label!r} is none of them"
            f"{hint}; an open-vocabulary network takes any word: --segmentation.backend san, "
            "clipseg or owlv2"
        )
