"""Installed packages that IPPON needs, with their licences and what each is for."""

import importlib.metadata
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import PurePosixPath
from typing import Final

import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT: Final = "ippon"
NOT_STATED: Final = "not stated"
_CLASSIFIER: Final = "License :: "
_NO_LICENCES: Final = ("OSI Approved", "DFSG approved")
_TEXTS: Final = ("licen", "copying", "notice")
_LONGEST: Final = 60
"""Some packages give the whole text where a name is expected."""


class NotInstalledError(Exception):
    """IPPON is not installed in this Python, so that its requirements are unknown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Package:
    """One installed package."""

    name: str
    version: str
    licence: str
    """As its metadata state it."""
    megabytes: float
    """On disk, by the list of its files."""
    purpose: str
    """What IPPON needs it for; empty if only other packages do."""
    versions: str
    """Why its versions are bounded as they are; empty if by the general rule."""
    extras: list[str]
    """Extras of IPPON that name it; empty if it is always installed, or only others need it."""
    needed_by: list[str]
    """Other packages of the list that need it."""
    texts: list[str]
    """Files that hold its licence."""


@dataclass(slots=True)
class _Found:
    distribution: importlib.metadata.Distribution
    needed_by: set[str] = field(default_factory=set[str])
    extras: set[str] = field(default_factory=set[str])
    """Extras of IPPON that name it."""
    followed: set[str] = field(default_factory=set[str])
    """Extras of its own whose packages are in the list."""


def installed_packages() -> list[Package]:
    """Return IPPON and all that it needs.

    What is always installed comes first, then what extras name and is installed, then what only
    others need; by name.

    Raises:
        NotInstalledError: IPPON itself is not installed in this Python.
    """
    found: dict[str, _Found] = {}
    try:
        own = importlib.metadata.distribution(ROOT)
    except importlib.metadata.PackageNotFoundError as error:
        raise NotInstalledError(f"{ROOT} is not installed in this Python: pip install .") from error
    found[ROOT] = _Found(own)
    for extra in ("", *(own.metadata.get_all("Provides-Extra") or ())):
        _follow(ROOT, extra, found)
    packages = [_describe(name, one) for name, one in found.items()]
    return sorted(
        packages,
        key=lambda one: (one.name != ROOT, not one.purpose, bool(one.extras), one.name),
    )


@cache
def purposes() -> dict[str, dict[str, str]]:
    """Return what is said of the packages that IPPON names: `for`, and perhaps `versions`."""
    return yaml.safe_load((files("app.doctor") / "packages.yaml").read_text("utf-8"))


def _follow(name: str, extra: str, found: dict[str, _Found]) -> None:
    """Add what a package needs with this extra, and what that needs."""
    package = found[name]
    if extra in package.followed:
        return
    package.followed.add(extra)
    for text in package.distribution.requires or ():
        requirement = Requirement(text)
        marker = requirement.marker
        if extra if marker is None else not marker.evaluate({"extra": extra}):
            continue
        needed = canonicalize_name(requirement.name)
        try:
            distribution = importlib.metadata.distribution(needed)
        except importlib.metadata.PackageNotFoundError:
            continue
        one = found.setdefault(needed, _Found(distribution))
        if name == ROOT:
            one.extras.add(extra)
        else:
            one.needed_by.add(name)
        for more in ("", *requirement.extras):
            _follow(needed, more, found)


def _describe(name: str, found: _Found) -> Package:
    said = purposes().get(name, {})
    contents = found.distribution.files or []
    texts = [one for one in contents if _holds_licence(one)]
    return Package(
        name=name,
        version=found.distribution.version,
        licence=licence_of(found.distribution),
        megabytes=round(sum(one.size or 0 for one in contents) / 1e6, 1),
        purpose="this program" if name == ROOT else said.get("for", ""),
        versions=said.get("versions", ""),
        extras=[] if "" in found.extras else sorted(found.extras),
        needed_by=sorted(found.needed_by),
        texts=sorted(str(one.locate()) for one in texts),
    )


def licence_of(distribution: importlib.metadata.Distribution) -> str:
    """Return the licence that a package states: an SPDX expression, else a classifier or a name."""
    metadata = distribution.metadata
    if "License-Expression" in metadata:
        return metadata["License-Expression"]
    classifiers = metadata.get_all("Classifier") or []
    named = [one.split(" :: ")[-1] for one in classifiers if one.startswith(_CLASSIFIER)]
    named = [one for one in named if one not in _NO_LICENCES]
    lines = (metadata.get_all("License") or [""])[0].strip().splitlines()
    is_name = len(lines) == 1 and len(lines[0]) <= _LONGEST
    # Of two classifiers nobody knows whether both count, or one may choose.
    if len(named) == 1 or (named and not is_name):
        return ", ".join(named)
    return lines[0].strip()[:_LONGEST] if lines else NOT_STATED


def _holds_licence(path: PurePosixPath) -> bool:
    is_metadata = path.parts[0].endswith(".dist-info")
    return is_metadata and any(word in path.name.lower() for word in _TEXTS)
