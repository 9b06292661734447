"""Our metrics against habitat-lab's own, in an environment that has it (docs/guides/habitat.md)."""

import importlib.util
import math
from itertools import pairwise

import numpy as np
import pytest

from ippon.evaluation.episode_generation import EpisodeGenerationConfig, list_episodes
from ippon.evaluation.metrics import Judge
from ippon.robot import HABITAT
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.robot.navigation_grid import robot_grid
from tests.habitat.lab import import_habitat, to_habitat, write_dataset

pytestmark = [
    pytest.mark.skipif(
        importlib.util.find_spec("habitat") is None,
        reason="habitat-lab is not installed; see docs/guides/habitat.md",
    ),
    pytest.mark.filterwarnings("ignore"),
    pytest.mark.slow,
]
_GOALS = ("bed", "chair", "toilet", "plant")


def _register_simulator(walks):
    """Register a simulator that replays walks: each forward action is the next position."""
    import quaternion
    from gym import spaces
    from habitat.core.registry import registry
    from habitat.core.simulator import AgentState, SensorSuite, Simulator

    @registry.register_simulator(name="IpponReplay-v0")
    class IpponReplay(Simulator):
        def __init__(self, config):
            self.habitat_config = config
            self._suite = SensorSuite([])
            self._action_space = spaces.Discrete(6)
            self._walk, self._judge, self._at = None, None, 0

        @property
        def sensor_suite(self):
            return self._suite

        @property
        def action_space(self):
            return self._action_space

        @property
        def previous_step_collided(self):
            return False

        def reconfigure(self, config, episode):
            self._walk, self._judge = walks[int(episode.episode_id)]
            self._at = 0

        def reset(self, episode=None):
            return self._suite.get_observations()

        def step(self, action):
            # 1 is move_forward; actions that steer themselves come as None.
            if action == 1:
                self._at += 1
            return self._suite.get_observations()

        def step_physics(self, dt):
            pass

        def seed(self, seed):
            pass

        def close(self, destroy=True):
            pass

        def get_agent_state(self, agent_id=0):
            return AgentState(position=to_habitat(self._walk[self._at]), rotation=quaternion.one)

        def geodesic_distance(self, position_a, position_b, episode=None):
            given = np.array(position_b, np.float64).reshape(-1, 3)
            ours = np.array([to_habitat(p) for p in self._judge.viewpoints])
            assert np.allclose(given, ours), "the dataset's viewpoints are the judge's"
            return self._judge.distance_m((position_a[0], -position_a[2]))


def _walks(home, robot, rng):
    """Walks over free floor: towards the goal, some to its end, some away, and one on the spot."""
    grid = robot_grid(home, robot)
    episodes, _ = list_episodes(
        home, "5", robot, EpisodeGenerationConfig(goals=_GOALS, starts_per_goal=2)
    )
    for k, episode in enumerate(episodes):
        judge = Judge(home, robot, episode.goal, grid=grid)
        way = judge.path_from((episode.start.x, episode.start.y))
        pieces = [
            a + t * (b - a)
            for a, b in pairwise(way)
            for t in np.linspace(0.0, 1.0, max(2, math.ceil(np.linalg.norm(b - a) / 0.1)))
        ]
        end = (len(pieces), len(pieces) // 2, 1)[k % 3]
        walk = np.array(pieces[:end])
        if k % 2:
            # A detour: on the spot and back again costs length and no progress.
            walk = np.concatenate([walk, walk[::-1], walk])
        jitter = rng.normal(0.0, 1e-3, walk.shape)
        jitter[0] = 0.0
        yield episode, judge, walk + jitter, k % 4 != 3


def _environment(habitat, data):
    from habitat.config import read_write
    from habitat.config.default import get_config

    config = get_config("benchmark/nav/objectnav/objectnav_hm3d.yaml")
    with read_write(config):
        config.habitat.simulator.type = "IpponReplay-v0"
        config.habitat.simulator.agents.main_agent.sim_sensors = {}
        config.habitat.dataset.data_path = str(data)
        config.habitat.dataset.split = "val"
        config.habitat.environment.max_episode_steps = 100_000
        config.habitat.environment.iterator_options.shuffle = False
    return habitat.Env(config=config)


def test_habitat_lab_measures_what_we_measure(tmp_path):
    habitat = import_habitat()
    home = generate_home(5)
    runs = list(_walks(home, HABITAT, np.random.default_rng(0)))
    assert len(runs) >= 6
    data = tmp_path / "val.json.gz"
    write_dataset(data, [(episode, judge) for episode, judge, _, _ in runs], _GOALS)
    _register_simulator([(walk, judge) for _, judge, walk, _ in runs])
    outcomes = set()
    with _environment(habitat, data) as env:
        for _ in runs:
            env.reset()
            _, judge, walk, stops = runs[int(env.current_episode.episode_id)]
            for _ in range(len(walk) - 1):
                env.step("move_forward")
            if stops:
                env.step("stop")
            theirs = env.get_metrics()
            ours = judge.metrics(walk, stopped=stops)
            assert ours.distance_to_goal_m == pytest.approx(theirs["distance_to_goal"], abs=1e-4)
            assert float(ours.success) == theirs["success"]
            assert ours.spl == pytest.approx(theirs["spl"], abs=1e-4)
            assert ours.soft_spl == pytest.approx(theirs["soft_spl"], abs=1e-4)
            outcomes.add((ours.success, stops))
    # Successes, stops in the wrong place and walks without a stop were all among them.
    assert outcomes >= {(True, True), (False, True), (False, False)}
