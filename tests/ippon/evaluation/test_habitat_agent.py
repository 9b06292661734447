import numpy as np
import pytest

from ippon.evaluation.habitat_agent import HM3D_GOALS, HabitatAgentConfig, IpponAgent
from ippon.guidance.prior import EmbeddedPrior
from ippon.observation import Heatmap

_PRIOR = EmbeddedPrior()


class _Blind:
    """Sees floor everywhere, and notes what it was shown."""

    def __init__(self):
        self.shown = []

    def segment(self, color, labels, ooi):
        self.shown.append((color.shape, ooi))
        probabilities = np.zeros((16, 12, len(labels) + (ooi not in labels)), np.uint8)
        probabilities[..., labels.index("floor")] = 255
        return Heatmap(labels=tuple(labels), ooi=ooi, probabilities=probabilities)


def _observations(**change):
    values = {
        "rgb": np.zeros((128, 96, 3), np.uint8),
        "depth": np.full((128, 96, 1), 0.5, np.float32),
        "gps": np.zeros(2, np.float32),
        "compass": np.zeros(1, np.float32),
        "objectgoal": np.array([4]),
    }
    return {**values, **change}


@pytest.fixture
def agent():
    def make(**config):
        sight = _Blind()
        levels = lambda resolved, labels: _PRIOR.levels(resolved, "", labels)  # noqa: E731
        return IpponAgent(sight, levels, HabitatAgentConfig(**config)), sight

    return make


def test_an_episode_begins_by_looking_down_at_the_challenge_s_rate(agent):
    searcher, sight = agent()
    assert searcher.state is None
    action = searcher.act(_observations())
    assert action["action"] == ("velocity_control", "velocity_stop")
    arguments = action["action_args"]
    assert arguments["linear_velocity"] == [-1.0]  # Standing: the range is 0 to 0.3 m/s.
    assert arguments["camera_pitch_velocity"] == [-1.0]
    assert arguments["camera_pitch_angular_velocity"] == [-1.0]
    assert arguments["velocity_stop"] == [-1.0]
    # The network sees every pixel, and is asked for the fifth goal of HM3D.
    assert sight.shown == [((128, 96, 3), "tv")]
    assert HM3D_GOALS[4] == "tv"


def test_it_looks_every_other_step_and_keeps_count_of_the_pitch(agent):
    searcher, sight = agent(steps_per_frame=2)
    for _ in range(6):
        searcher.act(_observations())
    assert len(sight.shown) == 3
    assert searcher._tilt_rad == pytest.approx(-6 * 0.045)
    searcher.reset()
    assert (searcher.state, searcher._tilt_rad) == (None, 0.0)


def test_pose_and_depth_are_read_as_habitat_means_them(agent):
    searcher, _ = agent(image_stride=2)
    depth = np.full((128, 96, 1), 0.5, np.float32)
    depth[:64] = 1.0
    depth[64:70] = 0.0
    seen = _observations(gps=np.array([2.0, 0.5]), compass=np.array([0.3]), depth=depth)
    searcher.act(seen)
    frame = searcher._frame(seen, np.array([2.0, 0.5]))
    # gps counts metres to the right, we to the left.
    np.testing.assert_allclose(frame.T_world_base[:2, 3], [2.0, -0.5])
    assert np.arctan2(frame.T_world_base[1, 0], frame.T_world_base[0, 0]) == pytest.approx(0.3)
    assert frame.depth.shape == (frame.camera.height, frame.camera.width) == (64, 48)
    assert set(np.unique(frame.depth)) == {0.0, 2.75}
    assert frame.camera.horizontal_fov == pytest.approx(searcher._config.robot.horizontal_fov_rad)


def test_a_base_that_does_not_move_has_met_something(agent):
    searcher, _ = agent()
    searcher.act(_observations())
    searcher._command = type(searcher._command)(linear_m_s=0.3)
    searcher._watch(np.array([0.03, 0.0]))
    assert not searcher._contact
    searcher._watch(np.array([0.001, 0.0]))
    assert searcher._contact


def test_missing_sensors_and_unknown_goals_are_named(agent):
    searcher, _ = agent()
    with pytest.raises(
        ValueError, match="needs the sensors compass, gps; it got depth, objectgoal"
    ):
        searcher.act({k: v for k, v in _observations().items() if k not in ("gps", "compass")})
    with pytest.raises(ValueError, match="objectgoal 9 is unknown; there are 0 to 5: chair, bed"):
        searcher.act(_observations(objectgoal=np.array([9])))
    with pytest.raises(ValueError, match="at least 1"):
        HabitatAgentConfig(steps_per_frame=0)
