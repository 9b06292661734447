"""habitat's environment in another process; a small module stands for habitat-lab."""

import ast
import dataclasses
import os
import sys
from pathlib import Path

import numpy as np
import pytest

from app.habitat.link import HabitatEpisode, HabitatProcessError, RemoteEnv

pytestmark = pytest.mark.process
_LAB = """
import numpy as np

def get_config(path, overrides):
    if path == "missing.yaml":
        raise FileNotFoundError(path)
    return (path, *overrides)

class Episode:
    scene_id = "hm3d_v0.2/val/home.glb"
    object_category = "bed"
    def __init__(self, number):
        self.episode_id = str(number)

class Env:
    def __init__(self, config):
        print("habitat writes to stdout")
        self.config, self.episodes, self.number = config, [1, 2, 3], 0
    def __enter__(self):
        return self
    def __exit__(self, *error):
        pass
    def reset(self):
        self.number += 1
        self.current_episode, self.steps, self.episode_over = Episode(self.number), 0, False
        return self._look({"words": len(self.config)})
    def step(self, action):
        if action["action_args"]["linear_velocity"][0] > 1:
            raise ValueError("too fast")
        self.steps += 1
        self.episode_over = bool(action["action_args"]["velocity_stop"][0] > 0)
        assert action["action"] == ("velocity_control", "velocity_stop"), action
        return self._look({"linear": action["action_args"]["linear_velocity"]})
    def _look(self, more):
        rgb = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)[:, ::2]
        return {"rgb": rgb, "depth": np.full((2, 2, 1), 0.1, np.float32), **more}
    def get_metrics(self):
        return {"success": np.float64(1.0), "steps": self.steps, "collisions": {"count": 0}}
"""


def _action(linear, stop=-1.0):
    return {
        "action": ("velocity_control", "velocity_stop"),
        "action_args": {
            "linear_velocity": np.array([linear], np.float32),
            "velocity_stop": np.array([stop], np.float32),
        },
    }


@pytest.fixture(name="lab")
def _lab(tmp_path, monkeypatch):
    (tmp_path / "habitat.py").write_text(_LAB, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    # Another Python, such as one of an environment with numpy 1, tests the same.
    return Path(os.environ.get("IPPON_HABITAT_PYTHON", sys.executable))


def test_what_habitat_shows_and_measures_comes_across(lab):
    with RemoteEnv(lab, "task.yaml", ("a.b=1", "c=2")) as env:
        assert env.episode_count == 3
        seen = env.reset()
        assert seen["rgb"].dtype == np.uint8
        assert np.array_equal(seen["rgb"], np.arange(24).reshape(2, 4, 3)[:, ::2])
        assert seen["depth"].dtype == np.float32
        assert seen["depth"].shape == (2, 2, 1)
        assert int(seen["words"]) == 3, "path and overrides"
        seen = env.step(_action(0.25))
        assert seen["linear"].tolist() == [0.25]
        assert seen["linear"].dtype == np.float32
        assert not env.episode_over
        env.step(_action(0.0, stop=1.0))
        assert env.episode_over
        assert env.get_metrics() == {"success": 1.0, "steps": 2.0}
        env.reset()
        assert not env.episode_over
        first = HabitatEpisode(
            episode_id="1", scene_id="hm3d_v0.2/val/home.glb", object_category="bed"
        )
        assert env.current_episode == dataclasses.replace(first, episode_id="2")


def test_the_end_of_habitat_s_process_says_where_to_look(lab):
    with RemoteEnv(lab, "task.yaml") as env:
        env.reset()
        with pytest.raises(HabitatProcessError, match=r"status 1; .*docs/guides/habitat\.md"):
            env.step(_action(2.0))
        with pytest.raises(HabitatProcessError, match="ended with status 1"):
            env.reset()


def test_an_environment_that_does_not_open_is_an_error(lab):
    with pytest.raises(HabitatProcessError, match="ended with status 1"):
        RemoteEnv(lab, "missing.yaml")


def test_an_interpreter_that_is_not_there_is_named(tmp_path):
    with pytest.raises(HabitatProcessError, match=r"python3\.9 does not start .*--python"):
        RemoteEnv(tmp_path / "python3.9", "task.yaml")


def test_the_other_process_runs_on_old_python_and_without_this_program():
    source = Path("app/habitat/environment.py").read_text(encoding="utf-8")
    tree = ast.parse(source, feature_version=(3, 8))
    modules = {
        alias.name if isinstance(node, ast.Import) else node.module
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    assert not [m for m in modules if m.split(".")[0] in {"app", "ippon"}]
