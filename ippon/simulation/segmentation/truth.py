"""Ground-truth labels of the objects of a home."""

import operator
from collections.abc import Callable, Sequence
from typing import Final

from ippon.simulation.scene import Instance
from ippon.simulation.segmentation.confusion import is_vague
from ippon.vocabulary import canonical_label

NamePredicate = Callable[[str, str], bool]
"""Tells whether an object of the first name is an instance of the second."""

STUFF: Final = ("wall", "floor", "ceiling", "beam", "column")
"""Common labels of surfaces, of which detectors find no instances."""


def true_label(
    instance: Instance,
    labels: Sequence[str],
    ooi: str | None,
    is_instance_of: NamePredicate = operator.eq,
) -> str | None:
    """Return the label of an object: the object of interest before the common labels.

    Args:
        instance: The object.
        labels: Common labels, canonical.
        ooi: Canonical label of the object of interest, None for none.
        is_instance_of: Compares a canonical name of the object with `ooi`.

    Returns:
        `ooi`, one of the labels, or None if no label applies.
    """
    names = (canonical_label(instance.label), instance.category)
    if ooi is not None and any(is_instance_of(name, ooi) for name in names):
        return ooi
    return next((name for name in names if name in labels), None)


def detectable_labels(labels: Sequence[str], ooi: str | None) -> tuple[str, ...]:
    """Return the labels that a detector looks for: common ones of objects, then `ooi`."""
    common = [x for x in labels if x not in STUFF and not is_vague(x) and x != ooi]
    return tuple(common) if ooi is None else (*common, ooi)
