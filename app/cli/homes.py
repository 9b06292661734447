"""`--home`: a seed or a folder."""

from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.errors import UsageError

if TYPE_CHECKING:
    from ippon.simulation.scene import Scene

MAX_SEED = 2**31 - 1


def check_home(text: str) -> None:
    """Refuse what is neither a seed nor a folder with a home.

    Raises:
        UsageError: With what would work.
    """
    if _is_seed(text):
        if int(text) > MAX_SEED:
            raise UsageError(f"a home's seed is at most {MAX_SEED}; got {text}")
        return
    folder = Path(text)
    if not text or not folder.is_dir():
        raise UsageError(
            f"no home {text!r}: give a seed (a whole number, for example 3) or a folder that holds "
            "scene.glb and scene.json"
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
        if _is_seed(text):
            from ippon.simulation.homes.generator import generate_home

            return generate_home(int(text))
        from ippon.simulation.loader import load_scene

        return load_scene(Path(text))
    except SceneError as error:
        raise UsageError(f"home {text}: {error}") from error


def _is_seed(text: str) -> bool:
    return text.isascii() and text.isdecimal()
