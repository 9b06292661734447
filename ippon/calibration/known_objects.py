"""Known objects of a recorded place."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ippon.errors import IpponError
from ippon.vocabulary import canonical_label

MAX_SIZE_M = 20.0


class KnownObjectsError(IpponError):
    """A file of known objects is invalid; the message gives the reason."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownObject:
    """An object at a known position."""

    label: str
    """Canonical."""
    centre_world: tuple[float, float, float]
    """Metres, in the recording's own world."""
    about_m: float
    """Size, metres."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownObjects:
    """Known objects and known absences of a recorded place."""

    objects: tuple[KnownObject, ...]
    complete_for: frozenset[str] = field(default_factory=frozenset[str])
    """Labels of which all objects are listed."""
    absent: frozenset[str] = field(default_factory=frozenset[str])
    """Labels without any object."""
    unclear: tuple[KnownObject, ...] = ()
    """Objects of uncertain label; their surface is ignored."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the labels with known objects or known absence."""
        named = {one.label for one in self.objects} | self.complete_for | self.absent
        return tuple(sorted(named))

    def is_complete(self, label: str) -> bool:
        """Tell whether surface away from the known objects is certainly not of this label."""
        return label in self.complete_for or label in self.absent

    @classmethod
    def parse(cls, content: object) -> "KnownObjects":
        """Read `{"objects": [{"label", "centre_world", "about_m"}], "complete_for", "absent"}`.

        `unclear` has the form of `objects`. Other fields are ignored.

        Raises:
            KnownObjectsError: A field is missing, of another type, or contradicts another.
        """
        if not isinstance(content, Mapping):
            raise KnownObjectsError(
                'known objects are {"objects": [{"label", "centre_world", "about_m"}, ...], '
                f'"complete_for": [...], "absent": [...]}}; got {type(content).__name__}'
            )
        fields: Mapping[str, Any] = content
        known = cls(
            objects=_objects(fields, "objects"),
            complete_for=_labels(fields, "complete_for"),
            absent=_labels(fields, "absent"),
            unclear=_objects(fields, "unclear"),
        )
        both = known.absent & ({one.label for one in known.objects} | known.complete_for)
        if both:
            raise KnownObjectsError(
                f"{', '.join(sorted(both))}: listed as absent, and in objects or complete_for"
            )
        if not known.labels:
            raise KnownObjectsError(
                "objects, complete_for and absent are all empty: list at least one object or label"
            )
        return known


def _labels(content: Mapping[str, Any], name: str) -> frozenset[str]:
    names = content.get(name, [])
    if not isinstance(names, list) or not all(isinstance(one, str) for one in names):
        raise KnownObjectsError(f"{name} is a list of labels; got {names!r}")
    return frozenset(canonical_label(one) for one in names)


def _objects(content: Mapping[str, Any], name: str) -> tuple[KnownObject, ...]:
    items = content.get(name, [])
    if not isinstance(items, list):
        raise KnownObjectsError(f"{name} is a list; got {type(items).__name__}")
    return tuple(_object(item, f"{name}[{n}]") for n, item in enumerate(items))


def _object(item: Any, where: str) -> KnownObject:
    try:
        x, y, z = _position(item["centre_world"])
        label, size_m = _label(item["label"]), float(item.get("about_m", 0.3))
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise KnownObjectsError(f"{where}: {what}") from error
    if not (label and all(math.isfinite(c) for c in (x, y, z)) and 0.0 < size_m <= MAX_SIZE_M):
        raise KnownObjectsError(
            f"{where}: an object has a label, a finite centre_world in metres and about_m within "
            f"0 to {MAX_SIZE_M:g}; got {item!r}"
        )
    return KnownObject(label=label, centre_world=(x, y, z), about_m=size_m)


def _label(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"label is a text; got {value!r}")
    return canonical_label(value)


def _position(value: Any) -> tuple[float, float, float]:
    if not isinstance(value, list):
        raise TypeError(f"centre_world is [x, y, z] in metres; got {value!r}")
    at: list[Any] = value
    if len(at) != 3:
        raise ValueError(f"centre_world is [x, y, z] in metres; got {at!r}")
    return float(at[0]), float(at[1]), float(at[2])
