"""Registry of the navigators on this machine, so that `ippon ask` needs no address."""

import contextlib
import logging
import os
import re
from pathlib import Path
from typing import Final

import msgspec
import platformdirs

from app.messages.control import decode
from ippon.atomic_file import replace_file

logger = logging.getLogger(__name__)

_ANY_ADDRESS: Final = re.compile(r"/(localhost|127\.0\.0\.1|0\.0\.0\.0|\[::1?\])(?=:)")
"""Of this machine, whichever way it is written."""
_START_TICKS: Final = 19
"""Place of a process's start, in ticks since that of the machine, after its name in /proc."""


class RunningNavigator(msgspec.Struct, frozen=True, kw_only=True):
    """One navigator and its address."""

    pid: int
    robot: str
    endpoint: str
    page: str | None = None
    """Address of the console that was started with it."""


class _Noted(RunningNavigator, frozen=True, kw_only=True):
    """What the file of a navigator holds."""

    process: str = ""
    """See `_process`; empty in a file of an earlier version, and on systems that do not tell."""


def registry_folder() -> Path:
    """Return the folder that holds one file for each running navigator.

    It is in the user's cache, not in the runtime folder: a terminal of another login, of `sudo`
    or of a container has no runtime folder or a different one, and would see no navigator.
    """
    return platformdirs.user_cache_path("ippon") / "navigators"


def register(navigator: RunningNavigator) -> Path | None:
    """Write a navigator's file.

    Returns:
        Its path, which the navigator removes at its end; None if it cannot be written: requests
        then need the navigator's address.
    """
    folder = registry_folder()
    path = folder / f"{navigator.pid}.json"
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        noted = _Noted(**msgspec.structs.asdict(navigator), process=_process(navigator.pid))
        replace_file(path, msgspec.json.encode(noted))
    except OSError as error:
        logger.warning(
            "cannot note this navigator in %s (%s): `ippon ask` finds it with --connect %s "
            "--robot %s only",
            folder,
            error.strerror,
            navigator.endpoint,
            navigator.robot,
        )
        return None
    return path


def running_navigators() -> list[RunningNavigator]:
    """Return the navigators that run, oldest first; files of dead ones are removed."""
    found: list[tuple[float, RunningNavigator]] = []
    for path in _files(registry_folder()):
        try:
            started = path.stat().st_mtime
            noted = decode(path.read_bytes(), _Noted)
        except (OSError, msgspec.DecodeError):
            continue
        if _runs(noted):
            navigator = RunningNavigator(
                pid=noted.pid, robot=noted.robot, endpoint=noted.endpoint, page=noted.page
            )
            found.append((started, navigator))
        else:
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


def _runs(noted: _Noted) -> bool:
    if not _alive(noted.pid):
        return False
    now = _process(noted.pid)
    return "" in (now, noted.process) or now == noted.process


def _process(pid: int) -> str:
    """Return what tells a process from later ones of its number; empty where Linux does not tell.

    The files outlive a power cut, and after a start the same numbers are given again. Times of the
    wall clock would not do: a robot without a battery for its clock sets it after its start.
    """
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text("ascii").strip()
        # The name of the program stands in brackets and may hold any character.
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
        return f"{boot} {fields[_START_TICKS].decode()}"
    except (OSError, ValueError, IndexError):
        return ""


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
