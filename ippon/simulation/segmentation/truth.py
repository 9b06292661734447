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
    also: Sequence[str] = (),
) -> str | None:
    """Return the label of an object: an object of interest before the common labels.

    Args:
        instance: The object.
        labels: Common labels, canonical.
        ooi: Canonical label of the object of interest, None for none.
        is_instance_of: Compares a canonical name of the object with `ooi`.
        also: Further objects of interest.

    Returns:
        `ooi`, one of `also`, one of the labels, or None if no label applies.
    """
    names = (canonical_label(instance.label), instance.category)
    for wanted in also if ooi is None else (ooi, *also):
        if any(is_instance_of(name, wanted) for name in names):
            return wanted
    return next((name for name in names if name in labels), None)


def detectable_labels(
    labels: Sequence[str], ooi: str | None, also: Sequence[str] = ()
) -> tuple[str, ...]:
    """Return the labels that a detector looks for: common ones of objects, `also`, then `ooi`."""
    wanted = (*(x for x in also if x != ooi), *(() if ooi is None else (ooi,)))
    common = [x for x in labels if x not in STUFF and not is_vague(x) and x not in wanted]
    return (*common, *wanted)
