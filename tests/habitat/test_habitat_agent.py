"""The agent in habitat-lab's own loop, in an environment that has it (docs/guides/habitat.md)."""

import dataclasses
import importlib.util

import numpy as np
import pytest

from app.evaluation.habitat_episodes import run_episodes
from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.evaluation.episode_generation import EpisodeGenerationConfig, list_episodes
from ippon.evaluation.habitat_agent import HM3D_GOALS, HabitatAgentConfig, IpponAgent
from ippon.evaluation.metrics import Judge
from ippon.guidance.prior import EmbeddedPrior
from ippon.robot import HABITAT
from ippon.simulation.robot.mobile_base import BaseConfig
from ippon.simulation.segmentation.segmenter import SegmenterConfig, SimulatedSegmenter
from ippon.simulation.world import SimulatedWorld, WorldConfig
from tests.boxes import boxes_scene
from tests.habitat.lab import import_habitat, to_habitat, to_rotation, write_dataset

pytestmark = [
    pytest.mark.skipif(
        importlib.util.find_spec("habitat") is None,
        reason="habitat-lab is not installed; see docs/guides/habitat.md",
    ),
    pytest.mark.filterwarnings("ignore"),
    pytest.mark.slow,
]
_ROOM = [
    ("floor", "floor", (-0.1, -0.1, -0.1), (6.1, 5.1, 0.0)),
    ("wall", "wall", (-0.1, -0.1, 0.0), (0.0, 5.1, 2.5)),
    ("wall", "wall", (6.0, -0.1, 0.0), (6.1, 5.1, 2.5)),
    ("wall", "wall", (0.0, -0.1, 0.0), (6.0, 0.0, 2.5)),
    ("wall", "wall", (0.0, 5.0, 0.0), (6.0, 5.1, 2.5)),
    ("table", "dining table", (2.6, 2.0, 0.0), (3.6, 3.0, 0.7)),
    ("sofa", "couch", (4.9, 3.2, 0.0), (5.9, 4.9, 0.8)),
    ("chair", "armchair", (0.4, 4.1, 0.0), (1.1, 4.8, 0.9)),
]
_CAMERA = PinholeCamera.from_horizontal_fov(96, 128, HABITAT.horizontal_fov_rad)
# The challenge's base has its velocity at once; it knows no acceleration.
_BASE = dataclasses.replace(
    HABITAT, max_linear_acceleration_m_s2=1e6, max_yaw_acceleration_rad_s2=1e6
)
_WORLD = dataclasses.replace(WorldConfig.perfect(), base=BaseConfig(sliding=False))


class _Sight:
    """The simulated segmentation behind the interface of a network."""

    def __init__(self, live):
        self._live, self._model, self._frame = live, None, 0

    def segment(self, color, labels, ooi):
        world = self._live["world"]
        assert color.shape == (*world.rendering.depth.shape, 3)
        if self._model is None or self._model.ooi != ooi:
            self._model = SimulatedSegmenter(
                world.scene, labels, ooi, SegmenterConfig.perfect(),
                is_instance_of=lambda name, wanted: {"couch": "sofa"}.get(name, name) == wanted,
            )  # fmt: skip
        self._frame += 1
        return self._model.segment(world.rendering, np.zeros(3), self._frame)


