import dataclasses

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.robot import ZED
from ippon.simulation.camera.renderer import Rendering
from ippon.simulation.segmentation.attribute_errors import AttributeErrorConfig, AttributeErrors
from ippon.simulation.world import SimulatedWorld, WorldConfig

RED = (178, 34, 38)
CAMERA = PinholeCamera.from_horizontal_fov(96, 64, 1.3)


@pytest.fixture
def many(make_scene):
    """A scene with 400 mugs and a bowl."""
    mugs = [
        ("objects", "mug", (x, y, 0.0), (x + 0.1, y + 0.1, 0.1))
        for x in range(20)
        for y in range(20)
    ]
    return make_scene([*mugs, ("objects", "bowl", (30.0, 0.0, 0.0), (30.2, 0.2, 0.1))])


def _errors(scene, seed=0, **config):
    return AttributeErrors(scene, ("mug",), AttributeErrorConfig(**config), seed)


def _views(count):
    """Positions farther apart than the errors of one object are correlated."""
    rng = np.random.default_rng(0)
    return rng.uniform(-60.0, 60.0, (count, 3)) * (1.0, 1.0, 0.0) + (0.0, 0.0, 1.3)


@pytest.mark.parametrize("thing_share", [0.0, 0.5, 1.0])
def test_the_rate_is_that_of_objects_and_views_together(many, thing_share):
    seen = [
        _errors(many, seed, rate=0.2, thing_share=thing_share).is_wrong(at)
        for seed in range(1_000_003, 20_000_000, 2_000_003)
        for at in _views(10)
    ]
    assert np.mean(seen) == pytest.approx(0.2, abs=0.025)


def test_what_is_constant_holds_in_all_views_and_the_rest_differs(many):
    def by_view(thing_share):
        errors = _errors(many, rate=0.3, thing_share=thing_share)
        return np.array([errors.is_wrong(at) for at in _views(40)])

    constant = by_view(1.0)
    assert (constant == constant[0]).all()
    assert by_view(0.0).mean(axis=0).std() < by_view(0.5).mean(axis=0).std() - 0.05


def test_similar_views_share_an_error(many):
    errors = _errors(many, rate=0.3, thing_share=0.0)
    same = [
        (errors.is_wrong(at) == errors.is_wrong(at + np.array([0.03, 0.0, 0.0]))).mean()
        for at in _views(20)
    ]
    assert np.mean(same) > 0.9


def test_an_object_in_error_is_drawn_in_another_colour_with_its_shades(many):
    errors = _errors(many, rate=0.5, thing_share=1.0)
    at = np.array([50.0, 0.0, 1.3])
    wrong = errors.is_wrong(at)
    bad, good = int(errors.instances[wrong][0]), int(errors.instances[~wrong][0])
    instance = np.full((4, 6), -1, np.int32)
    instance[:2, :2], instance[2:, :2], instance[:, 4:] = bad, good, 400
    color = np.full((4, 6, 3), RED, np.uint8)
    color[0] = np.array(RED) // 2
    shown = Rendering(color=color, depth=np.ones((4, 6), np.float32), instance=instance)
    changed = (errors.apply(shown, at) != color).any(axis=2)
    assert np.array_equal(changed, instance == bad), "neither the right ones nor the bowl"
    light, dark = errors.apply(shown, at)[1, 0].astype(float), errors.apply(shown, at)[0, 0]
    assert light[0] < 1.5 * max(light[1:]) or light.min() > 100, "it is not red any more"
    assert dark.sum() < light.sum()
    assert (color[1, 0] == RED).all(), "the rendering stays as it is"


def test_a_world_shows_the_errors_and_without_a_rate_none(furnished):
    def seen(rate):
        config = dataclasses.replace(
            WorldConfig.perfect(), attribute_errors=AttributeErrorConfig(rate=rate, thing_share=1.0)
        )
        shots = []
        for seed in range(6):
            world = SimulatedWorld(furnished, ZED, CAMERA, furnished.start_poses[0], seed, config)
            world.set_labels(("wall", "table"), "hat")
            world.step(Command(), 0.2)
            frame = world.observe()
            shots.append((frame.color != world.rendering.color).any(axis=2))
            hat = [i.label for i in furnished.instances].index("hat")
            assert not shots[-1][world.rendering.instance != hat].any()
        return [bool(one.any()) for one in shots]

    assert not any(seen(0.0))
    assert 0 < sum(seen(0.5)) < 6


def test_rates_that_mean_nothing_are_refused():
    with pytest.raises(ValueError, match=r"the rate lies in 0 to 0\.5"):
        AttributeErrorConfig(rate=0.6)
    with pytest.raises(ValueError, match="thing_share in 0 to 1"):
        AttributeErrorConfig(thing_share=-0.1)
