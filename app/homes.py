"""Loading of homes by name: a seed, floor:SEED, a folder, or a source that a package adds."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from app.errors import UsageError
from ippon import extensions
from ippon.errors import SceneError
from ippon.simulation.homes.config import MUG_COLORS, HomeConfig
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.scene import Scene

_MAX_HOMES: Final = 100_000
_MAX_SEED: Final = 2**31 - 1
_LARGE_FLOOR: Final = "floor:"
"""Prefix of the seed of a large building's floor."""
_FLOOR_START_POSES: Final = 24
_MUGS: Final = 3
_MUG_DRAW: Final = 0x3A6


def check_home(text: str) -> None:
    """Check that a text names a home: a seed, floor:SEED, or a folder with a scene.

    Raises:
        UsageError: The name is invalid; the text says what would work.
    """
    seed = _seed_of(text)
    if seed is not None:
        if seed > _MAX_SEED:
            raise UsageError(f"a home's seed is at most {_MAX_SEED}; got {text}")
        return
    if _source_of(text) is not None:
        return
    folder = Path(text)
    if not text or not folder.is_dir():
        added = ", ".join(extensions.names(extensions.SCENES)) or "none is installed"
        raise UsageError(
            f"no home {text!r}: give a seed (a whole number, for example 3), {_LARGE_FLOOR}SEED "
            "for a floor of a large building, a folder that holds scene.glb and scene.json, or "
            f"NAME:TEXT for scenes that another package adds ({added})"
        )
    missing = [name for name in ("scene.glb", "scene.json") if not (folder / name).is_file()]
    if missing:
        raise UsageError(
            f"the folder {text} holds no {' and no '.join(missing)}; examples/your_home.py writes "
            "the scene.json of a mesh (docs/reference/scene-format.md)"
        )


def load_home(text: str, *, coloured_mugs: bool = False) -> Scene:
    """Generate or load a home.

    Args:
        text: Name of the home.
        coloured_mugs: A generated home has three more mugs, of different colours by its seed.

    Raises:
        UsageError: There is no such home, or its files are damaged.
    """
    check_home(text)
    try:
        seed = _seed_of(text)
        if seed is not None:
            mugs = _mugs(seed) if coloured_mugs else ()
            if text.startswith(_LARGE_FLOOR):
                large = HomeConfig(layout="floor", start_count=_FLOOR_START_POSES, mugs=mugs)
                return generate_home(seed, config=large)
            return generate_home(seed, config=HomeConfig(mugs=mugs))
        source = _source_of(text)
        if source is not None:
            return extensions.load(extensions.SCENES, source)(text.partition(":")[2])
        from ippon.simulation.scene_reader import load_scene

        return load_scene(Path(text))
    except (SceneError, extensions.ExtensionError) as error:
        raise UsageError(f"home {text}: {error}") from error


def expand_homes(homes: Sequence[str]) -> tuple[str, ...]:
    """Return the named homes without duplicates; ranges of seeds are expanded.

    Args:
        homes: Homes with commas between them; all behind NAME: of an installed source is its text,
            commas, too.

    Raises:
        UsageError: The name is invalid; the text says what would work.
    """
    out: list[str] = []
    for part in (p for text in homes for p in _parts_of(text) if p):
        kind = _LARGE_FLOOR if part.startswith(_LARGE_FLOOR) else ""
        first, _, last = part.removeprefix(kind).partition(":")
        lowest, highest = _number(first), _number(last)
        if lowest is None or highest is None:
            check_home(part)
            seed = _seed_of(part)
            # Not 7 and 007 as two homes.
            out.append(part if seed is None else f"{kind}{seed}")
            continue
        if not lowest <= highest <= _MAX_SEED or highest - lowest >= _MAX_HOMES:
            raise UsageError(f"homes go from a smaller seed to a larger one; got {part}")
        out += [f"{kind}{seed}" for seed in range(lowest, highest + 1)]
    if not out:
        raise UsageError("no homes: give seeds like 1001:1010, or folders")
    kept: dict[str, str] = {}
    for home in out:
        kept.setdefault(home_key(home), home)
    return tuple(kept.values())


def _parts_of(text: str) -> list[str]:
    """Split a list of homes; all behind NAME: of an installed source is for that."""
    parts = text.split(",")
    for n, part in enumerate(parts):
        if ":" in part and _source_of(part) is not None:
            return [*parts[:n], ",".join(parts[n:])]
    return parts


def home_key(text: str) -> str:
    """Return a unique name of a home: its seed, or the absolute path of its folder."""
    if _seed_of(text) is not None:
        return f"seed {text}"
    return text if _source_of(text) is not None else str(Path(text).resolve())


def _source_of(text: str) -> str | None:
    """Return the name of the installed source of NAME or NAME:TEXT, None for another home."""
    name = text.partition(":")[0]
    return name if name in extensions.names(extensions.SCENES) else None


def _seed_of(text: str) -> int | None:
    """Return the seed of a generated home, None for a folder."""
    return _number(text.removeprefix(_LARGE_FLOOR))


def _mugs(seed: int) -> tuple[str, ...]:
    rng = np.random.Generator(np.random.PCG64([seed, _MUG_DRAW]))
    return tuple(rng.permutation(list(MUG_COLORS))[:_MUGS].tolist())


def _number(digits: str) -> int | None:
    return int(digits) if digits.isascii() and digits.isdecimal() else None