def _register(live, runs):
    """Register a simulator that is our world, and the challenge's two actions."""
    import quaternion
    from gym import spaces
    from habitat.core.embodied_task import SimulatorTaskAction
    from habitat.core.registry import registry
    from habitat.core.simulator import (
        AgentState,
        DepthSensor,
        RGBSensor,
        SensorSuite,
        Simulator,
    )

    class Rgb(RGBSensor):
        def _get_observation_space(self, *args, **kwargs):
            return spaces.Box(0, 255, (_CAMERA.height, _CAMERA.width, 3), np.uint8)

        def get_observation(self, *args, **kwargs):
            return live["frame"].color

    class Depth(DepthSensor):
        def _get_observation_space(self, *args, **kwargs):
            return spaces.Box(0.0, 1.0, (_CAMERA.height, _CAMERA.width, 1), np.float32)

        def get_observation(self, *args, **kwargs):
            depth = live["world"].rendering.depth
            near, far = HABITAT.min_depth_m, HABITAT.max_depth_m
            return ((np.clip(depth, near, far) - near) / (far - near))[..., None]

    @registry.register_simulator(name="IpponWorld-v0")
    class IpponWorld(Simulator):
        previous_step_collided = False

        def __init__(self, config):
            self.habitat_config = config
            self._suite = SensorSuite([Rgb(config=config), Depth(config=config)])

        @property
        def sensor_suite(self):
            return self._suite

        @property
        def action_space(self):
            return spaces.Discrete(6)

        def reconfigure(self, config, episode):
            spec, live["judge"] = runs[int(episode.episode_id)]
            live["world"] = SimulatedWorld(
                live["scene"], _BASE, _CAMERA, spec.start, spec.seed, _WORLD
            )

        def reset(self, episode=None):
            return self._look()

        def step(self, action):
            return self._look()

        def _look(self):
            live["frame"] = live["world"].observe()
            return self._suite.get_observations()

        def step_physics(self, dt):
            pass

        def seed(self, seed):
            pass

        def close(self, destroy=True):
            pass

        def get_agent_state(self, agent_id=0):
            base = live["world"].base
            x, y, z, w = to_rotation(base.yaw_rad)
            return AgentState(
                position=to_habitat((base.x_m, base.y_m)),
                rotation=quaternion.quaternion(w, x, y, z),
            )

        def geodesic_distance(self, position_a, position_b, episode=None):
            return live["judge"].distance_m((position_a[0], -position_a[2]))

    @registry.register_task_action(name="IpponVelocity")
    class Velocity(SimulatorTaskAction):
        def step(self, *args, linear_velocity, angular_velocity, **kwargs):
            world = live["world"]
            pitch = float(kwargs["camera_pitch_angular_velocity"][0])
            assert min(linear_velocity[0], angular_velocity[0], pitch) >= -1.0
            assert max(linear_velocity[0], angular_velocity[0], pitch) <= 1.0
            tilt = world.base.tilt_rad + 0.45 * 0.1 * pitch
            speed = 0.15 * (float(linear_velocity[0]) + 1.0)
            turn = 0.45 * float(angular_velocity[0])
            if kwargs["velocity_stop"][0] <= 0.0:
                command = Command(linear_m_s=speed, yaw_rate_rad_s=turn, tilt_rad=tilt)
                world.step(command, 0.1)

    @registry.register_task_action(name="IpponStop")
    class Stop(SimulatorTaskAction):
        def reset(self, task, *args, **kwargs):
            task.is_stop_called = False

        def step(self, task, *args, velocity_stop, **kwargs):
            task.is_stop_called = bool(velocity_stop[0] > 0.0)


def _environment(habitat, data):
    from habitat.config.default import get_config
    from habitat.config.default_structured_configs import ActionConfig
    from omegaconf import OmegaConf

    config = get_config("benchmark/nav/objectnav/objectnav_hm3d.yaml")
    OmegaConf.set_readonly(config, False)
    OmegaConf.set_struct(config, False)
    config.habitat.simulator.type = "IpponWorld-v0"
    config.habitat.simulator.agents.main_agent.sim_sensors = {}
    config.habitat.dataset.data_path = str(data)
    config.habitat.dataset.split = "val"
    config.habitat.environment.max_episode_steps = 4000
    config.habitat.environment.iterator_options.shuffle = False
    config.habitat.task.actions = {
        "velocity_control": ActionConfig(type="IpponVelocity"),
        "velocity_stop": ActionConfig(type="IpponStop"),
    }
    return habitat.Env(config=config)


def test_the_agent_finds_things_in_habitat_lab_s_own_loop(tmp_path):
    habitat = import_habitat()
    scene = boxes_scene(_ROOM, ((1.2, 0.8), (4.6, 1.0)))
    goals = EpisodeGenerationConfig(goals=("chair", "sofa"))
    episodes, _ = list_episodes(scene, "7", HABITAT, goals)
    runs = [(episode, Judge(scene, HABITAT, episode.goal)) for episode in episodes]
    assert [episode.goal for episode in episodes] == ["chair", "sofa"]
    data = tmp_path / "val.json.gz"
    write_dataset(data, runs, HM3D_GOALS)
    live = {"scene": scene}
    _register(live, runs)
    prior = EmbeddedPrior()
    agent = IpponAgent(
        _Sight(live),
        lambda resolved, labels: prior.levels(resolved, "", labels),
        HabitatAgentConfig(image_stride=1),
    )
    with _environment(habitat, data) as env:
        for result in run_episodes(env, agent, len(runs)):
            world, judge = live["world"], live["judge"]
            ours = judge.metrics(world.trajectory, stopped=result["ending"] == "found")
            assert result["success"] == float(ours.success) == 1.0, result
            assert ours.spl == pytest.approx(result["spl"], abs=1e-4)
            assert ours.soft_spl == pytest.approx(result["soft_spl"], abs=1e-4)
            assert ours.distance_to_goal_m == pytest.approx(result["distance_to_goal"], abs=1e-4)
            # The agent, which no sensor tells, knows where its camera looks.
            assert agent._tilt_rad == pytest.approx(world.base.tilt_rad, abs=1e-3)
            assert result["steps"] < 4000
