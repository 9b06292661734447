"""What a frame of the simulated robot costs; `pytest -m benchmark` prints the table.

AMD EPYC, one of two cores, the other busy; step, noise and segmentation included; mean of 60:

| home | 240x150 | 320x200 | 400x250 |
| generated, 13 k triangles | 4.7 ms | 5.8 ms | 7.3 ms |
| textured, 116 k triangles | 7.2 ms | 9.1 ms | 11.6 ms |
"""

import itertools

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.robot import ZED
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.scene_reader import load_scene
from ippon.simulation.world import SimulatedWorld
from ippon.vocabulary import MATTERPORT_40

pytestmark = pytest.mark.benchmark

SIZES = [(240, 150), (320, 200), (400, 250)]


def measure(benchmark, scene, width, height):
    camera = PinholeCamera.from_horizontal_fov(width, height, ZED.horizontal_fov_rad)
    world = SimulatedWorld(scene, ZED, camera, scene.start_poses[0], seed=0)
    world.set_labels(MATTERPORT_40, "hat")
    turns = itertools.cycle([0.6, 0.6, -0.2, 0.9])

    def frame():
        world.step(Command(linear_m_s=0.4, yaw_rate_rad_s=next(turns), tilt_rad=-0.3), 0.2)
        return world.observe()

    frame()
    seen = benchmark.pedantic(frame, rounds=60, iterations=1)
    assert seen.heatmap is not None
    assert np.count_nonzero(seen.depth) > 0


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_a_frame_in_a_generated_home(benchmark, width, height):
    measure(benchmark, generate_home(3), width, height)


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_a_frame_in_a_textured_home_of_a_hundred_thousand_triangles(
    benchmark, width, height, scenes_folder
):
    measure(benchmark, load_scene(scenes_folder / "aws_small_house"), width, height)
