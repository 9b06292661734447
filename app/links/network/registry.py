"""Registry of the navigators on this machine, so that `ippon ask` needs no address."""

import contextlib
import logging
import os
import re
import tempfile
from pathlib import Path
from typing import IO, Final

import msgspec
import platformdirs

from app.messages.control import decode
from app.process.boot import boot_id
from app.process.file_lock import hold, is_held

logger = logging.getLogger(__name__)

_ANY_ADDRESS: Final = re.compile(r"/(localhost|127\.0\.0\.1|0\.0\.0\.0|\[::1?\])(?=:)")
"""Of this machine, whichever way it is written."""


class RunningNavigator(msgspec.Struct, frozen=True, kw_only=True):
    """One navigator and its address."""

    pid: int
    robot: str
    endpoint: str


class _Noted(RunningNavigator, frozen=True, kw_only=True):
    """A navigator as its file tells it."""

    boot: str = ""
    """Of its machine: several may share the folder, and each sees the locks of the others."""


def registry_folder() -> Path:
    """Return the folder that holds one file for each running navigator.

    It is in the user's cache, not in the runtime folder: a terminal of another login, of `sudo`
    or of a container has no runtime folder or a different one, and would see no navigator.
    """
    return platformdirs.user_cache_path("ippon") / "navigators"


class Registration:
    """A navigator's file, locked while it runs."""

    def __init__(self, path: Path, file: IO[bytes]) -> None:
        self.path = path
        self._file = file

    def close(self) -> None:
        """Remove it."""
        self.path.unlink(missing_ok=True)
        self._file.close()


def register(navigator: RunningNavigator) -> Registration | None:
    """Write a navigator's file.

    Returns:
        It, which the navigator keeps, and closes at its end; None if it cannot be written: requests
        then need the navigator's address.
    """
    folder = registry_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        number, path = tempfile.mkstemp(".json", f"{navigator.pid}-", folder)
    except OSError as error:
        _warn(folder, navigator, error)
        return None
    file = os.fdopen(number, "wb", buffering=0)
    # An empty file is nobody's. What has content and no lock is that of a dead navigator.
    hold(file)
    entry = Registration(Path(path), file)
    try:
        noted = _Noted(**msgspec.structs.asdict(navigator), boot=boot_id())
        file.write(msgspec.json.encode(noted))
    except OSError as error:
        entry.close()
        _warn(folder, navigator, error)
        return None
    return entry


def _warn(folder: Path, navigator: RunningNavigator, error: OSError) -> None:
    logger.warning(
        "cannot note this navigator in %s (%s): `ippon ask` finds it with --connect %s "
        "--robot %s only",
        folder,
        error.strerror,
        navigator.endpoint,
        navigator.robot,
    )


def running_navigators() -> list[RunningNavigator]:
    """Return the navigators that run here, oldest first; files of dead ones are removed."""
    found: list[tuple[float, RunningNavigator]] = []
    boot = boot_id()
    for path in _files(registry_folder()):
        # That of an earlier version has neither boot nor lock.
        is_old = path.stem.isdecimal()
        try:
            started = path.stat().st_mtime
            noted = decode(path.read_bytes(), _Noted)
            is_here = is_old or noted.boot == boot
            runs = not is_here or _alive(noted.pid)
            if not is_old:
                runs = is_held(path, unknown=runs)
        except (OSError, msgspec.DecodeError):
            continue
        if runs and is_here:
            navigator = RunningNavigator(pid=noted.pid, robot=noted.robot, endpoint=noted.endpoint)
            found.append((started, navigator))
        elif not runs:
            # A file that cannot be removed is ignored again the next time.
            with contextlib.suppress(OSError):
                path.unlink()
    return [navigator for _, navigator in sorted(found, key=lambda entry: entry[0])]


def resolve_address(connect: str | None, robot: str | None) -> tuple[str, str]:
    """Return a navigator's endpoint and prefix, completed from the registry.

    Args:
        connect: zenoh endpoint; None for that of the navigator started last on this machine, else
            the standard one.
        robot: Key prefix; None for that of the navigator at the endpoint.

    Returns:
        Endpoint and prefix.
    """
    running = running_navigators() if connect is None or robot is None else []
    fitting = [
        one
        for one in running
        if robot in (None, one.robot) and (connect is None or _listens_at(one, connect))
    ]
    if fitting:
        connect, robot = connect or fitting[-1].endpoint, robot or fitting[-1].robot
    elif running and connect is None:
        # A robot may have its messages carried by the navigator of another one.
        connect = running[-1].endpoint
    return connect or "tcp/127.0.0.1:7447", robot or "ippon"


def _listens_at(navigator: RunningNavigator, endpoint: str) -> bool:
    """Return whether a navigator of this machine is reached at an endpoint."""
    listens, asked = _ANY_ADDRESS.sub("//", navigator.endpoint), _ANY_ADDRESS.sub("//", endpoint)
    return listens == asked


def _files(folder: Path) -> list[Path]:
    try:
        return [path for path in folder.iterdir() if path.suffix == ".json"]
    except OSError:
        return []


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
