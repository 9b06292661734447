"""Which navigators run on this machine, so that `ippon ask` needs no address."""

import os
from pathlib import Path

import msgspec
import platformdirs


class RunningNavigator(msgspec.Struct, frozen=True, kw_only=True):
    """One navigator and how to reach it."""

    pid: int
    robot: str
    endpoint: str
    page: str | None = None
    """Address of the console that was started with it."""


def registry_folder() -> Path:
    """Return the folder that holds one file for each running navigator."""
    if "XDG_RUNTIME_DIR" in os.environ:
        return platformdirs.user_runtime_path("ippon") / "navigators"
    return platformdirs.user_cache_path("ippon") / "navigators"


def register(navigator: RunningNavigator) -> Path:
    """Write a navigator's file and return its path; the navigator removes it when it ends."""
    folder = registry_folder()
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    path = folder / f"{navigator.pid}.json"
    partial = path.with_suffix(".part")
    partial.write_bytes(msgspec.json.encode(navigator))
    partial.replace(path)
    return path


def running_navigators() -> list[RunningNavigator]:
    """Return the navigators that run, oldest first; files of dead ones are removed."""
    found: list[tuple[float, RunningNavigator]] = []
    for path in registry_folder().glob("*.json"):
        try:
            started = path.stat().st_mtime
            navigator = msgspec.json.decode(path.read_bytes(), type=RunningNavigator)
        except (OSError, msgspec.DecodeError):
            continue
        if _alive(navigator.pid):
            found.append((started, navigator))
        else:
            path.unlink(missing_ok=True)
    return [navigator for _, navigator in sorted(found, key=lambda entry: entry[0])]


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
