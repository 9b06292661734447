"""The process behind `app.habitat.link`: a `habitat.Env` served over a socket.

The challenge's habitat-lab does not support Python 3.11, which this program requires. This file
therefore runs in habitat's own Python (3.8 or later), imports nothing of this program, and sends
builtin types only, because numpy 1 cannot read all pickles of numpy 2.
"""

from __future__ import annotations

import importlib
import numbers
import sys
from multiprocessing.connection import Connection
from typing import Any

import numpy as np


def serve(connection: Connection, config_path: str, overrides: list[str]) -> None:
    """Open the environment, send its number of episodes, and answer until the other side closes.

    None requests the next episode; otherwise the request is an action with names and arguments.
    """
    habitat: Any = importlib.import_module("habitat")
    config = habitat.get_config(config_path, overrides)
    with habitat.Env(config=config) as env:
        connection.send(len(env.episodes))
        while True:
            try:
                action = connection.recv()
            except EOFError:
                return
            observations = env.reset() if action is None else env.step(_action(*action))
            connection.send(_answer(env, observations))


def _action(names: tuple[str, ...], arguments: dict[str, list[float]]) -> dict[str, Any]:
    arrays = {name: np.array(values, np.float32) for name, values in arguments.items()}
    return {"action": names, "action_args": arrays}


def _answer(env: Any, observations: Any) -> dict[str, Any]:
    """Return the agent's observations and, once the episode is over, its measures."""
    episode, over = env.current_episode, bool(env.episode_over)
    arrays = {name: np.asarray(value) for name, value in observations.items()}
    metrics = env.get_metrics() if over else {}
    return {
        "observations": {n: (a.dtype.str, a.shape, a.tobytes()) for n, a in arrays.items()},
        "over": over,
        "metrics": {n: float(v) for n, v in metrics.items() if isinstance(v, numbers.Real)},
        "episode_id": str(episode.episode_id),
        "scene_id": str(episode.scene_id),
        "object_category": str(episode.object_category),
    }


if __name__ == "__main__":
    serve(Connection(int(sys.argv[1])), sys.argv[2], sys.argv[3:])
