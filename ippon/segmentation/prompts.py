"""Sentence templates around labels for networks that compare images with text."""

from typing import Final

from ippon.vocabulary import in_words

VILD_TEMPLATES: Final = (
    "a photo of a {}.",
    "This is a photo of a {}",
    "There is a {} in the scene",
    "There is the {} in the scene",
    "a photo of a {} in the scene",
    "a photo of a small {}.",
    "a photo of a medium {}.",
    "a photo of a large {}.",
    "This is a photo of a small {}.",
    "This is a photo of a medium {}.",
    "This is a photo of a large {}.",
    "There is a small {} in the scene.",
    "There is a medium {} in the scene.",
    "There is a large {} in the scene.",
)
"""Templates of SAN's training and evaluation, from ViLD (Gu et al., ICLR 2022)."""

PLAIN_TEMPLATES: Final = ("a photo of a {}.",)

_WORDS: Final = {
    "tv": "television",
    "board_panel": "board",
    "gym_equipment": "gym equipment",
    "objects": "small object",
    "others": "other thing",
    "beam": "ceiling beam",
    "seating": "bench",
}
"""Words for labels that are ambiguous by themselves."""


def words_of(label: str) -> str:
    """Return the words for a label in a sentence.

    Args:
        label: Canonical, such as `chest_of_drawers`.
    """
    return _WORDS.get(label, in_words(label))
