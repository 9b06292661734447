"""A `habitat.Env` that runs in another process, under another Python (docs/guides/habitat.md)."""

import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

_PROGRAM: Final = Path(__file__).with_name("environment.py")
_GRACE_S: Final = 10.0


class HabitatProcessError(Exception):
    """The process with habitat-lab could not be started, or has ended; the text says what to do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HabitatEpisode:
    """An episode of habitat's data set."""

    episode_id: str
    scene_id: str
    object_category: str


class RemoteEnv:
    """The part of `habitat.Env` that is needed to run episodes.

    Attributes:
        episode_count: Episodes of the data set.
        episode_over: Whether the episode has ended, by a stop or a limit.
        current_episode: The episode of the last observations, None before the first.
    """

    def __init__(self, python: Path, config: str, overrides: Sequence[str] = ()) -> None:
        """Start the process and wait until the environment is open.

        Args:
            python: Interpreter with habitat-sim and habitat-lab.
            config: habitat-lab's YAML, as for `habitat.get_config`.
            overrides: Overrides of it.

        Raises:
            HabitatProcessError: There is no such interpreter, or the environment does not open.
        """
        mine, theirs = socket.socketpair()
        with mine, theirs:
            number = theirs.fileno()
            try:
                # In a session of its own, so that Ctrl-C reaches only this process. It writes to
                # stdout.
                self._process = subprocess.Popen(  # noqa: S603 (the user names the program)
                    [str(python), str(_PROGRAM), str(number), config, *overrides],
                    pass_fds=(number,),
                    stdin=subprocess.DEVNULL,
                    stdout=sys.stderr,
                    start_new_session=True,
                )
            except OSError as error:
                raise HabitatProcessError(
                    f"{python} does not start ({error.strerror}); --python is the interpreter of "
                    "the environment with habitat-sim and habitat-lab, see docs/guides/habitat.md"
                ) from error
            self._connection = Connection(mine.detach())
        self.episode_over = False
        self.current_episode: HabitatEpisode | None = None
        self._metrics: dict[str, float] = {}
        try:
            self.episode_count = int(self._receive())
        except HabitatProcessError:
            self.close()
            raise

    def __enter__(self) -> Self:
        """Return the environment."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the process."""
        self.close()

    def close(self) -> None:
        """End the process; kill it if it does not end."""
        self._connection.close()
        try:
            self._process.wait(_GRACE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def reset(self) -> dict[str, NDArray[Any]]:
        """Begin the next episode and return the first observations."""
        return self._ask(None)

    def step(self, action: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
        """Act and return the next observations.

        Args:
            action: `action`, names; `action_args`, an array each.
        """
        arguments = {n: np.ravel(v).tolist() for n, v in action["action_args"].items()}
        return self._ask((tuple(action["action"]), arguments))

    def get_metrics(self) -> dict[str, float]:
        """Return habitat's scalar measures of the episode, once it is over."""
        return self._metrics

    def _ask(
        self, question: tuple[tuple[str, ...], dict[str, list[float]]] | None
    ) -> dict[str, NDArray[Any]]:
        try:
            self._connection.send(question)
        except BrokenPipeError as error:
            raise self._ended() from error
        answer = self._receive()
        self.episode_over, self._metrics = answer["over"], answer["metrics"]
        self.current_episode = HabitatEpisode(
            episode_id=answer["episode_id"],
            scene_id=answer["scene_id"],
            object_category=answer["object_category"],
        )
        return {
            name: np.frombuffer(content, np.dtype(kind)).reshape(shape)
            for name, (kind, shape, content) in answer["observations"].items()
        }

    def _receive(self) -> Any:
        try:
            return self._connection.recv()
        except (EOFError, ConnectionResetError) as error:
            raise self._ended() from error

    def _ended(self) -> HabitatProcessError:
        status = self._process.wait()
        return HabitatProcessError(
            f"habitat's process ended with status {status}; see its output above; "
            f"docs/guides/habitat.md describes how to install its environment"
        )
