"""`--home`: a seed, the seed of a large floor, or a folder."""

from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.errors import UsageError

if TYPE_CHECKING:
    from ippon.simulation.scene import Scene

MAX_SEED = 2**31 - 1
LARGE_FLOOR = "floor:"
"""Stands before the seed of a large building's floor."""
_FLOOR_STARTS = 24


def check_home(text: str) -> None:
    """Refuse what is neither a seed, that of a large floor, nor a folder with a home.

    Raises:
        UsageError: With what would work.
    """
    seed = _seed_of(text)
    if seed is not None:
        if seed > MAX_SEED:
            raise UsageError(f"a home's seed is at most {MAX_SEED}; got {text}")
        return
    folder = Path(text)
    if not text or not folder.is_dir():
        raise UsageError(
            f"no home {text!r}: give a seed (a whole number, for example 3), {LARGE_FLOOR}SEED for "
            "a floor of a large building, or a folder that holds scene.glb and scene.json"
        )
    missing = [name for name in ("scene.glb", "scene.json") if not (folder / name).is_file()]
    if missing:
        raise UsageError(f"the folder {text} holds no {' and no '.join(missing)}")


def load_home(text: str) -> "Scene":
    """Generate or load the home.

    Raises:
        UsageError: There is none, or it is damaged.
    """
    check_home(text)
    from ippon.errors import SceneError

    try:
        seed = _seed_of(text)
        if seed is not None:
            from ippon.simulation.homes.config import HomeConfig
            from ippon.simulation.homes.generator import generate_home

            if text.startswith(LARGE_FLOOR):
                large = HomeConfig(layout="floor", start_count=_FLOOR_STARTS)
                return generate_home(seed, config=large)
            return generate_home(seed)
        from ippon.simulation.loader import load_scene

        return load_scene(Path(text))
    except SceneError as error:
        raise UsageError(f"home {text}: {error}") from error


def _seed_of(text: str) -> int | None:
    """Return the seed of what is generated, None for a folder."""
    digits = text.removeprefix(LARGE_FLOOR)
    return int(digits) if digits.isascii() and digits.isdecimal() else None
